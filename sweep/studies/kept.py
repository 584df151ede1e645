"""Keeps what a search finds in a folder, as a run keeps its results: with a checkpoint, a dataset and a picture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import xarray as xr

from sweep.config import Config
from sweep.engine.reporter import Reporter
from sweep.results import netcdf
from sweep.results.checkpoint import Checkpoint
from sweep.results.folder import RunFiles
from sweep.results.identity import Identity
from sweep.results.memory import Memory
from sweep.results.provenance import identify
from sweep.results.store import Store

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def identified(config: Config, maker: str, settings: str) -> Identity:
    """Identify a search by the module `maker`: as a run, and by its own settings in words."""
    run = identify(config, maker)
    return replace(run, config=f"{run.config}# {settings}\n", config_hash=f"{run.config_hash}-{settings}")


def kept(
    files: RunFiles | None,
    identity: Identity,
    search: Callable[[Store], xr.Dataset],
    draw: Callable[[xr.Dataset], Figure],
    *,
    fresh: bool,
    reporter: Reporter,
) -> xr.Dataset:
    """The dataset that `search` finds, or what an earlier search of the same identity has left in `files`."""
    if files is None:
        return search(Memory())
    with files.locked():
        if fresh:
            files.discard()
        if files.has_dataset(identity):
            reporter.note(f"{files.dataset}: already complete, nothing to compute")
        else:
            files.picture.unlink(missing_ok=True)  # of a dataset that is gone
            netcdf.write(files.dataset, search(Checkpoint(files.checkpoint, identity, reporter.note)))
        files.discard_checkpoint()
        result = netcdf.open_dataset(files.dataset)
        if not files.picture.exists():
            files.save_picture(draw(result))
    return result
