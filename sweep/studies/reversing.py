"""The spin n_c2 from which a trajectory reverses, by simulation."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from sweep.config import Config
from sweep.engine import executor
from sweep.engine.plan import Part, plan
from sweep.grid import Array, Grid
from sweep.kernels.status import RUNNING, SETTLED, TIME_LIMIT
from sweep.models.model import Columns
from sweep.models.stability import SPIN_LIMIT
from sweep.studies.bracket import FAILED, HAPPENS, NOT_YET, UNDECIDED, Bracket, search

# The search ends at this multiple of n_c1.  The paper's n_c2 is 2 n_c1; over 200 bodies (a = 1.5 … 50, |δ| <= 0.5,
# μ = 0.1 … 5000) it was found at up to 7.7 n_c1, with a median of 2.01.  Beyond, fast spins take long to simulate, and
# the body topples or leaves the plane instead: of 40 bodies searched up to a spin of 10, none reversed there.
_FARTHEST = 8.0


def find_n_c2(config: Config, bodies: Columns, n_c1: Array, width: float) -> Bracket:
    """The first |spin|, outwards from `n_c1`, from which the trajectory from the start point in `bodies` reverses.

    Parameters
    ----------
    bodies : parameters, each of shape (cells,)
    n_c1 : spin to begin at; its sign is that of all spins, shape (cells,)
    """

    def ask(cells: Array, size: Array) -> Array:
        spins = np.sign(n_c1[cells]) * size
        return _reverses(config, {name: values[cells] for name, values in bodies.items()} | {"n0": spins})

    return search(ask, np.abs(n_c1), np.minimum(_FARTHEST * np.abs(n_c1), SPIN_LIMIT), width)


def _reverses(config: Config, columns: Columns) -> Array:
    planned = plan(replace(config, measure=("reversals",)), Grid({}, {}, dict(columns)))
    outcomes = np.empty(planned.grid.size, int)
    for part in planned.parts:
        executor.execute(part.kernel, part.images, stop_when_settled=True, after_chunk=partial(_end_reversed, part))
        table = part.kernel.table(part.images)
        known = [table["reversals"] > 0, table["status"] == SETTLED, table["status"] == TIME_LIMIT]
        outcomes[part.cells] = np.select(known, [HAPPENS, NOT_YET, UNDECIDED], FAILED)
    return outcomes


def _end_reversed(part: Part) -> None:
    """End the trajectories that have reversed: what they do later is of no account."""
    table = part.kernel.table(part.images)
    table["status"] = np.where((table["status"] == RUNNING) & (table["reversals"] > 0), SETTLED, table["status"])
