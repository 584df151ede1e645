"""config → grid → model → kernel → executor → store → plots."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from sweep.config import Config, ConfigError, Fault, load_config
from sweep.engine import local
from sweep.engine.cluster import Cluster
from sweep.engine.local import Done
from sweep.engine.refined import Refined
from sweep.engine.whole import Whole
from sweep.grid import Array, Grid, Tile
from sweep.kernels.lanes import FAILURES, RUNNING
from sweep.models import MODELS, TIERS
from sweep.models.model import Model
from sweep.prediction import predict as predict_grid
from sweep.results import dataset
from sweep.results.provenance import identify
from sweep.results.store import Checkpoint, Memory, RunFiles, open_dataset

LARGE = 2_000_000
"""Cells of a dataset that is not loaded into memory by itself."""


def tile_size(cells: int) -> int:
    """Cells a tile: what a worker that dies costs, and a chunk of the dataset."""
    return int(np.clip(cells // 32, 1024, 8192))


@dataclass(frozen=True)
class Progress:
    cells: int
    done: int
    failed: int
    done_before: int
    """Of `done`, those that an earlier run left."""
    seconds: float


class Reporter:
    """What a run tells while it goes on; this one keeps silent."""

    def compiling(self) -> None:
        """The kernel has to be compiled first."""

    def chunk(self, progress: Progress) -> None:
        """Another chunk is done."""

    def note(self, message: str) -> None:
        """Something worth a line."""


def run(
    config: Config | str | Path,
    output: str | Path | None = None,
    *,
    fresh: bool = False,
    reporter: Reporter | None = None,
    cluster: Cluster | None = None,
    **overrides: Any,
) -> xr.Dataset:
    """Run a sweep.

    Parameters
    ----------
    config : a configuration or the path of one
    output : folder for the dataset, its maps and, until they are finished, a checkpoint from which
        the same call goes on; by default nothing is written
    fresh : discard what an earlier run left in `output`
    cluster : processes to run the cells in; by default the threads of this one
    overrides : values that replace the file's, such as ``mu=60`` or ``t_end=1000``

    Returns
    -------
    Dataset over the axes of the configuration; every variable carries its meaning as `long_name`.
    One of more than `LARGE` cells with an `output` is not loaded into memory but read when asked.

    Raises
    ------
    ConfigError, StoreError
        where the configuration, or what `output` holds, cannot be used.
    """
    config = as_config(config, overrides)
    reporter = reporter or Reporter()
    if output is None:
        return _compute(config, Memory(), reporter, cluster).dataset()
    files = RunFiles(Path(output), config.name)
    with files.locked():
        if fresh:
            files.discard()
        if files.has_dataset(identify(config)):
            reporter.note(f"{files.dataset}: already complete, nothing to compute")
        else:
            files.picture.unlink(missing_ok=True)  # of a dataset that is gone
            checkpoint = Checkpoint(files.checkpoint, identify(config), reporter.note)
            _compute(config, checkpoint, reporter, cluster).save(files)
        files.discard_checkpoint()
        result = open_dataset(files.dataset, load=Grid.of(config).size <= LARGE)
        draw(result, files, reporter)
    return result


def _compute(
    config: Config, checkpoint: Checkpoint | Memory, reporter: Reporter, cluster: Cluster | None
) -> Whole | Refined:
    # A single cell has no neighbours to infer it from.
    compute = _compute_refined if config.refine and config.axes else _compute_whole
    return compute(config, checkpoint, _Count(reporter), cluster)


def _compute_whole(config: Config, checkpoint: Checkpoint | Memory, count: _Count, cluster: Cluster | None) -> Whole:
    grid = Grid.of(config)
    tiles = grid.tiles(tile_size(grid.size))
    if checkpoint.done or checkpoint.load_running():
        done = f"{len(checkpoint.done)} of {len(tiles)} tiles"
        count.reporter.note(f"{done} are there from an earlier run: going on")
    _run_tiles(config, tiles, checkpoint, count, cluster)
    return Whole(config, grid, tiles, checkpoint)


def _compute_refined(
    config: Config, checkpoint: Checkpoint | Memory, count: _Count, cluster: Cluster | None
) -> Refined:
    if checkpoint.done or checkpoint.load_running():
        count.reporter.note(f"{len(checkpoint.done)} tiles are there from an earlier run: going on")
    refined = Refined(config, checkpoint)
    while refined.grow(tile_size):
        _run_tiles(refined.cases(), refined.tiles, checkpoint, count, cluster)
    return refined


def _run_tiles(
    config: Config, tiles: Sequence[Tile], checkpoint: Checkpoint | Memory, count: _Count, cluster: Cluster | None
) -> None:
    """Run all tiles that `checkpoint` does not have."""
    grid = Grid.of(config)
    todo = [i for i in range(len(tiles)) if i not in checkpoint.done]
    count.expect(grid.size, sum(grid.part(tiles[i]).size for i in todo))
    for done in cluster.run(config, tiles, todo) if cluster else _here(config, tiles, todo, checkpoint, count):
        checkpoint.save(done.tile, done.arrays | {"seconds": np.array(done.seconds), "cpu": np.array(done.cpu)})
        count.tile(done.arrays["status"])


def _here(
    config: Config, tiles: Sequence[Tile], todo: Sequence[int], checkpoint: Checkpoint | Memory, count: _Count
) -> Iterator[Done]:
    for group, left in local.groups(Grid.of(config), tiles, todo, checkpoint):
        yield from local.run_group(
            config,
            tiles,
            group,
            checkpoint=checkpoint,
            left=left,
            compiling=count.reporter.compiling,
            after_chunk=count.chunk,
        )


class _Count:
    """Adds up finished tiles and the chunks of the running ones for the reporter."""

    def __init__(self, reporter: Reporter) -> None:
        self.reporter, self.began = reporter, time.perf_counter()
        self.cells = self.before = self.done = self.failed = 0

    def expect(self, cells: int, todo: int) -> None:
        """Of `cells` in all `todo` are left to do; those done that were not counted here, an earlier run left."""
        there = cells - todo - self.done
        self.cells, self.before, self.done = cells, self.before + there, self.done + there

    def chunk(self, status: Array) -> None:
        done, failed = int((status != RUNNING).sum()), int(np.isin(status, FAILURES).sum())
        self._tell(self.done + done, self.failed + failed)

    def tile(self, status: Array) -> None:
        self.done += len(status)
        self.failed += int(np.isin(status, FAILURES).sum())
        self._tell(self.done, self.failed)

    def _tell(self, done: int, failed: int) -> None:
        seconds = time.perf_counter() - self.began
        self.reporter.chunk(Progress(self.cells, done, failed, self.before, seconds))


def draw(result: xr.Dataset, files: RunFiles, reporter: Reporter) -> None:
    """The maps of a run, beside its dataset, unless they are there."""
    from sweep.plots import maps as plots  # matplotlib: a third of the time that `import sweep` would take

    if files.picture.exists():
        return
    try:
        figure = plots.draw(result)
    except ValueError as error:
        reporter.note(f"no picture: {error}")
        return
    files.save_picture(figure)


def predict(config: Config | str | Path, **overrides: Any) -> xr.Dataset:
    """The predictions alone, of the paper and of the linear theory, on the grid of `config`."""
    config = as_config(config, overrides)
    grid = Grid.of(config)
    return dataset.label(config, grid, dataset.predicted(predict_grid(TIERS[config.model], grid)), {})


def as_config(config: Config | str | Path, overrides: dict[str, Any]) -> Config:
    if isinstance(config, Config):
        if overrides:
            raise TypeError("overrides go with a path: a Config is final")
        return config
    return load_config(config, overrides)


def simulated(config: Config) -> Model:
    """The model of `config`; `ConfigError` where its tier is a formula."""
    if config.model not in MODELS:
        message = f"the {config.model} model is not simulated; allowed: {', '.join(MODELS)}"
        raise ConfigError([Fault("config", None, None, ("model",), message)])
    return MODELS[config.model]


def with_dopri5(config: Config) -> Config:
    """`config` with the plain method: what stops between the steps needs one without a history.

    A step fixed for another method would be no step for this one.
    """
    if config.integrator.method == "dopri5":
        return config
    return replace(config, integrator=config.integrator.model_copy(update={"method": "dopri5", "step": "auto"}))
