"""Runs a table of trajectories to their ends, a chunk at a time."""

from __future__ import annotations

import time
from collections.abc import Callable

import numba
import numpy as np

from sweep.grid import Array
from sweep.kernels.lanes import BLOCK, LANES, RUNNING, Kernel

CHUNK_SECONDS = 0.7
"""Progress, checkpoints and Ctrl-C wait for a chunk at the most."""

_MOST_BLOCKS = 2**40


def execute(
    kernel: Kernel,
    images: Array,
    *,
    stop_when_settled: bool,
    after_chunk: Callable[[], None] | None = None,
    chunk_blocks: int | None = None,
) -> None:
    """Advance all unfinished `images`, in place, until every trajectory has ended.

    Parameters
    ----------
    after_chunk : called after each chunk, when `images` is consistent: to report, save or stop
        (by raising)
    chunk_blocks : blocks of steps a chunk; by default what takes about `CHUNK_SECONDS`

    Notes
    -----
    Trajectories that have begun go first, the others in a scrambled order, so that what is done
    is at any moment a fair sample of the whole and the time left can be told from it.  Neither
    the order nor the size of the chunks touches a result.
    """
    status = images[:, kernel.row("status")]
    steps = images[:, kernel.row("done")]
    order = np.random.default_rng(0).permutation(len(images))
    blocks = chunk_blocks or 1
    while len(pending := order[status[order] == RUNNING]):
        pending = pending[np.argsort(steps[pending] == 0, kind="stable")]
        chunk_began = time.perf_counter()
        kernel.advance(images, pending, blocks, stop_when_settled)
        kernel.carry(images)
        if chunk_blocks is None:
            blocks = _rescale(blocks, time.perf_counter() - chunk_began)
        if after_chunk:
            after_chunk()


def _rescale(blocks: int, seconds: float) -> int:
    # Where the last trajectories pause often, every call is short, and blocks would grow without end.
    return min(max(1, int(blocks * np.clip(CHUNK_SECONDS / seconds, 0.25, 8))), _MOST_BLOCKS)


def nominal_seconds(images: Array, kernel: Kernel) -> float:
    """Rough upper estimate of the time for `images`: every one stepped to its time limit.

    25 ns a step and lane on one thread, measured on the slip model with dopri5 (`sweep bench`).
    """
    goal = images[:, kernel.row("goal")] - images[:, kernel.row("done")]
    threads = numba.get_num_threads()
    lanes = max(threads * LANES, len(images))
    blocks = np.ceil(goal / BLOCK)
    return float(max(blocks.mean() * lanes / threads, blocks.max() * LANES) * BLOCK * 25e-9)
