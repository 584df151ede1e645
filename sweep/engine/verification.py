"""Runs a random sample of the cells again with finer steps, so that a run measures its own error."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from sweep.engine import executor
from sweep.engine.plan import Part, Plan
from sweep.grid import Array
from sweep.kernels import methods
from sweep.kernels.status import SETTLED, TIME_LIMIT
from sweep.results import dataset

FINER = 100.0
"""Factor by which the second run divides the tolerance; its step is at most half that of the first run."""


@cache
def draw(cells: int, share: float) -> Array:
    """Indices of the cells to run again, ascending.  It is drawn once, and every tile takes its cells from it."""
    return np.sort(np.random.default_rng(0).choice(cells, math.ceil(share * cells), replace=False, shuffle=False))


def verify(job: Plan, drawn: Array) -> dict[str, Array]:
    """Run the cells `drawn`, except those that failed, a second time, up to the times at which they ended.

    Returns
    -------
    Arrays by name: `verified_cell`, indices in the grid of `job`, ascending; the results of the second
    run for these cells; and how they differ from those of the first.
    """
    status = np.empty(job.grid.size)
    for part in job.parts:
        status[part.cells] = part.status
    drawn = drawn[np.isin(status[drawn], (SETTLED, TIME_LIMIT))]
    again: dict[str, Array] = {}
    for part in job.parts:
        where = np.flatnonzero(np.isin(part.cells, drawn))
        if len(where):
            at = np.searchsorted(drawn, part.cells[where])
            for name, values in _again(job, part, where).items():
                again.setdefault(f"verified_{name}", np.empty(len(drawn)))[at] = values
    return {"verified_cell": drawn, **again}


def _again(job: Plan, part: Part, where: Array) -> dict[str, Array]:
    model, integrator = part.kernel.model, job.config.integrator
    columns = {name: values[where] for name, values in part.columns.items()}
    first = part.images[where]
    step, t_stop = first[:, part.kernel.row("step")] / 2, part.kernel.times(first, integrator.t_end)
    kernel = methods.make_kernel(part.method, model, part.kernel.measure, integrator.tolerance / FINER)
    if integrator.step == "auto":
        finer, _ = methods.automatic_step(part.method, model, columns, integrator.tolerance / FINER)
        step = np.minimum(step, finer)
    images = kernel.images(columns, step, t_stop)
    executor.execute(kernel, images, stop_when_settled=False)
    before, after = (dataset.measured(part.kernel, first, t_stop), dataset.measured(kernel, images, t_stop))
    after["spin_difference"] = np.abs(after["spin_final"] - before["spin_final"])
    if "reversals" in after:
        after["count_changed"] = after["reversals"] != before["reversals"]
    return {name: after[name] for name in dataset.VERIFIED if name in after}
