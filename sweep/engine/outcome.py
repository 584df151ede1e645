"""Collects the results of cells whose lives have ended: the simulated variables, and the reasons to doubt them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from sweep.engine.cells import Cells
from sweep.engine.errors import Errors
from sweep.engine.lives import Lives
from sweep.engine.plan import Plan
from sweep.grid import Array
from sweep.kernels.methods import AUTO
from sweep.kernels.status import COUNT_DOUBTS, IMPOSSIBLE, SETTLED, TIME_LIMIT, Doubt
from sweep.results import dataset

CLEAR = 10.0
"""Required ratio of the margin of a count to its estimated error: about one in a hundred estimates is more than ten
times too small (docs/explanation/accuracy.md)."""


def results(job: Plan, lives: Sequence[Lives]) -> dict[str, Array]:
    """Collect the simulated variables of `job` by name, over all cells, with accuracies where cells were run twice."""
    size = sum(grid.size for grid in job.grids)
    arrays = {"status": np.full(size, IMPOSSIBLE)}
    for each in lives:
        found = _found(each)
        if job.config.integrator.method == AUTO:
            found["method"] = np.full(len(each.rows), each.cells.kernel.stepper.code)
        for name, values in found.items():
            nothing = np.nan if dataset.VARIABLES[name].dtype.startswith("float") else 0
            blank = np.full((size, *values.shape[1:]), nothing)
            arrays.setdefault(name, blank)[each.cells.cells] = values
    return arrays


def _found(lives: Lives) -> dict[str, Array]:
    """Return the simulated variables of the cells of one method."""
    cells = lives.take()
    found = dataset.measured(cells.kernel, cells.rows, cells.rules.t_end, lives.left())
    found["step_rule"] = cells.step_rule
    against = {Doubt.TIME_LIMIT: found["status"] == TIME_LIMIT} if "reversals" in found else {}
    if cells.rules.twice:
        against |= _estimated(lives, cells, found)
    for bit, where in against.items():
        found["doubts"] |= bit * where
    sound = np.isin(found["status"], (SETTLED, TIME_LIMIT))
    found["doubts"][~sound] = 0
    if Doubt.MARGIN in against:
        found["certain"] = sound & (found["doubts"] & COUNT_DOUBTS == 0)
    return found


def _estimated(lives: Lives, cells: Cells, found: dict[str, Array]) -> dict[Doubt, Array]:
    """Add the errors of cells that were run twice to `found`; return which cells they give reason to doubt."""
    errors, table = Errors(*(lives.notes["error"][name] for name in Errors._fields)), cells.table
    spin = np.where(np.isinf(errors.spin), np.nan, errors.spin)
    errors = errors._replace(spin=np.where(table["failed_at"] > 0, table["failed_error"], spin))
    found["spin_error"] = np.where(found["doubts"] & Doubt.ROUND_OFF, np.nan, errors.reported)
    against = {Doubt.TOLERANCE: lives.notes["missed"]}
    if "reversals" in found:
        against[Doubt.STEP] = errors.reversals != found["reversals"]  # a failed second run has the count NaN
    if "margin_more" in found:
        clear = _clear(found, errors, slows=cells.model.slows)
        against[Doubt.MARGIN] = (found["status"] == SETTLED) & ~clear
        against[Doubt.PARITY] = ~_consistent(cells, found)
    return against


def _clear(found: Mapping[str, Array], errors: Errors, *, slows: bool) -> Array:
    """Return where both margins of a count are larger than ten times their errors, shape (cells,).

    Two runs may agree in one margin by chance, however wrong both are; that they agree in both is less likely. So the
    larger error counts for both, unless a couple slows the spin, and with it the error of the overshoot.
    """
    larger = np.fmax(errors.overshoot, errors.nearest_approach)
    below = (found["reversals"] == 0) | (found["margin_fewer"] > CLEAR * larger)
    return np.asarray(below & (found["margin_more"] > CLEAR * (errors.nearest_approach if slows else larger)))


def _consistent(cells: Cells, found: Mapping[str, Array]) -> Array:
    """Return where the parity of the count matches the signs of the spin at start and end, shape (cells,)."""
    model, columns = cells.model, cells.columns
    start, _, _ = model.energy(model.start(columns), model.constants.of(columns))
    turned = start * found["spin_final"]
    return np.asarray(np.where(found["reversals"] % 2 == 1, turned <= 0, turned >= 0))
