"""The physical parameters: names, meanings, units, defaults and bounds, stated here and nowhere else.

The schema of the configuration, the attributes of the dataset and the documentation are made from this table.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, pi
from sys import float_info
from typing import Any

PAPER_UNITS, SI = "paper", "SI"
"""Systems of units: lengths in c, times in sqrt(c/g) and a mass of one, or SI."""


@dataclass(frozen=True)
class Parameter:
    """A physical parameter of a trajectory."""

    name: str
    section: str
    """Section of the configuration in which it stands; "" for the top."""
    units: str
    """CF unit in the paper's units."""
    long_name: str
    """Meaning, with the paper's unit as its last words where the number is no pure one (`sweep.variables.in_si`)."""
    default: float | None
    """Value of the paper's standard case; None if the configuration has to give one."""
    above: float = -inf
    """Exclusive lower bound."""
    below: float = inf
    """Exclusive upper bound."""
    at_least: float = -inf
    """Inclusive lower bound."""
    words: str = ""
    """What figures call it, with its symbol; by default its `long_name`."""

    @property
    def symbol(self) -> str:
        """What figures write for it: the Greek or indexed letter in its words, or else its name."""
        return next((word for word in self.words.split() if not word.isascii()), self.name)

    @property
    def place(self) -> tuple[str, ...]:
        """Keys from the top of a configuration."""
        return (self.section, self.name) if self.section else (self.name,)

    @property
    def path(self) -> str:
        return ".".join(self.place)

    def allows(self, value: float) -> bool:
        within = self.above < value < self.below and value >= self.at_least
        return within and abs(value) <= float_info.max  # Python's integers may be larger than any float

    @property
    def allowed(self) -> str:
        """The bounds in words, for messages to the user."""
        marks = ((">", self.above), (">=", self.at_least), ("<", self.below))
        bounds = " and ".join(f"{sign} {bound:.6g}" for sign, bound in marks if abs(bound) != inf)
        return f"a finite number {bounds}".rstrip()


_SIZE = {"above": 0, "below": 1e6}
_MASS: dict[str, Any] = {"above": 0, "below": 1e12}
_MOMENT = {"above": 0, "below": 1e24}
_PRODUCT = {"above": -1e24, "below": 1e24}
_COEFFICIENT = {"at_least": 0, "below": 1e6}
_VISCOUS = {"at_least": 0, "below": 1e12}
_SPIN = {"above": -1e3, "below": 1e3}
_SLIP = {"above": -1e6, "below": 1e6}
_ANGLE = {"units": "radian", "above": -pi / 2, "below": pi / 2}
_POINT: dict[str, Any] = {}

_Row = tuple[str, str, float | None, dict[str, Any], *tuple[str, ...]]
"""Name, meaning, default, and the bounds of a parameter, and what figures call it."""

