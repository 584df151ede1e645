"""A share of the cells, drawn at random, run again with finer steps: a run's own measure of its error."""

from __future__ import annotations

import math

import numpy as np

from sweep import dataset, executor
from sweep.grid import Array
from sweep.kernels import methods
from sweep.kernels.lanes import SETTLED, TIME_LIMIT
from sweep.models.coefficients import rattle_period
from sweep.plan import Part, Plan

FINER = 100.0
"""By what the tolerance is divided; the step is halved at least."""


def verify(job: Plan) -> tuple[Array, dict[str, Array]]:
    """Draw the share `verify` of the cells that did not fail, and run them again, to where they ended.

    Returns
    -------
    Indices of the cells in the grid, ascending, and what the second run found for them, by the
    names of the dataset's variables.
    """
    rng = np.random.default_rng(0)
    status = np.empty(job.grid.size)
    for part in job.parts:
        status[part.cells] = part.images[:, part.kernel.row("status")]
    sound = np.flatnonzero(np.isin(status, (SETTLED, TIME_LIMIT)))
    count = min(len(sound), math.ceil(job.config.verify * job.grid.size))
    drawn = np.sort(rng.choice(sound, count, replace=False))
    arrays: dict[str, Array] = {}
    for part in job.parts:
        where = np.flatnonzero(np.isin(part.cells, drawn))
        if len(where):
            at = np.searchsorted(drawn, part.cells[where])
            for name, values in _again(job, part, where).items():
                arrays.setdefault(name, np.empty(count))[at] = values
    return drawn, arrays


def _again(job: Plan, part: Part, where: Array) -> dict[str, Array]:
    model, integrator = part.kernel.model, job.config.integrator
    columns = {name: values[part.cells[where]] for name, values in job.grid.columns().items()}
    first = part.images[where]
    step, t_stop = first[:, part.kernel.row("step")] / 2, part.kernel.times(first, integrator.t_end)
    kernel = methods.make_kernel(part.method, model, part.kernel.measure, integrator.tolerance / FINER)
    if integrator.step == "auto":
        finer, _ = methods.automatic_step(part.method, model, columns, integrator.tolerance / FINER)
        step = np.minimum(step, finer)
    never = np.full((6, len(where)), np.nan)
    images = kernel.images(columns, step, t_stop, never, rattle_period(columns))
    executor.execute(kernel, images, stop_when_settled=False)
    return dataset.measured(kernel, images, t_stop)
