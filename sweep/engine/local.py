"""Runs tiles in this process, on all its threads; a worker of a cluster runs its tiles this way too."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sweep.config import Config
from sweep.engine import final
from sweep.engine.checks import results, verify
from sweep.engine.errors import keep_tolerance
from sweep.engine.plan import Plan, plan
from sweep.engine.repeats import decide_failures
from sweep.engine.work import Work
from sweep.grid import Array, Grid, Tile
from sweep.interrupt import point
from sweep.kernels.status import RUNNING, SETTLED
from sweep.prediction import predict
from sweep.results import dataset
from sweep.results.provenance import this_cpu
from sweep.results.store import Running, Store

BATCH = 32_768
"""Cells simulated together (50 MB of images).  Lanes idle only at the end of such a batch of tiles."""

_FIRST = 0.6
"""The share of a cell's work that its first run is, where a second one tells its error."""


@dataclass(frozen=True)
class Done:
    """A finished tile."""

    tile: int
    arrays: dict[str, Array]
    """Results by name, each of shape (cells,)."""
    seconds: float
    cpu: str


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
    store : keeps the images after each chunk
    left : the images of this batch that an earlier run left, to be continued
    after_chunk : called with the number of the batch's cells that are done, a fraction where a cell is run more than
        once, and how many of them have failed
    """
    grid, cpu = Grid.of(config), this_cpu()
    if not config.simulated:
        for i in batch:
            point()
            yield Done(i, _evaluate(config, grid.part(tiles[i])), 0.0, cpu)
        return
    job = plan(config, *(grid.part(tiles[i]) for i in batch))
    for part in job.parts:
        part.kernel.compile()
    began = time.perf_counter() - (left.seconds if left else 0)
    work, twice = Work(left.tables if left else None), config.integrator.estimate_errors
    first = _FIRST if twice else 1.0
    # Through `work`, which calls it, `save` would keep itself and the images of the batch alive until Python looks for
    # cycles: 10⁶ cells took 629 MiB, 10⁵ 366.
    kept = work.kept

    def save() -> None:
        # Images are saved only between two chunks: anywhere else an interrupt may find half of them advanced.
        if store:
            store.save_running(Running(list(batch), kept, time.perf_counter() - began))

    def running() -> None:
        save()
        # What looks like a failure is decided only after all cells have ended.
        after_chunk(first * sum(int(((p.status != RUNNING) & ~p.failed).sum()) for p in job.parts), 0)

    def deciding() -> None:
        save()
        after_chunk(first * _ended(job), _failed(job))

    def measuring() -> None:
        save()
        cells = sum(len(part.cells) for part in job.parts)
        after_chunk(first * cells + (1 - first) * _ended(job), _failed(job))

    work.after_chunk = running
    for part in job.parts:
        final.run(part, work, part.method)
    work.after_chunk = deciding
    for part in job.parts:
        decide_failures(part, work, part.method)
    work.after_chunk = measuring
    errors = keep_tolerance(job, work) if twice else None
    found = results(job, errors, work)
    numbers = np.concatenate([grid.first_cell(tiles[i]) + np.arange(grid.part(tiles[i]).size) for i in batch])
    again = verify(config, numbers, found, work) if config.verify else {}
    seconds = (time.perf_counter() - began) / len(batch)
    for i, arrays in zip(batch, job.by_grid(found), strict=True):
        yield Done(i, arrays | _inside(grid, tiles[i], again), seconds, cpu)


def _ended(job: Plan) -> int:
    """The number of cells that have ended."""
    return sum(int((part.status != RUNNING).sum()) for part in job.parts)


def _failed(job: Plan) -> int:
    """The number of cells that have failed."""
    return sum(int(part.failed.sum()) for part in job.parts)


def _inside(grid: Grid, tile: Tile, again: Mapping[str, Array]) -> dict[str, Array]:
    """Of the cells that were run again, those of a tile."""
    if not again:
        return {}
    number = again["verified_cell"] - grid.first_cell(tile)
    inside = (number >= 0) & (number < grid.part(tile).size)
    return {name: values[inside] for name, values in again.items()}


def batches(
    grid: Grid, tiles: Sequence[Tile], todo: Sequence[int], store: Store
) -> Iterator[tuple[list[int], Running | None]]:
    """The tiles to run together, out of `todo`: first those whose images `store` has, along with these."""
    left = store.load_running()
    if left and set(left.tiles) <= set(todo):
        yield left.tiles, left
        todo = [i for i in todo if i not in left.tiles]
    batch: list[int] = []
    cells = 0
    for i in todo:
        size = grid.part(tiles[i]).size
        if batch and cells + size > BATCH:
            yield batch, None
            batch, cells = [], 0
        batch.append(i)
        cells += size
    if batch:
        yield batch, None


def _evaluate(config: Config, grid: Grid) -> dict[str, Array]:
    """The results of a model that is a formula."""
    arrays = dataset.predicted(predict(config.tier, grid))
    arrays["status"] = np.full(grid.size, SETTLED)
    if "reversals" in config.measure:
        arrays["reversals"] = arrays["reversals_predicted"]
    return arrays
