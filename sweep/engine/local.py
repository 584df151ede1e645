"""Runs tiles in this process, on all its threads; a worker of a cluster runs its tiles this way too."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sweep.config import Config
from sweep.engine import executor
from sweep.engine.checks import sensitivity, verify
from sweep.engine.plan import plan
from sweep.engine.repeats import repeat_all
from sweep.grid import Array, Grid, Tile
from sweep.interrupt import point
from sweep.kernels.status import FAILURES, RUNNING, SETTLED
from sweep.prediction import predict
from sweep.results import dataset
from sweep.results.provenance import this_cpu
from sweep.results.store import Running, Store

BATCH = 32_768
"""Cells simulated together (50 MB of images).  Lanes idle only at the end of such a batch of tiles."""


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
    after_chunk: Callable[[Array], None] = lambda status: None,  # noqa: ARG005
) -> Iterator[Done]:
    """Run the tiles `batch` together.

    Parameters
    ----------
    store : keeps the images after each chunk
    left : the images of this batch that an earlier run left, to be continued
    after_chunk : called with the statuses of the batch's cells
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
    images, began = {part.method: part.images for part in job.parts}, time.perf_counter()
    if left and {m: t.shape for m, t in left.tables.items()} == {m: t.shape for m, t in images.items()}:
        for method, table in left.tables.items():
            images[method][:] = table
        began -= left.seconds

    def report() -> None:
        after_chunk(np.concatenate([part.status for part in job.parts]))

    def chunk() -> None:
        # Images are saved only here, between two chunks: anywhere else an interrupt may find half of them advanced.
        if store:
            store.save_running(Running(list(batch), images, time.perf_counter() - began))
        # What looks like a failure is decided only after all cells have ended.
        status = np.concatenate([part.status for part in job.parts])
        after_chunk(np.where(np.isin(status, FAILURES), RUNNING, status))

    for part in job.parts:
        settle = config.integrator.stop_when_settled
        executor.execute(part.kernel, part.images, stop_when_settled=settle, after_chunk=chunk)
    # Not saved: a run that is killed here goes on from the ends of the first runs.
    repeat_all(job, report)
    found = job.results() | sensitivity(job, report)
    numbers = np.concatenate([grid.first_cell(tiles[i]) + np.arange(grid.part(tiles[i]).size) for i in batch])
    again = verify(config, numbers, found, report) if config.verify else {}
    seconds = (time.perf_counter() - began) / len(batch)
    for i, arrays in zip(batch, job.by_grid(found), strict=True):
        yield Done(i, arrays | _inside(grid, tiles[i], again), seconds, cpu)


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
