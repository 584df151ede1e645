"""Hold what the models with and without slip share: their scene, their constants, and how they are made."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any

import numpy as np

from sweep.jit import inline
from sweep.models.general import rigid_body, validity
from sweep.models.general.couples import Couple
from sweep.models.general.laws import LAWS, Law
from sweep.models.general.surfaces import ELLIPSOID, Surface
from sweep.models.model import PLAIN, Array, Assumptions, Columns, Offer, zeros
from sweep.models.symbols import Constants, specialised

SOLID = "solid"
"""Stands in place of the law in the names of variants without slip."""

VISCOUS = LAWS["viscous"]


@dataclass(frozen=True, kw_only=True)
class Extra:
    """A property that the paper's scene lacks."""

    parameters: tuple[str, ...]
    """The parameters that bring it."""
    without: Mapping[str, float]
    """The constants that are known without it, and their values."""
    constants: Mapping[str, Callable[[Columns], Array]] = field(default_factory=dict)
    """Those of these constants that are not of the body or its surface: (columns) -> values of shape (cells,)."""
    states: tuple[str, ...] = ()
    """States that follow those of the scene without it."""
    start: Callable[[tuple[Array, ...]], tuple[Array, ...]] = lambda y: ()
    """(the other states at t = 0) -> these states, each of shape (cells,)."""
    on: Callable[[Surface], bool] = lambda surface: True
    """Whether it makes a difference to a body with this surface."""
    assumes: Assumptions = PLAIN
    """What holds with it."""


EXTRAS: dict[str, Extra] = {
    "offset": Extra(parameters=("offset",), without={"offset": 0.0}, on=lambda surface: "offset" in surface.constants),
    "skew": Extra(
        parameters=("Ixz", "Iyz"), without=dict.fromkeys(("J13", "J23", "inv_J12", "inv_J13", "inv_J23"), 0.0),
        assumes=Assumptions(steady_upright=False),
    ),
    "gravity": Extra(parameters=("gravity",), without={"g": 1.0}),
}  # fmt: skip
"""A centre of mass away from the ellipsoid's, a third axis that is not an axis of inertia, and gravity in other units.
"""


@dataclass(frozen=True)
class Variant:
    """The scene of `slip` or `noslip`: whatever it lacks adds no instruction to a kernel."""

    law: Law | None
    """The law of slip friction; None for a body that does not slip."""
    couples: tuple[Couple, ...] = ()
    surface: Surface = ELLIPSOID
    extras: frozenset[str] = frozenset()
    """A selection of `EXTRAS`."""

    @property
    def name(self) -> str:
        """The name of the variant in datasets and in the cache of compiled code: `slip` or `noslip` for the paper's."""
        base, law = ("slip", self.law.name) if self.law else ("noslip", SOLID)
        more = [couple.name for couple in self.couples] + [name for name in EXTRAS if name in self.extras]
        more += [self.surface.name] if self.surface != ELLIPSOID else []
        return "+".join([base, law, *more] if more or law not in (VISCOUS.name, SOLID) else [base])

    @property
    def skew(self) -> bool:
        """Whether the third axis may differ from an axis of inertia."""
        return "skew" in self.extras

    @cached_property
    def has(self) -> tuple[Extra, ...]:
        """Its extras."""
        return tuple(each for name, each in EXTRAS.items() if name in self.extras)

    @property
    def assumes(self) -> Assumptions:
        """What holds in this scene: what holds with each of its extras."""
        holds = {name: all(getattr(each.assumes, name) for each in self.has) for name in vars(PLAIN)}
        return Assumptions(**holds)

    @property
    def states(self) -> tuple[str, ...]:
        """The states that its extras add."""
        return tuple(name for each in self.has for name in each.states)

    def start(self, y: tuple[Array, ...]) -> tuple[Array, ...]:
        """The states at t = 0, of which y are those without extras."""
        return (*y, *(value for each in self.has for value in each.start(y)))

    @property
    def known(self) -> dict[str, float]:
        """The constants that are known, and their values."""
        return {
            name: value
            for extra, each in EXTRAS.items()
            if extra not in self.extras
            for name, value in each.without.items()
        }

    @cached_property
    def body(self) -> tuple[str, ...]:
        """The constants of body, surface and extras that are not known."""
        names = (*self.surface.constants, *rigid_body.BODY, *(name for each in self.has for name in each.constants))
        return tuple(name for name in names if name not in self.known)

    def record(
        self, more: Sequence[str] = (), of_more: Callable[[Columns], tuple[Array, ...]] = lambda columns: ()
    ) -> type[Any]:
        """The constants of body, surface and couples, and `more`, as a `NamedTuple` class.

        Its `of` raises a ValueError for bodies that this scene does not cover.
        """
        body, couples, surface, known, has = self.body, self.couples, self.surface, self.known, self.has

        fields = (*body, *(name for couple in couples for name in couple.constants), *more)

        class Record(namedtuple("Constants", fields)):  # type: ignore[misc]
            @classmethod
            def of(cls, columns: Columns) -> Record:
                names = (*surface.constants, *rigid_body.BODY)
                of_body = dict(zip(names, rigid_body.values(columns, surface), strict=True))
                for each in has:
                    of_body |= {name: value(columns) for name, value in each.constants.items()}
                if others := [name for name in known if name in of_body and np.any(of_body[name] != known[name])]:
                    raise ValueError(f"{', '.join(others)}: this scene has no such body; name it in the variant")
                of_couples = (value for couple in couples for value in couple.of(columns))
                return cls(*(of_body[name] for name in body), *of_couples, *of_more(columns))

        return Record

    def inline(self, record: type[Any], function: Callable[..., Any], **arguments: Any):
        """`function` of `arguments` and the constants p, for this scene (`sweep.models.symbols.specialised`)."""
        return specialised(function, **arguments, p=Constants(record._fields, self.known))


def offers(scene: Variant) -> frozenset[Offer]:
    """Return what every model of a scene offers.

    The linear theory needs something that makes a rattle decay, and a Jacobian that is quadratic in the spin: it has
    none with a couple that is not linear, or with a law that depends on the spin.
    """
    isotropic, conservative = scene.assumes.isotropic, scene.assumes.conservative
    decays = scene.law.coupled is None if scene.law else bool(scene.couples)
    found = {
        Offer.COUNT: True,
        Offer.SPIN: True,
        Offer.ENERGY: conservative,
        Offer.LINEAR: decays and isotropic and all(couple.linear for couple in scene.couples),
        Offer.REVERSAL_TIME: scene.law in (None, VISCOUS) and isotropic and conservative,
    }
    return frozenset(offer for offer, holds in found.items() if holds)


@inline
def tilt(y):
    """sin² of the angle between u and the z axis, from states that begin with u1 and u2."""
    return y[0] * y[0] + y[1] * y[1]


def of_any_body(variant: Variant, states: tuple[str, ...]) -> dict[str, Any]:
    """The fields that the models of a scene have in common, for a model with these `states`."""
    surface = variant.surface
    return {
        "name": variant.name,
        "variant": variant,
        "assumes": variant.assumes,
        "states": states,
        "spin_state": 4,
        "upright": lambda spin: tuple(-spin if name == "omega3" else 0.0 for name in states),
        "tilt": tilt,
        "slower_period": lambda columns: rigid_body.slower_period(columns, surface),
        # x and y are the axes of inertia of a body given by δ, and those of the surface otherwise.
        "turned": lambda columns: zeros(columns) if "delta" in columns else -rigid_body.axes(columns),
        "spin_unit": rigid_body.spin_unit,
        "impossible": partial(validity.impossible, surface=surface),
    }
