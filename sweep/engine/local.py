"""Runs tiles in this process, on all its threads; a worker of a cluster runs its tiles this way too."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sweep.config import Config
from sweep.engine import executor, verification
from sweep.engine.plan import Plan, plan, pool
from sweep.engine.repeats import repeat_all
from sweep.engine.sensitivity import runs_asked_for, sensitivity
from sweep.grid import Array, Grid, Tile
from sweep.kernels.status import FAILURES, RUNNING, SETTLED
from sweep.models import MODELS, TIERS
from sweep.prediction import predict
from sweep.results import dataset
from sweep.results.provenance import this_cpu
from sweep.results.store import Running, Store

GROUP = 32_768
"""Cells simulated together (50 MB of images).  Lanes idle only at the end of such a group of tiles."""


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
    """Run the tiles `todo`, group by group, and yield them as they are finished.

    Parameters
    ----------
    store : keeps the images between chunks; those it has of an earlier run are continued first
    after_chunk : called with the statuses of the cells at work
    """
    grid = Grid.of(config)
    for group, left in _groups(grid, tiles, todo, store):
        yield from run_group(config, tiles, group, store=store, left=left, after_chunk=after_chunk)


def run_group(
    config: Config,
    tiles: Sequence[Tile],
    group: Sequence[int],
    *,
    store: Store | None = None,
    left: Running | None = None,
    after_chunk: Callable[[Array], None] = lambda status: None,  # noqa: ARG005
) -> Iterator[Done]:
    """Run the tiles `group` together.

    Parameters
    ----------
    store : keeps the images after each chunk
    left : the images of this group that an earlier run left, to be continued
    after_chunk : called with the statuses of the group's cells
    """
    grid, cpu = Grid.of(config), this_cpu()
    if config.model not in MODELS:
        for i in group:
            yield Done(i, _evaluate(config, grid.part(tiles[i])), 0.0, cpu)
        return
    plans, tables = pool(plan(config, grid.part(tiles[i])) for i in group)
    for kernel, _ in tables.values():
        kernel.compile()
    images, began = {method: table for method, (_, table) in tables.items()}, time.perf_counter()
    if left and {m: t.shape for m, t in left.tables.items()} == {m: t.shape for m, t in images.items()}:
        for method, table in left.tables.items():
            images[method][:] = table
        began -= left.seconds

    def statuses() -> Array:
        return np.concatenate([table[:, kernel.row("status")] for kernel, table in tables.values()])

    def chunk() -> None:
        # Images are saved only here, between two chunks: anywhere else an interrupt may find half of them advanced.
        if store:
            store.save_running(Running(list(group), images, time.perf_counter() - began))
        # What looks like a failure is decided only after all cells have ended.
        status = statuses()
        after_chunk(np.where(np.isin(status, FAILURES), RUNNING, status))

    for kernel, table in tables.values():
        settle = config.integrator.stop_when_settled
        executor.execute(kernel, table, stop_when_settled=settle, after_chunk=chunk)
    # Not saved: a run that is killed here goes on from the ends of the first runs.
    repeat_all(plans, tables, lambda: after_chunk(statuses()))
    seconds = (time.perf_counter() - began) / len(group)
    again = _verified(config, grid, plans, [grid.first_cell(tiles[i]) for i in group], lambda: after_chunk(statuses()))
    for i, job, verified in zip(group, plans, again, strict=True):
        arrays = job.results() | verified
        if runs_asked_for(job):
            arrays |= sensitivity(job, lambda: after_chunk(statuses()))
        yield Done(i, arrays, seconds, cpu)


def _groups(
    grid: Grid, tiles: Sequence[Tile], todo: Sequence[int], store: Store
) -> Iterator[tuple[list[int], Running | None]]:
    """The tiles to run together: first those whose images the store has, along with these."""
    waiting = list(todo)
    left = store.load_running()
    if left and set(left.tiles) <= set(waiting):
        yield left.tiles, left
        waiting = [i for i in waiting if i not in left.tiles]
    group: list[int] = []
    cells = 0
    for i in waiting:
        size = grid.part(tiles[i]).size
        if group and cells + size > GROUP:
            yield group, None
            group, cells = [], 0
        group.append(i)
        cells += size
    if group:
        yield group, None


def _evaluate(config: Config, grid: Grid) -> dict[str, Array]:
    """The results of a model that is a formula."""
    arrays = dataset.predicted(predict(TIERS[config.model], grid))
    arrays["status"] = np.full(grid.size, SETTLED)
    if "reversals" in config.measure:
        arrays["reversals"] = arrays["reversals_predicted"]
    return arrays


def _verified(
    config: Config, grid: Grid, jobs: Sequence[Plan], first: Sequence[int], after_chunk: Callable[[], None]
) -> list[dict[str, Array]]:
    """For each job, what its cells that are run again give; `first` are the indices of their first cells in `grid`."""
    if not config.verify:
        return [{} for _ in jobs]
    drawn = [verification.draw(grid.size, config.verify) - begin for begin in first]
    inside = [cells[(cells >= 0) & (cells < job.grid.size)] for cells, job in zip(drawn, jobs, strict=True)]
    again = verification.verify(jobs, inside, after_chunk)
    for begin, arrays in zip(first, again, strict=True):
        arrays["verified_cell"] = arrays["verified_cell"] + begin
    return again
