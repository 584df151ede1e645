"""Describes a variable of the dataset: its type, its units and the meaning of its values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from sweep.parameters import Parameter
from sweep.units import Unit, named


@dataclass(frozen=True)
class Variable:
    """One variable of the dataset; unless a flag is set, it has one value per cell."""

    dtype: str
    """Type in the dataset, by its NumPy name."""
    units: Unit | str
    """Powers of length, time and mass; or the unit as text, in a user's model."""
    long_name: str
    """Label in figures, without the unit. If it is a question, the flags answer yes or no."""
    description: str = ""
    """Meaning in a sentence, if the `long_name` is not enough."""
    flags: Mapping[int, str] | None = None
    """Meaning of each value, for a variable that takes only a few integer values."""
    masks: bool = False
    """Whether the values of `flags` are bits that may be set together."""
    per_body: bool = False
    """Whether it has one value per body, that is, does not depend on the parameters of the start."""
    along: tuple[str, ...] = ()
    """Names of further dimensions, after those of the cells."""
    of_sound_runs: bool = False
    """Whether it is undefined for a trajectory that failed, whatever number the array holds there."""


def attributes(of: Variable | Parameter, system: str) -> dict[str, str]:
    """Return the CF attributes in a system of units; plain numbers have no unit, or xarray would print "[1]"."""
    found = {"long_name": of.long_name, "units": named(of.units, system), "description": of.description}
    return {key: words for key, words in found.items() if words}
