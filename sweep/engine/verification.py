"""Runs a random sample of the cells again with the plain method at half its step, so that a run measures its own error.

The fixed-step formula of Dormand and Prince is the yardstick of all methods.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cache

import numpy as np

from sweep.config import Config
from sweep.engine import executor
from sweep.engine.plan import kernel_of
from sweep.grid import Array
from sweep.kernels import methods
from sweep.kernels.methods import PLAIN
from sweep.kernels.status import SETTLED, TIME_LIMIT
from sweep.models.model import Columns
from sweep.results import dataset

COMPARED = ("t_stop", "spin_final", "reversals")
"""The results of the first run that are needed."""


@cache
def draw(cells: int, share: float) -> Array:
    """Indices of the cells to run again, ascending.  It is drawn once, and every tile takes its cells from it."""
    return np.sort(np.random.default_rng(0).choice(cells, math.ceil(share * cells), replace=False, shuffle=False))


def sound(drawn: Array, results: Mapping[str, Array]) -> Array:
    """Those of the cells `drawn` whose first run has not failed."""
    return np.asarray(drawn[np.isin(results["status"][drawn], (SETTLED, TIME_LIMIT))])


def verify(
    config: Config,
    columns: Columns,
    first: Mapping[str, Array],
    after_chunk: Callable[[], None] | None = None,
) -> dict[str, Array]:
    """Run cells that have ended soundly a second time, up to the times at which they ended.

    Parameters
    ----------
    columns : physical parameters by name, each of shape (cells,)
    first : results of the first run by name, those in `COMPARED` if they are measured, each of shape (cells,)
    after_chunk : called after each chunk of work

    Returns
    -------
    By name, each of shape (cells,): the results of the second run, and how they differ from those of the first.
    """
    if not len(first["t_stop"]):
        return {}
    kernel, t_stop = kernel_of(PLAIN, config), first["t_stop"]
    if config.integrator.step == "auto":
        step, _ = methods.automatic_step(PLAIN, kernel.model, columns, config.integrator.tolerance)
    else:
        step = np.full(len(t_stop), config.integrator.step)
    images = kernel.images(columns, step / 2, t_stop)
    executor.execute(kernel, images, stop_when_settled=False, after_chunk=after_chunk)
    after = dataset.measured(kernel, images, t_stop)
    after["spin_difference"] = np.abs(after["spin_final"] - first["spin_final"])
    if "reversals" in after:
        after["count_changed"] = after["reversals"] != first["reversals"]
    return {f"verified_{name}": after[name] for name in dataset.VERIFIED if name in after}
