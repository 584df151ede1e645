"""The description of a variable of the dataset: its type, its units and what its values mean."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from sweep.parameters import Parameter
from sweep.units import Unit, named


@dataclass(frozen=True)
class Variable:
    """One variable of the dataset; without a flag set, it has one value per cell."""

    dtype: str
    """Type in the dataset, by its NumPy name."""
    units: Unit | str
    """Powers of length, time and mass; or the unit as text, of a user's model."""
    long_name: str
    """What figures call it, without the unit.  To a question, a flag answers yes or no."""
    description: str = ""
    """What it is, in a sentence, where the `long_name` does not say it."""
    flags: Mapping[int, str] | None = None
    """Meaning of each value, for a variable that only takes a few integers."""
    per_body: bool = False
    """Whether it has one value per body: it does not depend on the parameters of the start."""
    along: str | None = None
    """Name of one further dimension, after those of the cells; its coordinate counts from one."""
    of_sound_runs: bool = False
    """Whether it is undefined for a trajectory that failed, whatever number the array holds there."""


def attributes(of: Variable | Parameter, system: str) -> dict[str, str]:
    """The CF attributes in a system of units: a plain number has no unit, or xarray would write "[1]" at its axis."""
    found = {"long_name": of.long_name, "units": named(of.units, system), "description": of.description}
    return {key: words for key, words in found.items() if words}
