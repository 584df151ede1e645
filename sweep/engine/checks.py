"""Runs cells again, so that a run tells by itself how far its numbers can be trusted.

A random sample is run with the plain method at half its step: the fixed-step formula of Dormand and Prince is the
yardstick of all methods.  Where `sensitivity` is measured, each cell is run from starts next to its own as well, which
tells a count that nobody can know from a firm one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np

from sweep.config import Config
from sweep.engine import final
from sweep.engine.errors import Errors
from sweep.engine.executor import Work
from sweep.engine.misfits import misfits
from sweep.engine.plan import Part, Plan, kernel_of, steps_of
from sweep.grid import Array
from sweep.kernels.measures.sensitivity import SHORTER, Sensitivity
from sweep.kernels.methods import PLAIN
from sweep.kernels.status import SETTLED, TIME_LIMIT
from sweep.parameters import START
from sweep.results import dataset

NUDGE = 1e-10
"""Relative difference of the starts next to one another, in all their parameters."""

DECIDED = 10.0
"""How many times its estimated error the margin of a count has to be: of estimates, one in some hundred is more than
ten times too small (docs/explanation/accuracy.md)."""


@cache
def draw(cells: int, share: float) -> Array:
    """Indices of the cells to run again, ascending.  It is drawn once, and every tile takes its cells from it."""
    return np.sort(np.random.default_rng(0).choice(cells, math.ceil(share * cells), replace=False, shuffle=False))


def verify(config: Config, cells: Array, first: Mapping[str, Array], work: Work) -> dict[str, Array]:
    """Run those of `cells` that were drawn and ended soundly a second time, up to the times at which they ended.

    Parameters
    ----------
    cells : their indices in the grid, ascending
    first : results of the first run by name, those that are compared of shape (cells,)

    Returns
    -------
    By name: the indices of the cells that were run again, their results, and how these differ from the first.
    """
    grid = config.grid
    sound = np.isin(first["status"], (SETTLED, TIME_LIMIT))
    rows = np.flatnonzero(np.isin(cells, draw(grid.size, config.verify)) & sound)
    if not len(rows):
        return {"verified_cell": rows}
    first = {name: first[name][rows] for name in ("t_stop", "spin_final", "reversals") if name in first}
    kernel, columns, t_stop = kernel_of(PLAIN, config), grid.take(cells[rows]).columns(), first["t_stop"]
    step, _ = steps_of(PLAIN, config, columns)
    images = kernel.images(columns, step / 2, t_stop)
    work.run("verified", kernel, images)
    again = dataset.measured(kernel, images, t_stop)
    again["spin_difference"] = np.abs(again["spin_final"] - first["spin_final"])
    if "reversals" in again:
        again["count_changed"] = again["reversals"] != first["reversals"]
    again["cell"] = cells[rows]
    return {name: again[own] for name in dataset.VERIFIED if (own := name.removeprefix("verified_")) in again}


def results(job: Plan, errors: Errors | None, work: Work) -> dict[str, Array]:
    """Collect what was simulated, and what further runs tell of it, by name, each over all cells of `job`."""
    found = job.results() | misfits(job)
    if errors is None:
        return found | _counted(job, None, work)
    found |= {"spin_error": errors.told} | _counted(job, errors.reversals, work)
    return found | ({"decided": _decided(found, errors)} if "margin_more" in found else {})


def _decided(found: Mapping[str, Array], errors: Errors) -> Array:
    """Tell which counts are final and certain, shape (cells,)."""
    firm = (found["sensitive"] == 0) & (found["window_dependent"] == 0) & (found["status"] == SETTLED)
    below = (found["reversals"] == 0) | (found["margin_fewer"] > DECIDED * errors.overshoot)
    return np.asarray(firm & below & (found["margin_more"] > DECIDED * errors.nearest_approach))


def _counted(job: Plan, companions: Array | None, work: Work) -> dict[str, Array]:
    """Tell which counts other runs of the same cells do not give, over all cells of `job`.

    Where `sensitivity` is measured, the cells are run again for it, and the fewest and most reversals are told as well.
    Nothing if reversals are not counted, or no cell has been run twice.

    Parameters
    ----------
    companions : counts of the runs that tell errors, NaN where there is none, shape (cells,); None without these runs
    """
    measurements = job.parts[0].kernel.measurements
    asked = next((each.count for each in measurements if isinstance(each, Sensitivity)), 0)
    if "reversals" not in job.parts[0].kernel.measure or (companions is None and not asked):
        return {}
    low = np.zeros(sum(grid.size for grid in job.grids))
    high, sensitive = low.copy(), np.zeros(len(low), bool)
    for part in job.parts:
        first, cells = part.kernel.table(part.images)["reversals"], part.cells
        counts = [first, *(_again(part, k + 1, work) for k in range(asked))]
        low[cells], high[cells] = np.nanmin(counts, axis=0), np.nanmax(counts, axis=0)
        sensitive[cells] = low[cells] != high[cells]
        if companions is not None:
            sensitive[cells] |= ~(companions[cells] == first) & ~part.failed
    return {"sensitive": sensitive} | ({"reversals_low": low, "reversals_high": high} if asked else {})


def _again(part: Part, number: int, work: Work) -> Array:
    """Reversals of the cells of `part` in their run of this number, NaN for those that failed at first."""
    counts, sound = np.full(len(part.cells), np.nan), np.flatnonzero(~part.failed)
    if len(sound):
        columns = {name: values[sound] for name, values in part.columns.items()}
        columns |= {name: columns[name] * (1 + number * NUDGE) for name in START & columns.keys()}
        step = SHORTER * part.kernel.table(part.images)["step"][sound]
        near = replace(part.take(sound), columns=columns, step=step).start()
        final.run(near, work, f"{part.method} nudged {number}")
        counts[sound] = near.kernel.table(near.images)["reversals"]
    return counts
