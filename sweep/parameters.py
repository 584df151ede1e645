"""Defines the physical parameters: names, meanings, units, defaults and bounds, stated here and nowhere else.

The schema of the configuration, the attributes of the dataset and the documentation are generated from this table.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, pi
from sys import float_info
from typing import Any

from sweep import units as u
from sweep.units import PAPER_UNITS, SI, Unit, named


@dataclass(frozen=True)
class Parameter:
    """A physical parameter of a trajectory."""

    name: str
    section: str
    """Section of the configuration that contains it; "" for the top level."""
    units: Unit | str
    """Powers of length, time and mass; or the unit as text, in a user's model."""
    long_name: str
    """Label in figures, without the unit but with the symbol."""
    default: float | None
    """Value of the paper's standard case; None if the configuration has to give one."""
    above: float = -inf
    """Exclusive lower bound."""
    below: float = inf
    """Exclusive upper bound."""
    at_least: float = -inf
    """Inclusive lower bound."""
    description: str = ""
    """Meaning in a sentence, if the `long_name` is not enough."""

    @property
    def symbol(self) -> str:
        """Symbol in figures: the Greek or indexed letter in the `long_name`, or else the name."""
        return next((word for word in self.long_name.split() if not word.isascii()), self.name)

    @property
    def place(self) -> tuple[str, ...]:
        """Keys from the top of a configuration."""
        return (self.section, self.name) if self.section else (self.name,)

    @property
    def path(self) -> str:
        return ".".join(self.place)

    @property
    def meaning(self) -> str:
        """Meaning and unit, for messages and tables."""
        alone = self.name in (*SI_ALONE, *OF_SOLIDS)
        unit = named(self.units, SI if alone else PAPER_UNITS)
        return self.long_name + (f", in {unit}" if unit else "") + (" (units: SI only)" if alone else "")

    def allows(self, value: float) -> bool:
        within = self.above < value < self.below and value >= self.at_least
        return within and abs(value) <= float_info.max  # Python's integers may be larger than any float

    @property
    def allowed(self) -> str:
        """Permitted values in words, for messages to the user."""
        return f"a finite number {self.bounds()}".rstrip()

    def bounds(self, largest: float = inf) -> str:
        """Return the bounds below `largest`, such as "> 0 and < 1"."""
        marks = ((">", self.above), (">=", self.at_least), ("<", self.below))
        return " and ".join(f"{sign} {bound:.6g}" for sign, bound in marks if abs(bound) < largest)


SI_ALONE = ("mass", "gravity")
"""Parameters that are one in the paper's units."""

OF_SOLIDS = ("length", "width", "height", "radius_long", "radius_short", "density", "angle")
"""Parameters of solids (`sweep.models.general.solids`), from which others follow; all are in SI."""

_Bounds = dict[str, Any]
_SIZE: _Bounds = {"above": 0, "below": 1e6}
_MASS: _Bounds = {"above": 0, "below": 1e12}
_MOMENT: _Bounds = {"above": 0, "below": 1e24}
_PRODUCT: _Bounds = {"above": -1e24, "below": 1e24}
_COEFFICIENT: _Bounds = {"at_least": 0, "below": 1e6}
_VISCOUS: _Bounds = {"at_least": 0, "below": 1e12}
_SPIN: _Bounds = {"above": -1e3, "below": 1e3}
_SLIP: _Bounds = {"above": -1e6, "below": 1e6}
_ANGLE: _Bounds = {"above": -pi / 2, "below": pi / 2}
_POINT: _Bounds = {}

_Row = tuple[str, Unit, str, float | None, _Bounds, *tuple[str, ...]]
"""Name, unit, `long_name`, default, bounds and optional `description` of a parameter."""

