"""Collects the results of cells whose lives have ended: the simulated variables, and the reasons to doubt them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sweep.engine.cells import Cells
from sweep.engine.errors import Errors, doubted_counts
from sweep.engine.lives import Lives
from sweep.engine.plan import Plan
from sweep.grid import Array
from sweep.kernels.methods import AUTO
from sweep.kernels.status import COUNT_DOUBTS, IMPOSSIBLE, SETTLED, TIME_LIMIT, Doubt
from sweep.results import dataset


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
    return {Doubt.TOLERANCE: lives.notes["missed"]} | doubted_counts(cells, errors)
