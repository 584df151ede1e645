"""Collects the results of cells whose lives have ended: the simulated variables, and the reasons to doubt them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sweep.engine.errors import Errors
from sweep.engine.lives import Lives
from sweep.engine.plan import Plan
from sweep.grid import Array
from sweep.kernels.layout import Table
from sweep.kernels.measures.margin import Margin
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
    if cells.rules.twice:
        found["spin_error"] = np.where(found["doubts"] & Doubt.ROUND_OFF, np.nan, _spin_error(lives, cells.table))
    limited, sound = found["status"] == TIME_LIMIT, np.isin(found["status"], (SETTLED, TIME_LIMIT))
    doubts = found["doubts"] | lives.notes["doubts"] | Doubt.TIME_LIMIT * (limited & ("reversals" in found))
    found["doubts"] = np.where(sound, doubts, 0)
    if cells.rules.twice and Margin.name in cells.kernel.measure:
        found["certain"] = sound & (found["doubts"] & COUNT_DOUBTS == 0)
    return found


def _spin_error(lives: Lives, table: Table) -> Array:
    """Return the errors of the final spins: those that second runs give, or those at failures."""
    errors = Errors(*(lives.notes["error"][name] for name in Errors._fields))
    spin = np.where(np.isinf(errors.spin), np.nan, errors.spin)
    return errors._replace(spin=np.where(table["failed_at"] > 0, table["failed_error"], spin)).reported