_SECTIONS: dict[str, tuple[_Row, ...]] = {
    "body": (
        ("a", u.LENGTH, "long semi-axis a", 10.0, _SIZE, "Semi-axis of the ellipsoid, turned from x by delta."),
        ("b", u.LENGTH, "short semi-axis b", 3.0, _SIZE, "Semi-axis of the ellipsoid, turned from y by delta."),
        ("c", u.LENGTH, "height c of the centre over the table", 1.0, _SIZE,
         "Semi-axis of the ellipsoid along z, the unit of length in the paper's units."),
        ("delta", u.ANGLE, "angle δ of the axes of inertia", 0.03, _ANGLE,
         "Angle from the ellipsoid's axes to the axes of inertia."),
        ("offset", u.LENGTH, "depth of the centre of mass", 0.0, _POINT,
         "Depth of the centre of mass below the ellipsoid's centre."),
        ("length", u.LENGTH, "length of the solid", None, _SIZE),
        ("width", u.LENGTH, "width of the solid", None, _SIZE),
        ("height", u.LENGTH, "height of the solid", None, _SIZE),
        ("radius_long", u.LENGTH, "radius of curvature along the body", None, _SIZE,
         "Radius of curvature along the body at its lowest point."),
        ("radius_short", u.LENGTH, "radius of curvature across the body", None, _SIZE,
         "Radius of curvature across the body at its lowest point."),
        ("angle", u.ANGLE, "angle of the solid's axes of inertia", 0.0, _ANGLE,
         "Angle from the surface's axes to the axes of inertia."),
        ("mass", u.MASS, "mass", None, _MASS),
        ("density", u.MASS_DENSITY, "density of the solid", None, _MASS),
        ("Ixx", u.INERTIA, "central moment of inertia about x", None, _MOMENT),
        ("Iyy", u.INERTIA, "central moment of inertia about y", None, _MOMENT),
        ("Izz", u.INERTIA, "central moment of inertia about z", None, _MOMENT),
        ("Ixy", u.INERTIA, "element xy of the central inertia matrix", 0.0, _PRODUCT),
        ("Ixz", u.INERTIA, "element xz of the central inertia matrix", 0.0, _PRODUCT),
        ("Iyz", u.INERTIA, "element yz of the central inertia matrix", 0.0, _PRODUCT),
    ),
    "": (("gravity", u.ACCELERATION, "acceleration of free fall", 9.80665, _SIZE),),
    "friction": (
        ("mu", u.SLOWNESS, "friction μ", None, _VISCOUS, "Viscous friction coefficient."),
        ("speed", u.SPEED, "slip speed of full friction", 5e-3, _SIZE,
         "Slip speed above which Coulomb friction is fully developed."),
        ("mu_static", u.NUMBER, "coefficient of static friction", None, _COEFFICIENT),
        ("speed_stick", u.SPEED, "slip speed of static friction", None, _SIZE,
         "Slip speed over which static friction sets in."),
        ("radius_contact", u.LENGTH, "radius of the contact", None, _SIZE),
        ("mu_viscous", u.SLOWNESS, "viscous part of the friction coefficient", 0.0, _VISCOUS),
        ("sigma", u.DRAG, "rotational drag coefficient σ", 0.0, _VISCOUS,
         "Torque per angular velocity, opposed to the rotation."),
        ("mu_rolling", u.NUMBER, "coefficient of rolling friction", None, _COEFFICIENT),
        ("radius", u.LENGTH, "contact radius of rolling friction", None, _SIZE),
        ("speed_rolling", u.SPIN, "angular velocity of rolling friction", None, _SIZE,
         "Angular velocity below which rolling friction fades."),
        ("mu_spinning", u.NUMBER, "coefficient of spinning friction", None, _COEFFICIENT),
        ("radius_spinning", u.LENGTH, "contact radius of spinning friction", None, _SIZE),
        ("speed_spinning", u.SPIN, "spin of spinning friction", None, _SIZE,
         "Spin below which spinning friction fades."),
    ),
    "start": (
        ("n0", u.SPIN, "start spin n₀", 0.05, _SPIN, "Spin about the upward normal at the start."),
        ("x0", u.LENGTH, "start contact point x₀", 0.01, _POINT, "Contact point along x at the start."),
        ("y0", u.LENGTH, "start contact point y₀", 0.01, _POINT, "Contact point along y at the start."),
        ("roll", u.ANGLE, "start angle about the axis of a", 0.0, _ANGLE),
        ("pitch", u.ANGLE, "start angle about the axis of b", 0.0, _ANGLE,
         "Angle at the start about the axis of b, after roll."),
        ("omega1", u.SPIN, "start angular velocity ω₁", 0.0, _SPIN, "Angular velocity about the axis of a."),
        ("omega2", u.SPIN, "start angular velocity ω₂", 0.0, _SPIN, "Angular velocity about the axis of b."),
        ("omega3", u.SPIN, "start angular velocity ω₃", 0.0, _SPIN, "Angular velocity about z."),
        ("slip1", u.SPEED, "start slip velocity along x", 0.0, _SLIP,
         "Slip velocity along the ground at the start, at heading zero along x."),
        ("slip2", u.SPEED, "start slip velocity along y", 0.0, _SLIP,
         "Slip velocity along the ground at the start, at heading zero along y."),
    ),
}  # fmt: skip

PARAMETERS: dict[str, Parameter] = {
    name: Parameter(name, section, units, long_name, default, description="".join(description), **bounds)
    for section, rows in _SECTIONS.items()
    for name, units, long_name, default, bounds, *description in rows
}

PAPER_PARAMETERS: dict[str, Parameter] = {
    name: PARAMETERS[name] for name in ("a", "b", "c", "delta", "mu", "n0", "x0", "y0")
}
"""The parameters of the paper's models. Defaults are in the paper's units; there are none in SI."""


def sections(table: Mapping[str, Parameter]) -> tuple[str, ...]:
    """Return the names of the sections that contain the parameters of a table."""
    return tuple(dict.fromkeys(p.section for p in table.values() if p.section))


START = frozenset(p.name for p in PARAMETERS.values() if p.section == "start")
"""Names of the parameters of the start, on which critical spins and the form factor do not depend."""
