"""What a run would take, told from a sample of its cells before anything is computed."""

from __future__ import annotations

import numpy as np

from sweep.config import Config
from sweep.config.user_models import explained
from sweep.engine.executor import nominal_seconds
from sweep.engine.local import BATCH
from sweep.engine.plan import choose
from sweep.grid import Grid

_SAMPLE = 4096
"""Cells whose steps are chosen to judge all the others by."""

_BYTES_A_CELL = 130
"""What the results of a cell take on disk."""


def estimate(config: Config) -> str:
    """Cells, steps, memory and time of a run, a line each."""
    grid = Grid.of(config)
    axes = " × ".join(f"{d} {n}" for d, n in zip(grid.dims, grid.shape, strict=True)) or "one cell"
    cells = f"cells:  {grid.size} ({axes})" + (", not all of them simulated" if config.refine else "")
    if not config.simulated:
        return cells
    sample = grid.sample(_SAMPLE)
    with explained(config.origin):
        chosen, share = choose(config, sample), grid.size / sample.size
    steps = [np.ceil(config.integrator.t_end / each.step) for each in chosen if len(each.cells)]
    total, seconds = sum(each.sum() for each in steps) * share, sum(map(nominal_seconds, steps)) * share
    numbers = sum(len(each.cells) * len(each.kernel.layout.names) for each in chosen)
    bytes_a_cell = np.dtype(float).itemsize * numbers / sample.size
    memory, disk = min(grid.size, BATCH) * bytes_a_cell / 2**20, grid.size * _BYTES_A_CELL / 2**20
    return "\n".join(
        [
            cells,
            f"steps:  at most {total:.3g}, {total / grid.size:.3g} per cell",
            f"memory: {memory:.3g} MiB for running trajectories; on disk as much again, and {disk:.3g} MiB of results",
            f"time:   at most about {seconds:.3g} s, if every cell runs to t_end; cells that settle stop earlier",
        ]
    )
