"""The description of a variable of the dataset: its type, its units and what its values mean."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Variable:
    """One variable of the dataset; without a flag set, it has one value per cell."""

    dtype: str
    """Type in the dataset, by its NumPy name."""
    units: str
    """CF unit; "1" for a dimensionless number."""
    long_name: str
    flags: Mapping[int, str] | None = None
    """Meaning of each value, for a variable that only takes a few integers."""
    per_body: bool = False
    """Whether it has one value per body: it does not depend on the parameters of the start."""
    along: str | None = None
    """Name of one further dimension, after those of the cells; its coordinate counts from one."""
    words: str = ""
    """What figures call it; by default its `long_name`.  To a question, a flag answers yes or no."""
    of_sound_runs: bool = False
    """Whether it is undefined for a trajectory that failed, whatever number the array holds there."""


_SI = {
    "the unit of length": "m",
    "in c": "m",
    "in m": "kg",
    "in g": "m s-2",
    "in m g": "m s-2",
    "in m c^2": "kg m2",
    "in m g c": "m2 s-2",
    "in sqrt(c/g)": "s",
    "in sqrt(g/c)": "radian s-1",
    "in sqrt(g c)": "m s-1",
    "in 1/sqrt(g c)": "s m-1",
    "in 1/sqrt(c/g)": "s-1",
    "in m c sqrt(g c)": "kg m2 s-1",
}
"""Units of SI for the paper's units, which the last words of a `long_name` tell.  Forces and energies of a moving body
are per unit mass."""


def without_unit(long_name: str) -> str:
    """`long_name` without the paper's unit, which another model does not know."""
    head, _, rest = long_name.rpartition(", ")
    words, mark, after = rest.partition(";")
    return f"{head}{mark}{after}" if words in _SI else long_name


def in_si(units: str, long_name: str) -> tuple[str, str]:
    """CF unit and `long_name`, in SI, of what has these in the paper's units."""
    head, _, rest = long_name.rpartition(", ")
    words, mark, after = rest.partition(";")
    if words not in _SI:
        return units, long_name
    per_mass = " per unit mass" if words in ("in m g", "in m g c") else ""
    return _SI[words], f"{head}{per_mass}{mark}{after}"


def with_unit(long_name: str, units: str) -> dict[str, str]:
    """The CF attributes of what has this unit: a plain number has none, or xarray would write "[1]" at its axis."""
    return {"long_name": long_name} | ({"units": units} if units != "1" else {})
