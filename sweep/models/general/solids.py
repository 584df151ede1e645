"""The parameters of a body that is given by its measured sizes, and by weights on it.

The solids are a homogeneous ellipsoid, the lower half of one, flat on top, and any other whose mass properties are
known.  About the ellipsoid's centre and with the semi-axes A, B and C, both ellipsoids have the matrix of inertia
m diag(B² + C², A² + C², A² + B²)/5, because the halves are mirror images.  The centre of mass of the half lies 3C/8
below it (E. W. Weisstein, "Ellipsoid" and "Hemisphere", mathworld.wolfram.com).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sweep.models.model import Array, Columns
from sweep.models.vectors import along_turned

_ROUNDING = 1e-12

_MASS = ("mass", "density")

_SIZES = {"a": "length", "b": "width", "c": "height"}
"""The size of the solid from which a semi-axis follows."""

_RADII = {"a": "radius_long", "b": "radius_short"}
"""The radius of curvature at the lowest point from which a semi-axis of the surface follows."""


class Solid:
    """A homogeneous solid, which its parameters and those of its surface determine."""

    needs: tuple[tuple[str, ...], ...] = (_MASS,)
    """Of each of these tuples of parameters at least one is needed."""
    excluding: tuple[tuple[str, str], ...] = (_MASS,)
    """Pairs of parameters of which only one may be given."""
    optional: tuple[str, ...] = ()
    """Parameters that have a default."""

    def parameters(self, names: frozenset[str]) -> tuple[str, ...]:
        """Return the parameters on which the body depends, if a configuration gives those called `names`."""
        return (*(name for each in self.needs for name in each if name in names), *self.optional)


@dataclass(frozen=True)
class Ellipsoid(Solid):
    """A homogeneous ellipsoid, or the lower half of one."""

    spec: str
    """Its name in a configuration."""
    whole: bool

    needs = (_MASS, ("length", "radius_long", "a"), ("width", "radius_short", "b"), ("height", "c"))
    excluding = (_MASS, ("a", "radius_long"), ("b", "radius_short"))
    optional = ("angle",)
    skew = False
    """Whether the third axis may differ from an axis of inertia."""

    def body(self, given: Columns) -> dict[str, Array]:
        """Return the parameters of the models' body, in SI and each of shape (cells,).

        The solid has the sizes `length`, `width` and `height`, and its surface the semi-axes `a`, `b` and `c`, or the
        radii of curvature `radius_long` and `radius_short`.  Missing dimensions of the solid default to those of the
        surface, and vice versa.  The inertia is turned by `angle` against the surface, as by the parameter `delta`.
        """
        parts = {"length": 2, "width": 2, "height": 2 if self.whole else 1}
        solid = {axis: given[size] / parts[size] for axis, size in _SIZES.items() if size in given}
        surface = solid | {axis: given[axis] for axis in _SIZES if axis in given}
        surface |= {axis: np.sqrt(given[name] * surface["c"]) for axis, name in _RADII.items() if name in given}
        a, b, c = ((surface | solid)[axis] for axis in _SIZES)
        below = 0 if self.whole else 3 * c / 8
        mass = _mass(given, (4 if self.whole else 2) / 3 * np.pi * a * b * c)
        along, across = mass * ((b**2 + c**2) / 5 - below**2), mass * ((a**2 + c**2) / 5 - below**2)
        Ixx, Ixy, Iyy = along_turned(along, across, -given["angle"])
        return {
            **surface, "offset": surface["c"] - (c - below), "mass": mass,
            "Ixx": Ixx, "Iyy": Iyy, "Izz": mass * (a**2 + b**2) / 5, "Ixy": Ixy,
        }  # fmt: skip


@dataclass(frozen=True)
class Shape(Solid):
    """A homogeneous solid of any shape: its volume, its surface and its matrix of inertia per mass."""

    numbers: tuple[float, ...]
    """The values of `names`, in SI."""

    names = ("volume", "a", "b", "c", "offset", "Jxx", "Jyy", "Jzz", "Jxy", "Jxz", "Jyz")

    @property
    def spec(self) -> dict[str, float]:
        """Return the value of `solid` in a configuration."""
        return dict(zip(self.names, self.numbers, strict=True))

    @property
    def skew(self) -> bool:
        return any(self.numbers[-2:])

    def body(self, given: Columns) -> dict[str, Array]:
        """Return the parameters of the models' body, as `Ellipsoid.body` does."""
        mass = _mass(given, self.numbers[0])
        surface = {name: np.full_like(mass, self.spec[name]) for name in ("a", "b", "c", "offset")}
        moments = {name.replace("J", "I"): mass * value for name, value in self.spec.items() if name[0] == "J"}
        return {**surface, "mass": mass, **moments}


