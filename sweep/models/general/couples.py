"""Couples that resist the motion of a general body, alone and together with slip friction, and the power they take.

A couple is given per unit mass, either by itself or per unit of the normal force.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sweep.jit import inline
from sweep.models.general.laws import Law
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
    """Whether it resists the spin alone; it is then per unit of the normal force."""
    linear: bool = True


@inline
def rounded(x, width):
    """x from `width` on; below it a cubic, x²/s (1 - x/(3 s)) + s/3, that keeps away from zero."""
    t = np.minimum(x / width, 1.0)
    return np.maximum(x, width) + width * (t * t * (1.0 - t / 3.0) - 2.0 / 3.0)


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
    """(ω, constants) -> the couple by itself, τ0, and the power that it takes."""
    of = [couple for couple in couples if not couple.needs_normal_force]

    def damping(w, p):
        square = w.dot(w)
        k = sum((couple.resistance(square, p) for couple in of), 0.0)
        return w.times(-k), k * square

    return damping


def friction_of(couples: Sequence[Couple], law: Law | None = None):
    """(v², ω, u, constants) -> (k, d, power): the friction -k v and the couple -d, per unit of normal force.

    The power is that of the couple.
    """
    of_slip = law.both if law else (lambda square, spin_square, p: (0.0, 0.0))
    of = [couple for couple in couples if couple.needs_normal_force]

    def friction(square, w, u, p):
        n, turn_square = u.dot(w), w.dot(w)
        k, about_normal = of_slip(square, n * n, p)
        r = sum((couple.resistance(turn_square, p) for couple in of if not couple.about_normal), 0.0)
        about_normal = about_normal + sum((couple.resistance(n * n, p) for couple in of if couple.about_normal), 0.0)
        m = about_normal * n
        return k, w.times(r) + u.times(m), r * turn_square + m * n

    return friction
