"""Estimates the cost of a run from a sample of its cells, before anything is computed."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from sweep.config import Config
from sweep.engine import limits
from sweep.engine.cells import Choice
from sweep.engine.executor import nominal_seconds
from sweep.engine.plan import choose, kernels
from sweep.faults import duration
from sweep.grid import Array
from sweep.kernels.build import compile_seconds, missing
from sweep.models import MODELS
from sweep.models.user.blame import blamed

_SAMPLE = 4096
"""Number of cells whose steps are chosen, as a sample of all cells."""

_BYTES_A_CELL = 130
"""Bytes on disk for the results of a cell."""

_AROUND = 2.6
"""Time in s to import the libraries, to write the dataset and to draw the maps."""

_GENERAL = 1.4
"""Cost of a step of a model other than the paper's, relative to the paper's (docs/reference/performance.md)."""


def estimate(config: Config) -> str:
    """Describe cells, steps, memory and time of a run, a line each."""
    grid = config.grid
    axes = " × ".join(f"{d} {n}" for d, n in zip(grid.dims, grid.shape, strict=True))
    cells = f"cells:  {grid.size}{f' ({axes})' if axes else ''}"
    if not config.simulated:
        return cells
    sample = grid.sample(_SAMPLE)
    share = grid.size / sample.size
    with blamed(config.origin):
        chosen = tuple(each for each in choose(config, sample) if len(each.cells))
        steps = [np.ceil(config.integrator.in_one_leg.t_end / each.step) for each in chosen]
        seconds = sum(map(nominal_seconds, _works(config, chosen, steps, share)))
        compiling = compile_seconds(missing(kernels(config, chosen)))
    total = sum(each.sum() for each in steps) * share
    numbers = sum(len(each.cells) * len(each.kernel.layout.names) for each in chosen)
    bytes_a_cell = np.dtype(float).itemsize * numbers / sample.size
    memory, disk = min(grid.size, limits.LIMITS.batch) * bytes_a_cell / 2**20, grid.size * _BYTES_A_CELL / 2**20
    parts = f"{duration(compiling)} to compile, {duration(seconds)} to compute, {duration(_AROUND)} to start and draw"
    total_time = duration(compiling + seconds + _AROUND)
    return (
        f"{cells}\n"
        f"steps:  {total:.3g} if every cell runs to t_end, {total / grid.size:.3g} per cell\n"
        f"memory: {memory:.3g} MiB for running trajectories; on disk as much again, and {disk:.3g} MiB of results\n"
        f"time:   about {total_time}: {parts}; less if cells settle, more if some run again"
    )


def _works(config: Config, chosen: tuple[Choice, ...], steps: list[Array], share: float) -> Iterator[Array]:
    """Return the work for each cell, in steps of dopri5 alone: for each method."""
    if not chosen:
        return  # no body of the sample is possible
    relative = 1.0 if config.equations.name in MODELS else _GENERAL
    relative *= math.prod(each.cost for each in chosen[0].kernel.kinds)
    for each, theirs in zip(chosen, steps, strict=True):
        method = each.kernel.stepper
        work = method.step_cost * relative * (theirs + method.start_up_cost)
        work *= 1 + 1 / method.longer if config.integrator.estimate_errors else 1
        yield np.resize(work, round(len(work) * share))