def _mass(given: Columns, volume: Array | float) -> Array:
    return given["mass"] if "mass" in given else given["density"] * volume


SOLIDS = {each.spec: each for each in (Ellipsoid("half_ellipsoid", whole=False), Ellipsoid("ellipsoid", whole=True))}


@dataclass(frozen=True)
class Assembly:
    """What the body of a configuration is made of: from its parameters those of the models' body follow."""

    solid: Ellipsoid | Shape | None = None
    weights: tuple[tuple[float, ...], ...] = ()
    """Point masses in SI: mass, and place along the axes of `a`, of `b` and down, from where `offset` is zero."""

    @classmethod
    def of(cls, spec: Mapping[str, Any]) -> Assembly:
        """Return the assembly that has this `spec`."""
        solid = spec.get("solid")
        known = Shape(tuple(solid.values())) if isinstance(solid, Mapping) else solid and SOLIDS[solid]
        return cls(known, tuple((each["mass"], *each["at"]) for each in spec.get("weights", ())))

    @property
    def spec(self) -> dict[str, Any]:
        """Return the keys of the section `body` that describe it; none for a body given by its parameters alone."""
        weights = [{"mass": mass, "at": at} for mass, *at in self.weights]
        return ({"solid": self.solid.spec} if self.solid else {}) | ({"weights": weights} if weights else {})

    @property
    def named(self) -> tuple[str, ...]:
        """The parameters that follow and that, where the configuration gives them, choose a variant of the model."""
        skew = (self.solid and self.solid.skew) or self._second[2, :2].any()
        return (*(("offset",) if self != NOTHING else ()), *(("Ixz", "Iyz") if skew else ()))

    @property
    def sideways(self) -> Array:
        """Return the weights' centre of mass along the axes of `a` and `b`, shape (2,)."""
        masses, at = self._weights
        found = np.average(at[:, :2], axis=0, weights=masses)
        return np.where(np.abs(found) > _ROUNDING * np.abs(at).max(), found, 0.0)

    @property
    def _weights(self) -> tuple[Array, Array]:
        """Return masses and places of the weights, shapes (weights,) and (weights, 3)."""
        rows = np.reshape(self.weights, (-1, 4))
        return rows[:, 0], rows[:, 1:]

    @property
    def _second(self) -> Array:
        """Return the second moments of the weights, shape (3, 3)."""
        masses, at = self._weights
        found = at.T * masses @ at
        return np.where(np.abs(found) > _ROUNDING * np.trace(found), found, 0.0)

    def body(self, given: Columns) -> dict[str, Array]:
        """Return the `given` parameters and those that follow, which replace given ones, each of shape (cells,)."""
        found = {**given, **(self.solid.body(given) if self.solid else {})}
        return self._weighted(found) if self.weights else found

    def _weighted(self, body: dict[str, Array]) -> dict[str, Array]:
        """Return a `body` of the models with the weights: by the parallel axis theorem, about the centre of mass."""
        masses, at = self._weights
        mass = body["mass"] + masses.sum()
        offset = (body["mass"] * body["offset"] + masses @ at[:, 2]) / mass
        upright = body["mass"] * (body["offset"] - offset) ** 2 + masses @ (at[:, 2:] - offset) ** 2
        (xx, xy, xz), (_, yy, yz), _ = self._second
        more = {"Ixx": yy + upright, "Iyy": xx + upright, "Izz": xx + yy, "Ixy": -xy}
        more |= {"Ixz": -xz, "Iyz": -yz} if xz or yz else {}
        inertia = {name: body.get(name, 0 * mass) + each for name, each in more.items()}
        return {**body, "mass": mass, "offset": offset, **inertia}


NOTHING = Assembly()
"""The assembly of a body that is given by the parameters of the models."""
