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
    of_sound_runs: bool = False
    """Whether it is undefined for a trajectory that failed, whatever number the array holds there."""
