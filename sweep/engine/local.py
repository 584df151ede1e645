"""Runs tiles in this process, on all its threads; a worker of a cluster runs its tiles this way too."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sweep.config import Config
from sweep.engine import limits
from sweep.engine.life import live, progress
from sweep.engine.lives import Lives
from sweep.engine.outcome import results
from sweep.engine.plan import plan
from sweep.grid import Array, Grid, Tile
from sweep.interrupt import heard, point
from sweep.kernels.status import IMPOSSIBLE, SETTLED
from sweep.prediction import predict
from sweep.results.provenance import this_cpu
from sweep.results.store import Running, Store

Done = tuple[int, dict[str, Array]]
"""The number of a finished tile, its results by name, each of shape (cells,), its cost and the type of CPU."""


def run_batch(
    config: Config,
    tiles: Sequence[Tile],
    batch: Sequence[int],
    *,
    store: Store | None = None,
    left: Running | None = None,
    after_chunk: Callable[[float, int], None] = lambda done, failed: None,  # noqa: ARG005
) -> Iterator[Done]:
    """Run the tiles `batch` together.

    Parameters
    ----------
    store : saves the state rows between chunks
    left : the state rows of this batch that an earlier run left, to be resumed
    after_chunk : called with the number of finished cells of the batch, fractional where a cell is run more than once,
        and the number of failed ones
    """
    grid, cpu = config.grid, np.array(this_cpu())
    if not config.simulated:
        for i in batch:
            point()
            yield i, _evaluate(config, grid.part(tiles[i])) | {"seconds": np.array(0.0), "cpu": cpu}
        return
    job = plan(config, *(grid.part(tiles[i]) for i in batch))
    for part in job.parts:
        part.kernel.advancing.compile()
    began = time.perf_counter() - (left.seconds if left else 0)
    lives = [Lives(part) for part in job.parts]
    for each in lives:
        each.resume(left.tables if left else {})

    saves = _Saves()

    def save() -> None:
        if store:
            with saves:
                tables = {name: table for each in lives for name, table in each.saved().items()}
                store.save_running(Running(list(batch), tables, time.perf_counter() - began))

    def report() -> None:
        # Save state rows only between two chunks: anywhere else an interrupt may find half of them advanced.
        if saves.due or heard():
            save()
        try:
            after_chunk(*progress(lives))
        except BaseException:
            save()
            raise

    live(lives, report)
    found = results(job, lives)
    cost = {"seconds": np.array((time.perf_counter() - began) / len(batch)), "cpu": cpu}
    for i, arrays in zip(batch, job.by_grid(found), strict=True):
        yield i, arrays | cost


@dataclass
class _Saves:
    """Say when state rows are to be saved next, so that saving takes a fiftieth of the time.

    Saved after each chunk, they took a fifth of the time of `configs/mu_b.yaml`.  A run that is killed loses what was
    computed since; one that is interrupted saves first.
    """

    ended: float = 0.0
    seconds: float = 0.0

    @property
    def due(self) -> bool:
        return time.perf_counter() - self.ended > 50 * self.seconds

    def __enter__(self) -> None:
        self.seconds = -time.perf_counter()

    def __exit__(self, *_: object) -> None:
        self.ended = time.perf_counter()
        self.seconds += self.ended


def batches(
    grid: Grid, tiles: Sequence[Tile], todo: Sequence[int], store: Store
) -> Iterator[tuple[list[int], Running | None]]:
    """Return the tiles to run together, out of `todo`: first those whose state rows `store` has."""
    left = store.load_running()
    if left and set(left.tiles) <= set(todo):
        yield left.tiles, left
        todo = [i for i in todo if i not in left.tiles]
    for batch in split(grid, tiles, todo, limits.LIMITS.batch, len(todo)):
        yield batch, None


def split(grid: Grid, tiles: Sequence[Tile], todo: Sequence[int], cells: int, most: int) -> Iterator[list[int]]:
    """Split `todo` into batches of about `cells` cells, but at least one tile and at most `most` tiles."""
    largest = max((grid.part(tiles[i]).size for i in todo), default=1)
    length = max(1, min(cells // largest, most))
    return (list(todo[first : first + length]) for first in range(0, len(todo), length))


def _evaluate(config: Config, grid: Grid) -> dict[str, Array]:
    """Return the results of a model that is not simulated."""
    arrays = predict(config.tier, grid, config.measure).variables
    arrays["status"] = np.where(config.tier.impossible(grid.columns()), IMPOSSIBLE, SETTLED)
    if "reversals" in config.measure:
        arrays["reversals"] = arrays[config.tier.counts]
    return arrays
