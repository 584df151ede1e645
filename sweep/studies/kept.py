"""Keeps what a study finds in a folder, as a run keeps its results: with a checkpoint, a dataset and a picture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import xarray as xr

from sweep.config import Config
from sweep.config.user_models import explained
from sweep.engine.cluster import Cluster
from sweep.engine.reporter import Reporter
from sweep.engine.run import carry_out
from sweep.results import netcdf
from sweep.results.checkpoint import Checkpoint
from sweep.results.folder import RunFiles
from sweep.results.identity import require_same
from sweep.results.memory import Memory
from sweep.results.provenance import identify
from sweep.results.store import Store
from sweep.studies.search import Study


def kept(
    config: Config,
    maker: str,
    settings: str,
    make: Callable[[Store], Study],
    output: str | Path | None,
    *,
    fresh: bool,
    reporter: Reporter,
    cluster: Cluster | None,
) -> xr.Dataset:
    """The dataset that a search finds, or what an earlier search of the same identity has left in the folder `output`.

    Parameters
    ----------
    maker : module of the search, by which it is identified beside the configuration, and after which files are named
    settings : its own settings, in words
    make : makes the search, by its store
    """
    run = identify(config, maker)
    identity = replace(run, config=f"{run.config}# {settings}\n", config_hash=f"{run.config_hash}-{settings}")

    def search(store: Store) -> xr.Dataset:
        with explained(config.origin):
            found = make(store)
        carry_out(found, store, reporter, cluster)
        return found.labelled().assign_attrs(vars(identity))

    if output is None:
        return search(Memory())
    files = RunFiles(Path(output), f"{config.name}_{maker.rpartition('.')[2]}")
    with files.locked():
        if fresh:
            files.discard()
        if found := files.identity():
            require_same(files.dataset, found, identity)
            reporter.note(f"{files.dataset}: already complete, nothing to compute")
        else:
            files.picture.unlink(missing_ok=True)  # of a dataset that is gone
            netcdf.write(files.dataset, search(Checkpoint(files.checkpoint, identity, reporter.note)))
        files.discard_checkpoint()
        result = netcdf.open_dataset(files.dataset)
        if not files.picture.exists():
            from sweep.plots import picture  # matplotlib takes a third of the time of `import sweep`

            files.save_picture(picture.plot(result))
    return result
