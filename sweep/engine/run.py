"""config → grid → model → kernel → executor → store → plots.

The configuration defines the grid of cells, and the grid is cut into tiles.  For each tile `engine.plan` chooses model,
kernel and steps, and `engine.executor` advances its trajectories to their ends: in this process (`engine.local`) or in
others (`engine.cluster`).  A store keeps the finished tiles.  `engine.whole` assembles the dataset, or
`engine.enlarged`, which reuses the results of an earlier run, and `plots` draws its maps.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from sweep.config import Config, ConfigLike, load_config
from sweep.engine import local
from sweep.engine.cluster import connected, run_tiles
from sweep.engine.enlarged import Earlier, Enlarged, is_whole, reason_against, taken_over
from sweep.engine.reporter import Count, Reporter
from sweep.engine.whole import Whole
from sweep.faults import FileError, local_path
from sweep.grid import Tile
from sweep.interrupt import deferred, point
from sweep.models.user.blame import blamed
from sweep.plots import quantities
from sweep.plots.attempt import attempt
from sweep.results import dataset
from sweep.results.checkpoint import Checkpoint
from sweep.results.folder import RunFiles
from sweep.results.netcdf import open_dataset
from sweep.results.provenance import Identity, identify, not_resumed
from sweep.results.store import Running, Store

if TYPE_CHECKING:
    from distributed import Client

LARGE = 2_000_000
"""Most cells of a dataset that is loaded into memory."""


@deferred()
def run(
    config: ConfigLike,
    output: str | Path | None = None,
    *,
    fresh: bool = False,
    reporter: Reporter | None = None,
    client: Client | str | None = None,
    **overrides: Any,
) -> xr.Dataset:
    """Run as `sweep.api.run`; messages go to `reporter` only."""
    config = load_config(config, overrides)
    dataset.check_names(config)
    quantities.check_pictures(config)
    reporter = reporter or Reporter()
    if output is None:
        with connected(client) as there:
            return _compute(config, Store(), reporter, there).dataset()
    files, identity = RunFiles(local_path(output), config.name, config.picture), identify(config)
    with files.locked(reporter.note), connected(client) as there:
        if fresh:
            _forget_pictures(config, files)
            files.discard()
        found = files.identity()
        if found and not found.difference(identity) and is_whole(config, files.dataset):
            reporter.note(f"{files.dataset}: already complete, nothing to compute")
        else:
            earlier = _earlier(config, found, identity, files)
            _forget_pictures(config, files)
            store = Checkpoint(files.checkpoint, identity, reporter.note)
            _compute(config, store, reporter, there, earlier).save(files.dataset)
        files.discard_checkpoint()
        point()
        result = files.opened(files.dataset, load=config.grid.size <= LARGE)
        _draw(config.picture, result, files, reporter)
    return result


def _forget_pictures(config: Config, files: RunFiles) -> None:
    """Remove the pictures of an existing or former dataset: they would be taken for those of the next one."""
    named = files.pictures(config.picture)
    with suppress(FileError), open_dataset(files.dataset, load=False) as there:
        named |= files.pictures(quantities.pictured(there))
    for path in named:
        path.unlink(missing_ok=True)


def _earlier(config: Config, found: Identity | None, identity: Identity, files: RunFiles) -> Earlier | None:
    """Read the cells of `config` from an earlier dataset, there now or when an interrupted run began.

    `found` is the identity of the existing dataset.

    Raises
    ------
    FileError
        if results of that dataset would be lost.
    """
    if found:
        there = files.opened(files.dataset)
        if reason := reason_against(config, found, identity, there):
            raise not_resumed(files.dataset, reason)
        files.keep_earlier()
    elif files.earlier.exists():
        there = files.opened(files.earlier)
    else:
        return None
    return taken_over(config, there)


def _compute(
    config: Config, store: Store, reporter: Reporter, client: Client | None, earlier: Earlier | None = None
) -> Whole:
    if earlier:
        reporter.note(earlier.words)
        result: Whole = Enlarged(config, store, earlier)
    else:
        result = Whole(config, store)
    carry_out(result, store, reporter, client)
    return result


def carry_out(result: Whole, store: Store, reporter: Reporter, client: Client | None) -> None:
    """Run the tiles of `result` that `store` does not have, until it asks for no more."""
    count, running = Count(reporter), store.load_running()
    with blamed(result.config.origin):
        while result.grow():
            if not count.cells and (store.done or running):
                reporter.note(_kept(result, store, running))
            _run_tiles(result.simulated(), result.tiles, store, count, client)


def _kept(result: Whole, store: Store, running: Running | None) -> str:
    """Say how far an earlier run got."""
    grid = result.simulated().grid
    finished = sum(grid.part(tile).size for i, tile in enumerate(result.tiles) if i in store.done)
    started = sum(len(table) for name, table in running.tables.items() if name.endswith("rows")) if running else 0
    more = f", {started} under way" if running else ""
    return f"resuming an earlier run: {finished} of {grid.size} cells finished{more}"


def _run_tiles(config: Config, tiles: Sequence[Tile], store: Store, count: Count, client: Client | None) -> None:
    """Run the tiles that `store` does not have yet."""
    grid = config.grid
    todo = [i for i in range(len(tiles)) if i not in store.done]
    count.expect(grid.size, sum(grid.part(tiles[i]).size for i in todo))
    here = (
        done
        for batch, left in local.batches(grid, tiles, todo, store)
        for done in local.run_batch(config, tiles, batch, store=store, left=left, after_chunk=count.chunk)
    )
    for tile, arrays in run_tiles(client, config, tiles, todo) if client else here:
        store.save(tile, arrays)
        count.tile(arrays["status"])


def _draw(variables: Sequence[str], result: xr.Dataset, files: RunFiles, reporter: Reporter) -> None:
    """Draw the pictures of a run next to its dataset, unless they exist."""
    others = quantities.pictured(result) != [*variables]  # newer than the dataset
    for path, variable in files.pictures(variables).items():
        if others or not path.exists():
            attempt(result, path, reporter.note, variable)
