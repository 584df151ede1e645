"""Runs tiles: in this process on all its threads, or as the work of one process of many."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sweep.config import Config
from sweep.engine import executor, verification
from sweep.engine.plan import Plan, plan, pool
from sweep.grid import Array, Grid, Tile
from sweep.kernels.lanes import SETTLED
from sweep.models import MODELS, TIERS
from sweep.prediction import predict
from sweep.results import dataset
from sweep.results.provenance import this_cpu
from sweep.results.store import Checkpoint, Memory

GROUP = 32_768
"""Cells in memory together (50 MB of images); lanes idle at the end of a group alone."""


Running = tuple[list[int], dict[str, Array], float]
"""What `Checkpoint.load_running` finds."""


@dataclass(frozen=True)
class Done:
    """A finished tile."""

    tile: int
    arrays: dict[str, Array]
    seconds: float
    cpu: str


def run_group(
    config: Config,
    tiles: Sequence[Tile],
    group: Sequence[int],
    *,
    checkpoint: Checkpoint | Memory | None = None,
    left: Running | None = None,
    compiling: Callable[[], None] = lambda: None,
    after_chunk: Callable[[Array], None] = lambda status: None,  # noqa: ARG005
) -> Iterator[Done]:
    """Run the tiles of numbers `group` together.

    Parameters
    ----------
    checkpoint : keeps the images after each chunk
    left : what it holds of this group, to go on from
    after_chunk : called with the statuses of the group's cells
    """
    grid, cpu = Grid.of(config), this_cpu()
    if config.model not in MODELS:
        for i in group:
            yield Done(i, _evaluate(config, grid.part(tiles[i])), 0.0, cpu)
        return
    plans, tables = pool(plan(config, grid.part(tiles[i]), compiling) for i in group)
    for kernel, _ in tables.values():
        kernel.compile()
    images, began = {method: table for method, (_, table) in tables.items()}, time.perf_counter()
    if left and {m: t.shape for m, t in left[1].items()} == {m: t.shape for m, t in images.items()}:
        for method, table in left[1].items():
            images[method][:] = table
        began -= left[2]

    def chunk() -> None:
        # Saved here alone, between two chunks: elsewhere an interrupt finds images half moved on.
        if checkpoint:
            checkpoint.save_running(list(group), images, time.perf_counter() - began)
        after_chunk(np.concatenate([table[:, kernel.row("status")] for kernel, table in tables.values()]))

    for kernel, table in tables.values():
        settle = config.integrator.stop_when_settled
        executor.execute(kernel, table, stop_when_settled=settle, after_chunk=chunk)
    seconds = (time.perf_counter() - began) / len(group)
    for i, job in zip(group, plans, strict=True):
        yield Done(i, _results(job, grid, tiles[i]), seconds, cpu)


def groups(
    grid: Grid, tiles: Sequence[Tile], todo: Sequence[int], checkpoint: Checkpoint | Memory
) -> Iterator[tuple[list[int], Running | None]]:
    """Numbers of tiles to run together: first those that the checkpoint has images of, with these."""
    waiting = list(todo)
    left = checkpoint.load_running()
    if left and set(left[0]) <= set(waiting):
        yield left[0], left
        waiting = [i for i in waiting if i not in left[0]]
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
    """Results of a tier that is a formula."""
    arrays = dataset.predicted(predict(TIERS[config.model], grid))
    arrays["status"] = np.full(grid.size, SETTLED)
    if "reversals" in config.measure:
        arrays["reversals"] = arrays["reversals_predicted"]
    return arrays


def _results(job: Plan, grid: Grid, tile: Tile) -> dict[str, Array]:
    arrays = job.results()
    if job.config.verify:
        first = grid.first_cell(tile)
        drawn = verification.draw(grid.size, job.config.verify) - first
        again = verification.verify(job, drawn[(drawn >= 0) & (drawn < job.grid.size)])
        again["verified_cell"] = again["verified_cell"] + first
        arrays |= again
    return arrays
