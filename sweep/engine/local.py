"""Runs tiles in this process, on all its threads; a worker of a cluster runs its tiles this way too."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sweep.config import Config
from sweep.engine import executor, verification
from sweep.engine.plan import plan, pool
from sweep.engine.repeats import repeat_all
from sweep.engine.sensitivity import runs_asked_for, sensitivity
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


def run(
    config: Config,
    tiles: Sequence[Tile],
    todo: Sequence[int],
    store: Store,
    *,
    after_chunk: Callable[[Array], None],
) -> Iterator[Done]:
    """Run the tiles `todo`, batch by batch, and yield them as they are finished.

    Parameters
    ----------
    store : keeps the images between chunks; those it has of an earlier run are continued first
    after_chunk : called with the statuses of the cells at work
    """
    grid = Grid.of(config)
    for batch, left in _batches(grid, tiles, todo, store):
        yield from run_batch(config, tiles, batch, store=store, left=left, after_chunk=after_chunk)


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
    plans, tables = pool(plan(config, grid.part(tiles[i])) for i in batch)
    for kernel, _ in tables.values():
        kernel.compile()
    images, began = {method: table for method, (_, table) in tables.items()}, time.perf_counter()
    if left and {m: t.shape for m, t in left.tables.items()} == {m: t.shape for m, t in images.items()}:
        for method, table in left.tables.items():
            images[method][:] = table
        began -= left.seconds

    def statuses() -> Array:
        return np.concatenate([kernel.table(table)["status"] for kernel, table in tables.values()])

    def chunk() -> None:
        # Images are saved only here, between two chunks: anywhere else an interrupt may find half of them advanced.
        if store:
            store.save_running(Running(list(batch), images, time.perf_counter() - began))
        # What looks like a failure is decided only after all cells have ended.
        status = statuses()
        after_chunk(np.where(np.isin(status, FAILURES), RUNNING, status))

    for kernel, table in tables.values():
        settle = config.integrator.stop_when_settled
        executor.execute(kernel, table, stop_when_settled=settle, after_chunk=chunk)
    # Not saved: a run that is killed here goes on from the ends of the first runs.
    repeat_all(plans, tables, lambda: after_chunk(statuses()))
    seconds = (time.perf_counter() - began) / len(batch)
    results = [job.results() for job in plans]
    again = _verified(config, grid, [tiles[i] for i in batch], results, lambda: after_chunk(statuses()))
    for i, job, first, second in zip(batch, plans, results, again, strict=True):
        arrays = first | second
        if runs_asked_for(job):
            arrays |= sensitivity(job, lambda: after_chunk(statuses()))
        yield Done(i, arrays, seconds, cpu)


def _batches(
    grid: Grid, tiles: Sequence[Tile], todo: Sequence[int], store: Store
) -> Iterator[tuple[list[int], Running | None]]:
    """The tiles to run together: first those whose images the store has, along with these."""
    waiting = list(todo)
    left = store.load_running()
    if left and set(left.tiles) <= set(waiting):
        yield left.tiles, left
        waiting = [i for i in waiting if i not in left.tiles]
    batch: list[int] = []
    cells = 0
    for i in waiting:
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


def _verified(
    config: Config,
    grid: Grid,
    tiles: Sequence[Tile],
    results: Sequence[Mapping[str, Array]],
    after_chunk: Callable[[], None],
) -> list[dict[str, Array]]:
    """For each tile, whose first run has these `results`, what those of its cells give that are run again."""
    if not config.verify:
        return [{} for _ in tiles]
    drawn, inside = verification.draw(grid.size, config.verify), []
    for tile, first in zip(tiles, results, strict=True):
        cells = drawn - grid.first_cell(tile)
        inside.append(verification.sound(cells[(cells >= 0) & (cells < len(first["status"]))], first))

    def pooled(arrays: Sequence[Mapping[str, Array]], names: Iterable[str]) -> dict[str, Array]:
        return {n: np.concatenate([a[n][cells] for a, cells in zip(arrays, inside, strict=True)]) for n in names}

    columns = [grid.part(tile).columns() for tile in tiles]
    compared = [name for name in verification.COMPARED if name in results[0]]
    again = verification.verify(config, pooled(columns, columns[0]), pooled(results, compared), after_chunk)
    ends = np.cumsum([len(cells) for cells in inside])
    return [
        {"verified_cell": cells + grid.first_cell(tile)}
        | {name: values[end - len(cells) : end] for name, values in again.items()}
        for tile, cells, end in zip(tiles, inside, ends, strict=True)
    ]
