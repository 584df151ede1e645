"""What resists the motion of a general body: couples beside slip friction, and both together, with the power they take.

A couple is given per unit mass, either by itself or per unit of the normal force.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sweep.jit import inline, nothing
from sweep.models.general.laws import Law, rounded
from sweep.models.general.rigid_body import mass
from sweep.models.model import Array, Columns


@dataclass(frozen=True)
class Couple:
    """A couple -k(ω²) ω, isotropic like the laws of friction; or one about the normal, -k(n²) n u with n = ω · u."""

    name: str
    parameters: tuple[str, ...]
    constants: tuple[str, ...]
    of: Callable[[Columns], tuple[Array, ...]]
    """(columns) -> values of `constants`, each of shape (cells,)."""
    resistance: Callable[..., Any]
    """Inline, (ω² or n², constants) -> k, per unit mass."""
    strongest: Callable[[Columns], Array]
    """(columns) -> bound on k, shape (cells,)."""
    needs_normal_force: bool = False
    """Whether k is per unit of the normal force."""
    about_normal: bool = False
    """Whether it resists the spin alone; it is per unit of the normal force then."""
    linear: bool = True


@inline
def _damping(square, p):
    return p.damping


@inline
def _rolling(square, p):
    return p.arm / rounded(np.sqrt(square), p.speed_rolling)


@inline
def _spinning(square, p):
    return p.arm_spinning / rounded(np.sqrt(square), p.speed_spinning)


COUPLES: dict[str, Couple] = {
    couple.name: couple
    for couple in (
        Couple(
            "sigma", ("sigma",), ("damping",), lambda columns: (columns["sigma"] / mass(columns),), _damping,
            lambda columns: columns["sigma"] / mass(columns),
        ),
        Couple(
            "rolling", ("mu_rolling", "radius", "speed_rolling"), ("arm", "speed_rolling"),
            lambda columns: (columns["mu_rolling"] * columns["radius"], columns["speed_rolling"]), _rolling,
            lambda columns: 3 * columns["mu_rolling"] * columns["radius"] / columns["speed_rolling"],
            needs_normal_force=True, linear=False,
        ),
        Couple(
            "spinning", ("mu_spinning", "radius_spinning", "speed_spinning"), ("arm_spinning", "speed_spinning"),
            lambda columns: (columns["mu_spinning"] * columns["radius_spinning"], columns["speed_spinning"]), _spinning,
            lambda columns: 3 * columns["mu_spinning"] * columns["radius_spinning"] / columns["speed_spinning"],
            needs_normal_force=True, about_normal=True, linear=False,
        ),
    )
}  # fmt: skip


def damping_of(couples: Sequence[Couple]):
    """Inline, (ω, constants) -> the couple by itself, τ0, and the power that it takes."""
    resistance = _resistance([couple for couple in couples if not couple.needs_normal_force])
    # A product with 0.0 would remain: the compiler has to allow for infinity.  A sum with it does not.
    damps = resistance is not nothing

    @inline
    def damping(w1, w2, w3, p):
        c1, c2, c3, power = 0.0, 0.0, 0.0, 0.0
        if damps:
            square = w1 * w1 + w2 * w2 + w3 * w3
            k = resistance(square, p)
            c1, c2, c3, power = -k * w1, -k * w2, -k * w3, k * square
        return (c1, c2, c3), power

    return damping


def friction_of(couples: Sequence[Couple], law: Law | None = None):
    """Inline, (v², ω, u, constants) -> (k, d, power): the friction -k v and the couple -d, per unit of normal force.

    The power is that of the couple.
    """
    of_slip = (law and law.coupled) or _without_couple(law.resistance if law else nothing)
    rolling, spinning = (
        _resistance([couple for couple in couples if couple.needs_normal_force and couple.about_normal == about_normal])
        for about_normal in (False, True)
    )
    rolls, spins = rolling is not nothing, spinning is not nothing or bool(law and law.coupled)

    @inline
    def friction(square, w1, w2, w3, u1, u2, u3, p):
        n = u1 * w1 + u2 * w2 + u3 * w3
        k, m = of_slip(square, n * n, p)
        d1, d2, d3, power = 0.0, 0.0, 0.0, 0.0
        if rolls:
            turn_square = w1 * w1 + w2 * w2 + w3 * w3
            r = rolling(turn_square, p)
            d1, d2, d3, power = r * w1, r * w2, r * w3, r * turn_square
        if spins:
            m = (m + spinning(n * n, p)) * n
            d1, d2, d3, power = d1 + m * u1, d2 + m * u2, d3 + m * u3, power + m * n
        return k, (d1, d2, d3), power

    return friction


def _resistance(couples: Sequence[Couple]):
    return couples[0].resistance if couples else nothing


def _without_couple(resistance):
    @inline
    def of_slip(square, spin_square, p):
        return resistance(square, p), 0.0

    return of_slip
