"""Holds what the variants with slip and without share: their constants, what they offer, and how they are made."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sweep.models.general import rigid_body, validity
from sweep.models.general.couples import Couple
from sweep.models.general.laws import Law
from sweep.models.general.surfaces import ELLIPSOID, Surface
from sweep.models.model import COUNT, ENERGY, LINEAR, SPIN, Array, Columns, Model, named, zeros

SOLID = "solid"
"""Stands in place of the law in the names of variants without slip."""


@dataclass(frozen=True)
class Variant:
    """What a variant of `slip` or `noslip` is made of."""

    law: Law | None
    """Of slip friction; None for a body that does not slip."""
    couples: tuple[Couple, ...] = ()
    surface: Surface = ELLIPSOID

    @property
    def name(self) -> str:
        """Name the variant, as in datasets and in the cache of compiled code."""
        base = ["slip", self.law.name] if self.law else ["noslip", SOLID]
        shape = [self.surface.name] if self.surface != ELLIPSOID else []
        return "+".join([*base, *(couple.name for couple in self.couples), *shape])


def record(
    surface: Surface, couples: Sequence[Couple] = (), more: Sequence[str] = (),
    of_more: Callable[[Columns], tuple[Array, ...]] = lambda columns: (),
) -> type[Any]:  # fmt: skip
    """The constants of a variant: of the surface, the inertia, its inverse and the couples, and `more`."""
    body = (*surface.constants, "g", *rigid_body.INERTIA, *(name.replace("J", "inv_J") for name in rigid_body.INERTIA))

    class Constants(named(*body, *(name for couple in couples for name in couple.constants), *more)):  # type: ignore[misc]
        @classmethod
        def of(cls, columns: Columns) -> Constants:
            J, g = rigid_body.inertia(columns), rigid_body.gravity(columns)
            of_couples = (value for couple in couples for value in couple.of(columns))
            return cls(*surface.of(columns), g, *J, *rigid_body.inverse(J), *of_couples, *of_more(columns))

    return Constants


def offers(couples: Sequence[Couple], *, dissipates: bool) -> frozenset[str]:
    """A couple that is not linear has no Jacobian that is quadratic in the spin, which the linear theory needs."""
    theory = {LINEAR} if dissipates and all(couple.linear for couple in couples) else set()
    return frozenset({COUNT, SPIN, ENERGY} | theory)


def of_any_body(base: Model, variant: Variant, **made) -> Model:
    """A variant of `base`; `made` are the fields that `slip` and `noslip` have of their own."""
    surface = variant.surface
    return replace(
        base,
        name=variant.name,
        variant=variant,
        summary=f"{base.summary}, for any body",
        slower_period=lambda columns: rigid_body.slower_period(columns, surface),
        # x and y are the axes of inertia of a body given by δ, and those of the surface otherwise.
        turned=lambda columns: np.asarray(columns.get("delta", zeros(columns))),
        spin_unit=rigid_body.spin_unit,
        impossible=lambda columns: validity.impossible(columns, surface),
        **made,
    )
