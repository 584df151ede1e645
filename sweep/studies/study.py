"""Keeps the results of a study in a folder, as a run does: with a checkpoint, a dataset and a picture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import xarray as xr

from sweep.config import Config
from sweep.engine.cluster import connected
from sweep.engine.reporter import Reporter
from sweep.engine.run import carry_out
from sweep.engine.whole import Whole
from sweep.interrupt import deferred
from sweep.models.user.blame import blamed
from sweep.results import netcdf
from sweep.results.checkpoint import Checkpoint
from sweep.results.folder import RunFiles
from sweep.results.identity import require_same
from sweep.results.kind import ATTRIBUTE
from sweep.results.provenance import identify
from sweep.results.store import Store

if TYPE_CHECKING:
    from distributed import Client


class Task(NamedTuple):
    """The description of a study to carry out."""

    config: Config
    verb: str
    """Its command, which names its files and its module in `sweep.studies`."""
    settings: str
    """Its own settings, as text."""
    make: Callable[[Config, Store], Whole]


@deferred()
def run_study(
    task: Task, output: str | Path | None, *, fresh: bool, reporter: Reporter, client: Client | str | None
) -> xr.Dataset:
    """Return the dataset of a study, computed now or left in the folder `output` by an earlier identical one."""
    config, verb, settings, make = task
    run = identify(config)
    identity = replace(run, config=f"{run.config}# {settings}\n", config_hash=f"{run.config_hash}-{settings}")

    def search(store: Store, there: Client | None) -> xr.Dataset:
        with blamed(config.origin):
            found = make(config, store)
        carry_out(found, store, reporter, there)
        return found.dataset().assign_attrs({ATTRIBUTE: verb, **vars(identity)})

    if output is None:
        with connected(client) as there:
            return search(Store(), there)
    files = RunFiles(Path(output), f"{config.name}_{verb}")
    with files.locked(), connected(client) as there:
        if fresh:
            files.discard()
        if found := files.identity():
            require_same(files.dataset, found, identity)
            reporter.note(f"{files.dataset}: already complete, nothing to compute")
        else:
            files.picture.unlink(missing_ok=True)  # its dataset is gone
            store = Checkpoint(files.checkpoint, identity, reporter.note)
            netcdf.write(files.dataset, search(store, there))
        files.discard_checkpoint()
        result = netcdf.open_dataset(files.dataset)
        if not files.picture.exists():
            from sweep.plots import picture  # importing matplotlib takes a third of the time of `import sweep`

            picture.plot(result, output=files.picture)
    return result
