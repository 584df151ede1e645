"""Carries out studies: in rounds of simulations, and in a folder with a checkpoint, a dataset and a picture, as a run.

The cells of a search, whose rounds depend on the results of earlier ones, form a growing table of cases, so that a
search is checkpointed, interrupted, and spread over a cluster like a run.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr

from sweep.config import Config
from sweep.config.document import is_number, plain_data
from sweep.engine.cluster import connected
from sweep.engine.errors import ROUND_OFF
from sweep.engine.reporter import Reporter
from sweep.engine.run import carry_out
from sweep.engine.whole import Whole
from sweep.faults import either, fault_of, local_path, quote
from sweep.grid import Array
from sweep.interrupt import deferred
from sweep.kernels.measures import default
from sweep.models import MODELS
from sweep.models.user.blame import blamed
from sweep.plots.attempt import attempt
from sweep.results import netcdf
from sweep.results.checkpoint import Checkpoint
from sweep.results.folder import RunFiles
from sweep.results.kind import ATTRIBUTE
from sweep.results.provenance import identify, require_same
from sweep.results.store import Store

if TYPE_CHECKING:
    from distributed import Client

# What a search needs to know of a cell, if its model supports it.
_NEEDED = ("reversals", "margin")

# Tolerance while brackets are narrowed, relative to the intended width: near a boundary a spin is that small.
_FINER = 1e-4


def measuring(config: Config) -> Config:
    """Return `config` with the measurements that a search needs; margins are those of cells that settle.

    Next to a boundary many cells exceed the tolerance however short the steps are, so none is repeated. Other default
    measurements stay, so that both share one kernel, which takes longer to compile than a search.
    """
    usual = default(config.equations)
    measure = tuple(spec for spec in usual if spec in _NEEDED or spec in config.measure)
    integrator = config.integrator.model_copy(update={"stop_early": config.integrator.stop_early or True})
    return replace(config, measure=measure, repeats=False, integrator=integrator)


def require_certain(config: Config) -> None:
    """Raise an `InputError` if the model is not simulated, or a parameter is a distribution."""
    require_simulated(config)
    for name in config.distributions:
        raise config.error(name, "is a distribution, which only run can sample; give a number or an axis here")


def require_simulated(config: Config) -> None:
    """Raise an `InputError` if the model is not simulated."""
    if not config.simulated:
        raise config.error(("model",), f"the {config.model} model is not simulated; choose {either(MODELS)}")


def require_between(option: str, value: float, ends: tuple[float, float]) -> None:
    """Raise an `InputError` if the value of an option is not between these."""
    if not (is_number(plain_data(value)) and ends[0] <= value <= ends[1]):
        raise fault_of(f"must be between {ends[0]:g} and {ends[1]:g}, not {quote(value)}", option)


class Search(Whole):
    """A search, and the table of the cells that it has requested; its dataset holds the results."""

    def __init__(self, config: Config, store: Store, width: float) -> None:
        """Make a search whose brackets are narrowed to `width`, relative to a parameter."""
        super().__init__(config, store)
        self.width = width
        self.rounds: list[Mapping[str, Array]] = []
        """Names of the parameters that vary, in the cells of each round."""
        self.tolerance = config.integrator.tolerance_number
        """Tolerance of the cells requested last."""
        self.estimates = False
        """Whether their errors are estimated."""
        self._learned = 0
        """Tiles that have been evaluated."""

    @abstractmethod
    def estimate(self) -> str:
        """Describe cells, steps, memory and time of the first round, and the rounds that follow, a line each."""

    @abstractmethod
    def ask(self) -> Mapping[str, Array]:
        """Return the parameters of the cells to simulate next, each of shape (cells,), in an order that never
        changes."""

    @abstractmethod
    def learn(self, found: Mapping[str, Array]) -> None:
        """Record the results of the cells requested last: `status`, `reversals`, margins ..."""

    def simulated(self) -> Config:
        """Return the configuration whose cases are all cells so far."""
        cases = {n: tuple(np.concatenate([each[n] for each in self.rounds]).tolist()) for n in self.rounds[0]}
        constants = {name: values for name, values in self.config.parameters.items() if name not in cases}
        update = {"tolerance": self.tolerance, "estimate_errors": self.estimates}
        integrator = self.config.integrator.model_copy(update=update)
        return replace(self.config, parameters=constants, cases=cases, integrator=integrator)

    def grow(self) -> bool:
        """Add the cells to simulate next, judging by all results so far; return False if the search has ended."""
        if self.tiles:
            new = [self.store.load(i) for i in range(self._learned, len(self.tiles))]
            self._learned = len(self.tiles)
            of_cells = [name for name, values in new[0].items() if values.ndim]
            self.learn({name: np.concatenate([tile[name] for tile in new]) for name in of_cells})
        asked = self.ask()
        cells = len(next(iter(asked.values())))
        if cells:
            self.rounds.append(asked)
        return self._cut(cells)

    def sharp(self, width: float) -> float:
        """Return the tolerance with which brackets are narrowed to a width."""
        return min(self.config.integrator.tolerance_number, max(_FINER * width, ROUND_OFF))

    def attributes(self) -> dict[str, Any]:
        """Return the attributes of a dataset: its accuracy, provenance and cost."""
        simulations = self.tiles[-1][0].stop if self.tiles else 0
        exact = {"relative_width": self.width, "bracket_tolerance": self.sharp(self.width), "trajectories": simulations}
        return exact | self._attributes(simulations)


class Task(NamedTuple):
    """The description of a study to carry out."""

    config: Config
    verb: str
    """Its command, which names its files and its module in `sweep.studies`."""
    settings: str
    """Its own settings, as text."""
    make: Callable[[Config, Store], Search]

    def estimate(self) -> str:
        """Describe the cost of the first round, and the rounds that follow, before anything is computed."""
        return self.make(self.config, Store()).estimate()

    @deferred()
    def run(
        self, output: str | Path | None, *, fresh: bool, reporter: Reporter, client: Client | str | None
    ) -> xr.Dataset:
        """Return the dataset of the study, computed now or left in the folder `output` by an earlier identical one."""
        config, verb, settings, make = self
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
        files = RunFiles(local_path(output), f"{config.name}_{verb}")
        with files.locked(reporter.note), connected(client) as there:
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
                attempt(result, files.picture, reporter.note)
        return result