_SECTIONS: dict[str, tuple[_Row, ...]] = {
    "body": (
        ("a", "semi-axis of the ellipsoid at delta from x (long axis), in c", 10.0, _SIZE, "long semi-axis a"),
        ("b", "semi-axis of the ellipsoid at delta from y (short axis), in c", 3.0, _SIZE, "short semi-axis b"),
        ("c", "semi-axis of the ellipsoid along z, the unit of length", 1.0, _SIZE,
         "height c of the center over the table"),
        ("delta", "angle from the ellipsoid's axes to the axes of inertia", 0.03, _ANGLE,
         "angle δ of the axes of inertia"),
        ("offset", "depth of the centre of mass below the ellipsoid's centre, in c", 0.0, _POINT),
        ("mass", "mass, in m", None, _MASS),
        ("Ixx", "central moment of inertia about x, in m c^2", None, _MOMENT),
        ("Iyy", "central moment of inertia about y, in m c^2", None, _MOMENT),
        ("Izz", "central moment of inertia about z, in m c^2", None, _MOMENT),
        ("Ixy", "element xy of the central matrix of inertia, in m c^2", 0.0, _PRODUCT),
        ("Ixz", "element xz of the central matrix of inertia, in m c^2", 0.0, _PRODUCT),
        ("Iyz", "element yz of the central matrix of inertia, in m c^2", 0.0, _PRODUCT),
    ),
    "": (("gravity", "acceleration of free fall, in g", 9.80665, _SIZE),),
    "friction": (
        ("mu", "viscous friction coefficient, in 1/sqrt(g c)", None, _VISCOUS, "friction μ"),
        ("speed", "slip velocity from which on friction is that of slipping, in sqrt(g c)", None, _SIZE),
        ("mu_static", "coefficient of friction at no slip", None, _COEFFICIENT),
        ("speed_stick", "slip velocity over which static friction sets in, in sqrt(g c)", None, _SIZE),
        ("radius_contact", "radius of the contact, in c", None, _SIZE),
        ("mu_viscous", "viscous part of the coefficient of friction, in 1/sqrt(g c)", 0.0, _VISCOUS),
        ("sigma", "couple per angular velocity that opposes it, in m c sqrt(g c)", 0.0, _VISCOUS,
         "couple σ per angular velocity"),
        ("mu_rolling", "coefficient of rolling friction", None, _COEFFICIENT),
        ("radius", "contact radius of rolling friction, in c", None, _SIZE),
        ("speed_rolling", "angular velocity below which rolling friction fades, in sqrt(g/c)", None, _SIZE),
        ("mu_spinning", "coefficient of spinning friction", None, _COEFFICIENT),
        ("radius_spinning", "contact radius of spinning friction, in c", None, _SIZE),
        ("speed_spinning", "spin below which spinning friction fades, in sqrt(g/c)", None, _SIZE),
    ),
    "start": (
        ("n0", "start spin about the upward normal, in sqrt(g/c)", 0.05, _SPIN, "start spin n₀"),
        ("x0", "start contact point along x, in c", 0.01, _POINT, "start contact point x₀"),
        ("y0", "start contact point along y, in c", 0.01, _POINT, "start contact point y₀"),
        ("roll", "start angle about the axis of a", 0.0, _ANGLE),
        ("pitch", "start angle about the axis of b, after roll", 0.0, _ANGLE),
        ("omega1", "start angular velocity about the axis of a, in sqrt(g/c)", 0.0, _SPIN,
         "start angular velocity ω₁ about the axis of a"),
        ("omega2", "start angular velocity about the axis of b, in sqrt(g/c)", 0.0, _SPIN,
         "start angular velocity ω₂ about the axis of b"),
        ("omega3", "start angular velocity about z, in sqrt(g/c)", 0.0, _SPIN, "start angular velocity ω₃ about z"),
        ("slip1", "start slip along the ground, at heading zero along x, in sqrt(g c)", 0.0, _SLIP),
        ("slip2", "start slip along the ground, at heading zero along y, in sqrt(g c)", 0.0, _SLIP),
    ),
}  # fmt: skip

PARAMETERS: dict[str, Parameter] = {
    name: Parameter(name, section, long_name=meaning, default=default, words="".join(words), **{"units": "1", **bounds})
    for section, rows in _SECTIONS.items()
    for name, meaning, default, bounds, *words in rows
}

DENSITY = Parameter("density", "", "kg/m^3", "density of a body of one material", None, **_MASS)
"""No key of a configuration: it is measured instead of the mass."""

PAPER_PARAMETERS: dict[str, Parameter] = {
    name: PARAMETERS[name] for name in ("a", "b", "c", "delta", "mu", "n0", "x0", "y0")
}
"""The parameters of the paper's models.  Their defaults are in the paper's units, and they have none in SI."""


def sections(table: Mapping[str, Parameter]) -> tuple[str, ...]:
    """Names of the sections in which the parameters of a table stand."""
    return tuple(dict.fromkeys(p.section for p in table.values() if p.section))


START = frozenset(p.name for p in PARAMETERS.values() if p.section == "start")
"""Names of the parameters of the start, on which the critical spins and the form factor do not depend."""
