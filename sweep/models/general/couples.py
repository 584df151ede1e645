"""Couples that resist the motion of a general body beside slip friction, with the power that they take from it.

A couple is given per unit mass, either by itself or per unit of the normal force.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from sweep.jit import inline
from sweep.models.general.laws import rounded
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
def _damping(square: Any, p: Any) -> Any:  # noqa: ARG001
    return p.damping


@inline
def _rolling(square: Any, p: Any) -> Any:
    return p.arm / rounded(np.sqrt(square), p.speed_rolling)


@inline
def _spinning(square: Any, p: Any) -> Any:
    return p.arm_spinning / rounded(np.sqrt(square), p.speed_spinning)


@inline
def no_resistance(square: Any, p: Any) -> Any:  # noqa: ARG001
    """The resistance of no couple."""
    return 0.0


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
