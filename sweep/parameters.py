"""The physical parameters: names, meanings, units, defaults and bounds, stated here and nowhere else.

The schema of the configuration, the attributes of the dataset and the documentation are made from this table.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, pi
from sys import float_info

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
        bounds = [
            f"{sign} {bound:.6g}"
            for sign, bound in ((">", self.above), (">=", self.at_least), ("<", self.below))
            if abs(bound) != inf
        ]
        return "a finite number" + (f" {' and '.join(bounds)}" if bounds else "")


PARAMETERS: dict[str, Parameter] = {
    p.name: p
    for p in (
        Parameter(
            "a", "body", "1", "semi-axis of the ellipsoid at delta from x (long axis), in c", 10.0, above=0, below=1e6
        ),
        Parameter(
            "b", "body", "1", "semi-axis of the ellipsoid at delta from y (short axis), in c", 3.0, above=0, below=1e6
        ),
        Parameter(
            "c", "body", "1", "semi-axis of the ellipsoid along z, the unit of length", 1.0, above=0, below=1e6
        ),
        Parameter(
            "delta", "body", "radian", "angle from the ellipsoid's axes to the axes of inertia",
            0.03, above=-pi / 2, below=pi / 2,
        ),
        Parameter("offset", "body", "1", "depth of the centre of mass below the ellipsoid's centre, in c", 0.0),
        Parameter("mass", "body", "1", "mass, in m", None, above=0, below=1e12),
        *(
            Parameter(f"I{i}{i}", "body", "1", f"central moment of inertia about {i}, in m c^2", None,
                      above=0, below=1e24)
            for i in "xyz"
        ),
        *(
            Parameter(f"I{i}{j}", "body", "1", f"element {i}{j} of the central matrix of inertia, in m c^2", 0.0,
                      above=-1e24, below=1e24)
            for i, j in ("xy", "xz", "yz")
        ),
        Parameter("gravity", "", "1", "acceleration of free fall, in g", 9.80665, above=0, below=1e6),
        Parameter(
            "mu", "friction", "1", "viscous friction coefficient, in 1/sqrt(g c)", None, at_least=0, below=1e12
        ),
        Parameter(
            "speed", "friction", "1", "slip velocity from which on friction is that of slipping, in sqrt(g c)", None,
            above=0, below=1e6,
        ),
        Parameter("mu_static", "friction", "1", "coefficient of friction at no slip", None, at_least=0, below=1e6),
        Parameter(
            "speed_stick", "friction", "1", "slip velocity over which static friction sets in, in sqrt(g c)", None,
            above=0, below=1e6,
        ),
        Parameter("radius_contact", "friction", "1", "radius of the contact, in c", None, above=0, below=1e6),
        Parameter(
            "mu_viscous", "friction", "1", "viscous part of the coefficient of friction, in 1/sqrt(g c)", 0.0,
            at_least=0, below=1e12,
        ),
        Parameter("sigma", "friction", "1", "couple per angular velocity that opposes it, in m c sqrt(g c)", 0.0,
                  at_least=0, below=1e12),
        Parameter("mu_rolling", "friction", "1", "coefficient of rolling friction", None, at_least=0, below=1e6),
        Parameter("radius", "friction", "1", "contact radius of rolling friction, in c", None, above=0, below=1e6),
        Parameter(
            "speed_rolling", "friction", "1", "angular velocity below which rolling friction fades, in sqrt(g/c)", None,
            above=0, below=1e6,
        ),
        Parameter("mu_spinning", "friction", "1", "coefficient of spinning friction", None, at_least=0, below=1e6),
        Parameter(
            "radius_spinning", "friction", "1", "contact radius of spinning friction, in c", None, above=0, below=1e6
        ),
        Parameter(
            "speed_spinning", "friction", "1", "spin below which spinning friction fades, in sqrt(g/c)", None,
            above=0, below=1e6,
        ),
        Parameter(
            "n0", "start", "1", "start spin about the upward normal, in sqrt(g/c)", 0.05, above=-1e3, below=1e3
        ),
        Parameter("x0", "start", "1", "start contact point along x, in c", 0.01),
        Parameter("y0", "start", "1", "start contact point along y, in c", 0.01),
        Parameter("roll", "start", "radian", "start angle about the axis of a", 0.0, above=-pi / 2, below=pi / 2),
        Parameter(
            "pitch", "start", "radian", "start angle about the axis of b, after roll", 0.0, above=-pi / 2, below=pi / 2
        ),
        *(
            Parameter(f"omega{i}", "start", "1", f"start angular velocity about {axis}, in sqrt(g/c)", 0.0,
                      above=-1e3, below=1e3)
            for i, axis in ((1, "the axis of a"), (2, "the axis of b"), (3, "z"))
        ),
        Parameter("slip1", "start", "1", "start slip along the ground, at heading zero along x, in sqrt(g c)", 0.0,
                  above=-1e6, below=1e6),
        Parameter("slip2", "start", "1", "start slip along the ground, at heading zero along y, in sqrt(g c)", 0.0,
                  above=-1e6, below=1e6),
    )
}  # fmt: skip

PAPER_PARAMETERS: dict[str, Parameter] = {
    name: PARAMETERS[name] for name in ("a", "b", "c", "delta", "mu", "n0", "x0", "y0")
}
"""The parameters of the paper's models.  Their defaults are in the paper's units, and they have none in SI."""


def sections(table: Mapping[str, Parameter]) -> tuple[str, ...]:
    """Names of the sections in which the parameters of a table stand."""
    return tuple(dict.fromkeys(p.section for p in table.values() if p.section))


SECTIONS: tuple[str, ...] = sections(PARAMETERS)

START = frozenset(p.name for p in PARAMETERS.values() if p.section == "start")
"""Names of the parameters of the start, on which the critical spins and the form factor do not depend."""
