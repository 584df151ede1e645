"""Advances a table of trajectories to their ends, in chunks of work."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from sweep.grid import Array
from sweep.interrupt import point
from sweep.jit import threads
from sweep.kernels.kernel import Kernel
from sweep.kernels.layout import BLOCK, LANES
from sweep.kernels.status import RUNNING

CHUNK_SECONDS = 0.7
"""Length of a chunk.  Progress, checkpoints and Ctrl-C wait for the end of one."""

STEP_SECONDS = 25e-9
"""Rough time of a step of one lane on one thread, measured on the slip model with dopri5 (`sweep bench`)."""

UNTIL_ALL_STOP = 2**40
"""Blocks of steps: as many as are needed."""


def execute(
    kernel: Kernel,
    images: Array,
    *,
    stop_when_settled: bool,
    after_chunk: Callable[[], None] | None = None,
    chunk_blocks: int | None = None,
    chunk_seconds: float | None = None,
) -> None:
    """Advance all unfinished `images`, in place, until every trajectory has ended.

    Parameters
    ----------
    images : shape (cells, rows), a row of the table per trajectory
    stop_when_settled : end a trajectory as soon as its spin can no longer reverse
    after_chunk : called after each chunk, when `images` is consistent: to report, save, or stop
        by raising an exception
    chunk_blocks : blocks of steps per chunk; by default as many as take about `chunk_seconds`
    chunk_seconds : by default `CHUNK_SECONDS`

    Notes
    -----
    Trajectories that have begun go first and the others follow in random order, so that those done
    are always a fair sample, from which the time left can be estimated.  Neither the order nor the
    size of the chunks changes a result.
    """
    status = kernel.table(images)["status"]
    steps = kernel.table(images)["done"]
    order = np.random.default_rng(0).permutation(len(images))
    blocks = chunk_blocks or 1
    while len(pending := order[status[order] == RUNNING]):
        pending = pending[np.argsort(steps[pending] == 0, kind="stable")]
        chunk_began = time.perf_counter()
        kernel.advance(images, pending, blocks, stop_when_settled)
        kernel.carry(images)
        if chunk_blocks is None:
            blocks = _rescale(blocks, time.perf_counter() - chunk_began, chunk_seconds or CHUNK_SECONDS)
        if after_chunk:
            after_chunk()
        point()


def _rescale(blocks: int, seconds: float, wanted: float) -> int:
    # While the last trajectories pause often, every call is short, and `blocks` would grow without end.
    return min(max(1, int(blocks * np.clip(wanted / seconds, 0.25, 8))), UNTIL_ALL_STOP)


def nominal_seconds(steps: Array) -> float:
    """Rough upper bound on the time for trajectories of so many `steps`, shape (cells,)."""
    lanes = max(threads() * LANES, len(steps))
    blocks = np.ceil(steps / BLOCK)
    return float(max(blocks.mean() * lanes / threads(), blocks.max() * LANES) * BLOCK * STEP_SECONDS)
