"""Runs each cell again from starts next to its own, so that a count that nobody can know is told from a firm one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sweep.engine import executor
from sweep.engine.plan import Part, Plan
from sweep.grid import Array
from sweep.kernels.lanes import STABLE
from sweep.kernels.measures.sensitivity import Sensitivity
from sweep.kernels.status import FAILURES
from sweep.parameters import START

NUDGE = 1e-10
"""Relative difference of the starts, in all their parameters."""

SHORTER = 0.8
"""Ratio of the steps, so that a count that depends on the step shows too."""


def runs_asked_for(job: Plan) -> int:
    """How many further runs of each cell the configuration asks for; 0 if it does not measure `sensitivity`."""
    found = [each.count for part in job.parts for each in part.kernel.measurements if isinstance(each, Sensitivity)]
    return max(found, default=0)


def sensitivity(job: Plan, after_chunk: Callable[[], None]) -> dict[str, Array]:
    """Fewest and most reversals of each cell among all its runs, and whether they differ; each of shape (cells,)."""
    low, high = np.zeros(job.grid.size), np.zeros(job.grid.size)
    for part in job.parts:
        first = part.kernel.table(part.images)["reversals"]
        counts = [first, *(_again(job, part, k + 1, after_chunk) for k in range(runs_asked_for(job)))]
        low[part.cells], high[part.cells] = np.nanmin(counts, axis=0), np.nanmax(counts, axis=0)
    return {"reversals_low": low, "reversals_high": high, "sensitive": low != high}


def _again(job: Plan, part: Part, number: int, after_chunk: Callable[[], None]) -> Array:
    """Reversals of the cells of `part` in their run of this number, NaN for those that failed at first."""
    integrator, table = job.config.integrator, part.kernel.table(part.images)
    sound = ~np.isin(table["status"], FAILURES)
    counts = np.full(len(part.cells), np.nan)
    if not sound.any():
        return counts
    columns = {name: values[sound] for name, values in part.columns.items()}
    for name in START & columns.keys():
        columns[name] = columns[name] * (1 + number * NUDGE)
    stable = table.columns(STABLE)[sound].T
    images = part.kernel.images(columns, SHORTER * table["step"][sound], integrator.t_end, stable)
    executor.execute(part.kernel, images, stop_when_settled=integrator.stop_when_settled, after_chunk=after_chunk)
    counts[sound] = part.kernel.table(images)["reversals"]
    return counts
