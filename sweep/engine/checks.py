"""Runs cells again, so that a run tells by itself how far its numbers can be trusted.

A random sample is run with the plain method at half its step: the fixed-step formula of Dormand and Prince is the
yardstick of all methods.  Where `sensitivity` is measured, each cell is run from starts next to its own as well, which
tells a count that nobody can know from a firm one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache

import numpy as np

from sweep.config import Config
from sweep.engine import executor
from sweep.engine.plan import Part, Plan, kernel_of
from sweep.grid import Array, Grid
from sweep.kernels import methods
from sweep.kernels.measures.sensitivity import SHORTER, Sensitivity
from sweep.kernels.methods import PLAIN
from sweep.kernels.status import SETTLED, TIME_LIMIT
from sweep.parameters import START
from sweep.results import dataset

NUDGE = 1e-10
"""Relative difference of the starts next to one another, in all their parameters."""


@cache
def draw(cells: int, share: float) -> Array:
    """Indices of the cells to run again, ascending.  It is drawn once, and every tile takes its cells from it."""
    return np.sort(np.random.default_rng(0).choice(cells, math.ceil(share * cells), replace=False, shuffle=False))


def verify(
    config: Config, cells: Array, first: Mapping[str, Array], after_chunk: Callable[[], None] | None = None
) -> dict[str, Array]:
    """Run those of `cells` that were drawn and ended soundly a second time, up to the times at which they ended.

    Parameters
    ----------
    cells : their indices in the grid, ascending
    first : results of the first run by name, those that are compared of shape (cells,)
    after_chunk : called after each chunk of work

    Returns
    -------
    By name: the indices of the cells that were run again, their results, and how these differ from the first.
    """
    grid = Grid.of(config)
    sound = np.isin(first["status"], (SETTLED, TIME_LIMIT))
    rows = np.flatnonzero(np.isin(cells, draw(grid.size, config.verify)) & sound)
    if not len(rows):
        return {"verified_cell": rows}
    first = {name: first[name][rows] for name in ("t_stop", "spin_final", "reversals") if name in first}
    kernel, columns, t_stop = kernel_of(PLAIN, config), grid.take(cells[rows]).columns(), first["t_stop"]
    if config.integrator.step == "auto":
        step, _ = methods.automatic_step(PLAIN, kernel.model, columns, config.integrator.tolerance)
    else:
        step = np.full(len(t_stop), config.integrator.step)
    images = kernel.images(columns, step / 2, t_stop)
    executor.execute(kernel, images, stop_when_settled=False, after_chunk=after_chunk)
    again = dataset.measured(kernel, images, t_stop)
    again["spin_difference"] = np.abs(again["spin_final"] - first["spin_final"])
    if "reversals" in again:
        again["count_changed"] = again["reversals"] != first["reversals"]
    found = {f"verified_{name}": again[name] for name in dataset.VERIFIED if name in again}
    return {"verified_cell": cells[rows]} | found


def sensitivity(job: Plan, after_chunk: Callable[[], None]) -> dict[str, Array]:
    """Fewest and most reversals of each cell among all its runs, and whether they differ, each over all cells of `job`.

    Nothing if the configuration does not measure `sensitivity`.
    """
    asked = [each.count for each in job.parts[0].kernel.measurements if isinstance(each, Sensitivity)]
    if not asked:
        return {}
    low, high = (np.zeros(sum(grid.size for grid in job.grids)) for _ in range(2))
    for part in job.parts:
        first = part.kernel.table(part.images)["reversals"]
        counts = [first, *(_again(part, k + 1, after_chunk) for k in range(asked[0]))]
        low[part.cells], high[part.cells] = np.nanmin(counts, axis=0), np.nanmax(counts, axis=0)
    return {"reversals_low": low, "reversals_high": high, "sensitive": low != high}


def _again(part: Part, number: int, after_chunk: Callable[[], None]) -> Array:
    """Reversals of the cells of `part` in their run of this number, NaN for those that failed at first."""
    counts, sound = np.full(len(part.cells), np.nan), np.flatnonzero(~part.failed)
    if len(sound):
        columns = {name: values[sound] for name, values in part.columns.items()}
        columns |= {name: columns[name] * (1 + number * NUDGE) for name in START & columns.keys()}
        step = SHORTER * part.kernel.table(part.images)["step"][sound]
        near = replace(part.take(sound), columns=columns, step=step)
        images = near.start()
        settle = part.config.integrator.stop_when_settled
        executor.execute(part.kernel, images, stop_when_settled=settle, after_chunk=after_chunk)
        counts[sound] = part.kernel.table(images)["reversals"]
    return counts
