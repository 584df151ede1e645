"""Finds out what failed runs met.

Too long a step can produce a spurious lift-off, jam or topple. So a failed run is stopped a few steps ahead of its
failure and integrated from there in short ones (`sweep.kernels.failure`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sweep.engine.cells import Cells
from sweep.grid import Array
from sweep.interrupt import point
from sweep.kernels.build import FAILING, build
from sweep.kernels.failure import approach
from sweep.kernels.status import RUNNING
from sweep.models.model import stack, take

AHEAD = 8
"""Number of steps ahead of a failure from which a run is examined. The longest history of a method has eight points, so
none of them comes from the failure."""

# Number of steps beyond a failure to which a run is examined.
_BEYOND = 2

UNSOUND = 0.01
"""Relative error of the energy balance above which a run is never considered sound."""

# Number of cells examined between two calls of `after_chunk`: half a second at most friction.
_AT_A_TIME = 64


class Met(NamedTuple):
    """The failures that runs met, according to the approach with short steps."""

    kind: Array
    """`LIFT_OFF`, `PARADOX`, `TOPPLED`, or `DIVERGED` where no step is short enough; `RUNNING` where a run has met
    nothing, shape (cells,)."""
    time: Array
    """Time of the failure, in sqrt(c/g), shape (cells,)."""
    spin: Array
    """Spin at that time, shape (cells,)."""
    doubt: Array
    """Largest change of the spin within the uncertainty of that time, shape (cells,)."""

    @classmethod
    def nothing(cls, cells: int) -> Met:
        """Return the record of runs that did not fail."""
        return cls(np.full(cells, RUNNING), *np.zeros((3, cells)))

    def agrees(self, other: Met, within: float | Array) -> Array:
        """Return where both have met the same failure, at times that differ by at most `within`, shape (cells,)."""
        near = np.abs(self.time - other.time) <= within
        return np.asarray((self.kind != RUNNING) & (self.kind == other.kind) & near)


def unsound(cells: Cells) -> Array:
    """Return where the energy balance is so wrong that no number of the run can be right, shape (cells,)."""
    if "energy_error" not in cells.kernel.measure:
        return np.zeros(len(cells.cells), bool)
    return np.asarray(~(cells.table["violation"] <= UNSOUND * cells.table["energy_start"]))


def met(failed: Cells, ahead: Array) -> Met:
    """Examine failed runs from their states `AHEAD` steps before the failure: state rows, shape (cells, quantities)."""
    found, model, table = Met.nothing(len(ahead)), failed.model, failed.table
    constants = model.constants.of(failed.columns)
    late = table["done"] > AHEAD
    begin = np.where(late, failed.times - AHEAD * table["step"], 0.0)
    states = stack(model.start(failed.columns))
    states[:, late] = failed.kernel.model_states(ahead[late])
    stretch = failed.times + _BEYOND * table["step"] - begin
    build([failed.kernel], FAILING)
    for first in range(0, len(ahead), _AT_A_TIME):
        some = slice(first, first + _AT_A_TIME)
        ends = approach(model, states[:, some], take(constants, some), stretch[some])
        found.kind[some], passed, found.spin[some], found.doubt[some] = ends
        found.time[some] = begin[some] + passed
        point()
    return found
