"""The physical parameters: names, meanings, units, defaults and bounds, stated here and nowhere else.

The schema of the configuration, the attributes of the dataset and the documentation are made from this table.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi


@dataclass(frozen=True)
class Parameter:
    """A physical parameter of a trajectory."""

    name: str
    section: str
    """Section of the configuration in which it stands."""
    units: str
    long_name: str
    default: float | None
    """Value of the paper's standard case; None if the configuration has to give one."""
    above: float = -inf
    """Exclusive lower bound."""
    below: float = inf
    """Exclusive upper bound."""
    at_least: float = -inf
    """Inclusive lower bound."""

    @property
    def path(self) -> str:
        return f"{self.section}.{self.name}"

    def allows(self, value: float) -> bool:
        return self.above < value < self.below and value >= self.at_least

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
        Parameter("a", "body", "1", "semi-axis of the ellipsoid along x (long axis), in c", 10.0, above=0, below=1e6),
        Parameter("b", "body", "1", "semi-axis of the ellipsoid along y (short axis), in c", 3.0, above=0, below=1e6),
        Parameter("c", "body", "1", "semi-axis of the ellipsoid along z, the unit of length", 1.0, above=0, below=1e6),
        Parameter(
            "delta", "body", "radian", "angle from the ellipsoid's axes to the axes of inertia",
            0.03, above=-pi / 2, below=pi / 2,
        ),
        Parameter("mu", "friction", "1", "viscous friction coefficient, in 1/sqrt(g c)", None, at_least=0, below=1e12),
        Parameter("n0", "start", "1", "start spin about the upward normal, in sqrt(g/c)", 0.05, above=-1e3, below=1e3),
        Parameter("x0", "start", "1", "start contact point along x, in c", 0.01),
        Parameter("y0", "start", "1", "start contact point along y, in c", 0.01),
    )
}  # fmt: skip

SECTIONS: tuple[str, ...] = tuple(dict.fromkeys(p.section for p in PARAMETERS.values()))

START = frozenset(p.name for p in PARAMETERS.values() if p.section == "start")
"""Names of the parameters of the start, on which the critical spins and the form factor do not depend."""
