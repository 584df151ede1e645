"""Runs a random sample of the cells again with the plain method at half its step, so that a run measures its own error.

The fixed-step formula of Dormand and Prince is the yardstick of all methods.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache

import numpy as np

from sweep.engine import executor
from sweep.engine.plan import Part, Plan, kernel_of
from sweep.grid import Array
from sweep.kernels import methods
from sweep.kernels.methods import PLAIN
from sweep.kernels.status import SETTLED, TIME_LIMIT
from sweep.results import dataset


@cache
def draw(cells: int, share: float) -> Array:
    """Indices of the cells to run again, ascending.  It is drawn once, and every tile takes its cells from it."""
    return np.sort(np.random.default_rng(0).choice(cells, math.ceil(share * cells), replace=False, shuffle=False))


def verify(
    jobs: Sequence[Plan], drawn: Sequence[Array], after_chunk: Callable[[], None] | None = None
) -> list[dict[str, Array]]:
    """Run cells of jobs that have ended, except those that failed, a second time, up to the times at which they ended.

    Parameters
    ----------
    jobs : plans of one configuration
    drawn : for each job, indices of cells in its grid, ascending
    after_chunk : called after each chunk of work

    Returns
    -------
    For each job arrays by name: `verified_cell`, indices in its grid, ascending; the results of the second run for
    these cells; and how they differ from those of the first.
    """
    found = [dict[str, Array](verified_cell=_sound(job, cells)) for job, cells in zip(jobs, drawn, strict=True)]
    taken = [
        (again, part, where)
        for job, again in zip(jobs, found, strict=True)
        for part in job.parts
        for where in [np.flatnonzero(np.isin(part.cells, again["verified_cell"]))]
        if len(where)
    ]
    if not taken:
        return found
    config = jobs[0].config
    kernel, t_end = kernel_of(PLAIN, config), config.integrator.t_end
    columns = {
        name: np.concatenate([part.columns[name][where] for _, part, where in taken]) for name in taken[0][1].columns
    }
    if config.integrator.step == "auto":
        step, _ = methods.automatic_step(PLAIN, kernel.model, columns, config.integrator.tolerance)
    else:
        step = np.full(len(columns["a"]), config.integrator.step)
    t_stop = np.concatenate([part.kernel.times(part.images[where], t_end) for _, part, where in taken])
    images = kernel.images(columns, step / 2, t_stop)
    executor.execute(kernel, images, stop_when_settled=False, after_chunk=after_chunk)
    second, begin = dataset.measured(kernel, images, t_stop), 0
    for again, part, where in taken:
        mine = slice(begin, begin := begin + len(where))
        for name, values in _compared(part, where, t_stop[mine], {n: v[mine] for n, v in second.items()}).items():
            cells = again["verified_cell"]
            again.setdefault(f"verified_{name}", np.empty(len(cells)))[np.searchsorted(cells, part.cells[where])] = (
                values
            )
    return found


def _sound(job: Plan, drawn: Array) -> Array:
    """Those of the cells `drawn` that have not failed."""
    status = np.empty(job.grid.size)
    for part in job.parts:
        status[part.cells] = part.status
    return drawn[np.isin(status[drawn], (SETTLED, TIME_LIMIT))]


def _compared(part: Part, where: Array, t_stop: Array, after: dict[str, Array]) -> dict[str, Array]:
    """The results `after` of the second run of some cells of a part, and how they differ from those of the first."""
    before = dataset.measured(part.kernel, part.images[where], t_stop)
    after["spin_difference"] = np.abs(after["spin_final"] - before["spin_final"])
    if "reversals" in after:
        after["count_changed"] = after["reversals"] != before["reversals"]
    return {name: after[name] for name in dataset.VERIFIED if name in after}
