"""Holds what the variants with slip and without share: constants, offers, and what a trajectory shows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from sweep.models.general import rigid_body
from sweep.models.general.couples import Couple
from sweep.models.general.surfaces import Surface
from sweep.models.model import COUNT, ENERGY, LINEAR, SPIN, Array, Columns, named, zeros


def record(surface: Surface, constants: Sequence[str], more: Any) -> type[Any]:
    """The constants of a variant: shape, inertia, its inverse, and `more`, a function of the columns."""
    shape = rigid_body.shape_names(surface)
    inverse = tuple(name.replace("J", "inv_J") for name in rigid_body.INERTIA)

    class Constants(named(*shape, *rigid_body.INERTIA, *inverse, *constants)):  # type: ignore[misc]
        @classmethod
        def of(cls, columns: Columns) -> Constants:
            J = rigid_body.inertia(columns)
            return cls(*rigid_body.shape(columns, surface), *J, *rigid_body.inverse(J), *more(columns))

    return Constants


def couple_constants(couples: Sequence[Couple]) -> tuple[tuple[str, ...], Any]:
    def values(columns: Columns) -> tuple[Array, ...]:
        return tuple(value for couple in couples for value in couple.of(columns))

    return tuple(name for couple in couples for name in couple.constants), values


def offers(couples: Sequence[Couple], *, dissipates: bool) -> frozenset[str]:
    """A couple that is not linear has no Jacobian that is quadratic in the spin, which the linear theory needs."""
    theory = {LINEAR} if dissipates and all(couple.linear for couple in couples) else set()
    return frozenset({COUNT, SPIN, ENERGY} | theory)


def turned(columns: Columns) -> Array:
    """`Model.turned`: x and y are the axes of inertia of a body given by δ, and those of the surface otherwise."""
    return np.asarray(columns.get("delta", zeros(columns)))


def seen(contact: Any, rhs: Any, y: Array, p: Any) -> dict[str, Array]:
    """The contact point and the normal force."""
    _, point, _, _ = contact(*y[:5], p)
    _, (_, _, R, _) = rhs(y, p)
    return {"contact_x": point[0], "contact_y": point[1], "normal_force": R}
