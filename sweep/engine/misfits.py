"""Computes the misfit of every cell of a run to a film, from samples of its spin.

A run may end before the film does, and its steps do not stop at the film's instants. Each cell is therefore followed
once more, with steps of dopri5 that end at the instants.
"""

from __future__ import annotations

import numpy as np

from sweep.config import Config
from sweep.config.film import Film
from sweep.engine.cells import Cells
from sweep.engine.plan import Plan, steps_of
from sweep.grid import Array
from sweep.interrupt import point
from sweep.jit import threads
from sweep.kernels.layout import LANES
from sweep.kernels.measures.misfit import Misfit
from sweep.kernels.methods import PLAIN, automatic_step
from sweep.kernels.samples import sampled

# Steps between two checks for Ctrl-C, which take a few tenths of a second.
_STEPS = 2e7


def misfits(job: Plan) -> dict[str, Array]:
    """Compute the misfit of all cells of `job`, whose runs have ended, if it is measured; NaN where a run failed."""
    film = job.config.film
    if film is None:
        return {}
    found = np.full(sum(grid.size for grid in job.grids), np.nan)
    for part in job.parts:
        if len(sound := np.flatnonzero(~part.failed)):
            found[part.cells[sound]] = _of_part(job.config, part, sound, film)
    return {Misfit.name: found}


def _of_part(config: Config, part: Cells, rows: Array, film: Film) -> Array:
    """Return the misfits of the cells of `part` with the indices `rows`, in the same order."""
    model, columns = part.model, part.columns
    usual, _ = steps_of(part.method, config, columns)
    # Cells that were repeated with shorter steps need them here too.
    step = automatic_step(PLAIN, model, columns)[0] * np.minimum(part.step / usual, 1.0)
    steps = len(film.time) + film.time[-1] / step[rows]
    pieces = np.array_split(rows, max(1, min(len(rows) // (LANES * threads()), int(steps.sum() / _STEPS))))
    found = []
    for some in pieces:
        theirs = {name: values[some] for name, values in columns.items()}
        spins = sampled(model, theirs, step[some], film.time)
        found.append(np.sum(((spins - film.value) / film.errors) ** 2, axis=1))
        point()
    return np.concatenate(found)
