"""Advances trajectories to their ends, in chunks of work."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from sweep.engine import limits
from sweep.engine.lives import DONE, Lives, Next
from sweep.grid import Array
from sweep.interrupt import point
from sweep.jit import threads
from sweep.kernels.kernel import Kernel
from sweep.kernels.layout import BLOCK, LANES
from sweep.kernels.status import RUNNING

_SHORT = 0.05
"""Length of a chunk in s once lanes are idle: cells that have ended may continue."""

# Cells that have ended continue in batches of this many, unless fewer than this many other cells remain for each lane.
_TOGETHER, _ENOUGH = 64, 2

STEP_SECONDS = 25e-9
"""Rough time of a step of one lane on one thread, measured on the slip model with dopri5 (`sweep bench`)."""

UNTIL_ALL_STOP = 2**40
"""Number of blocks of steps without a limit."""


def keep_busy(
    lives: Sequence[Lives],
    next_of: Callable[[Lives, Array], Iterable[tuple[Array, Next]]],
    after_chunk: Callable[[], None] = lambda: None,
) -> None:
    """Run the cells of `lives` through all their stages.

    Lanes take waiting cells, those with most steps left in their stage first. Neither the order nor the size of the
    chunks changes a result.

    Parameters
    ----------
    next_of : called with cells whose stages have ended; says which of them go where next
    after_chunk : called after each chunk, when all is consistent: to report, save, or stop by raising an exception
    """
    blocks = [1] * len(lives)
    while True:
        for each in lives:
            few = len(each.running) < _ENOUGH * threads() * LANES
            if len(each.quiet) >= (1 if few else _TOGETHER):
                kernel = each.cells.kernel
                kernel.stepper.between(kernel, each.rows)
            if len(ended := each.ended) >= (1 if few else _TOGETHER):
                for which, to in next_of(each, ended):
                    each.enter(which, to)
        waiting = [(i, which) for i, each in enumerate(lives) if len(which := each.running)]
        if not waiting and all((each.stage == DONE).all() for each in lives):
            return
        for i, which in waiting:
            blocks[i] = _advance(lives[i], which, blocks[i])
            after_chunk()
            point()


def _advance(lives: Lives, which: Array, blocks: int) -> int:
    """Advance the cells `which` by `blocks` in every lane; return how many blocks the next chunk should have."""
    kernel, rows = lives.cells.kernel, lives.rows
    table, began = kernel.table(rows), time.perf_counter()
    left = table["goal"][which] - table["done"][which]
    least = max(1, int(blocks * _SHORT / limits.LIMITS.chunk_seconds))
    taken = kernel.advance(rows, which[np.argsort(-left, kind="stable")], blocks, least)
    taken = max(1, taken // min(threads(), len(which)))
    return _rescale(taken, time.perf_counter() - began)


def execute(
    kernel: Kernel, rows: Array, *, after_chunk: Callable[[], None] = lambda: None, chunk_blocks: int | None = None
) -> None:
    """Advance all unfinished `rows`, in place, until every trajectory has ended.

    Parameters
    ----------
    rows : state rows, shape (cells, quantities)
    after_chunk : called after each chunk, when `rows` is consistent: to report, or stop by raising an exception
    chunk_blocks : blocks of steps per chunk; by default those of `sweep.engine.limits`
    """
    status = kernel.table(rows)["status"]
    blocks = chunk_blocks or 1
    while len(pending := np.flatnonzero(status == RUNNING)):
        chunk_began = time.perf_counter()
        kernel.advance(rows, pending, blocks)
        kernel.stepper.between(kernel, rows)
        if chunk_blocks is None:
            blocks = _rescale(blocks, time.perf_counter() - chunk_began)
        after_chunk()
        point()


def _rescale(blocks: int, seconds: float) -> int:
    """Return the blocks of the next chunk, after one of `blocks` blocks that took `seconds`."""
    chunk = limits.LIMITS
    # When the last trajectories pause often, every call is short, and `blocks` would grow without bound.
    wanted = min(max(1, int(blocks * np.clip(chunk.chunk_seconds / seconds, 0.25, 8))), UNTIL_ALL_STOP)
    return chunk.chunk_blocks or wanted


def nominal_seconds(steps: Array) -> float:
    """Return a rough upper bound on the time for trajectories of `steps`, shape (cells,)."""
    lanes = max(threads() * LANES, len(steps))
    blocks = np.ceil(steps / BLOCK)
    return float(max(blocks.mean() * lanes / threads(), blocks.max() * LANES) * BLOCK * STEP_SECONDS)
