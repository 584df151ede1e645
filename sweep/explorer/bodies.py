"""Count the reversals of bodies that differ from the dataset's: estimated at once, then simulated."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from sweep.config import Config, Values
from sweep.engine.reporter import Progress
from sweep.engine.run import run
from sweep.explorer.runner import Dropped, Job
from sweep.explorer.setup import Setup
from sweep.explorer.slices import Source
from sweep.explorer.state import Cell, State
from sweep.grid import Array
from sweep.jit import all_threads
from sweep.kernels import measures
from sweep.kernels.status import IMPOSSIBLE, SETTLED
from sweep.models.model import Offer, take
from sweep.plots import labels
from sweep.prediction import estimates

COUNT = "reversals_estimated"
"""The variable of the maps, until it is simulated everywhere."""

_MOST = 64
"""Largest number of values along an axis; on a longer one, every second or third … value represents its neighbours."""

_COARSE, _SPREADS = 4, (4, 2, 1)
"""The first map has every fourth value along each axis; simulated cells fill a map in this order."""

_REST = 0.3
"""Seconds for which the sliders must rest before cells are simulated, which slows the page."""

_TOGETHER = 256
"""Cells that are simulated together; between them the page's trajectories go on."""


@dataclass(frozen=True, eq=False)
class Counts:
    """A map of counts."""

    dataset: xr.Dataset
    whole: bool
    """Whether all are simulated."""

    def values_at(self, index: Mapping[str, int]) -> dict[str, str]:
        """The count of a cell, in words."""
        cell = self.dataset[COUNT].isel({str(name): index[str(name)] for name in self.dataset[COUNT].dims})
        return {"spin reversals": str(int(cell))}


@dataclass(eq=False, kw_only=True)
class Body(Job):
    """The counts of the map of a state whose parameters `changed` differ from the dataset's (`cell`)."""

    source: Source
    state: State

    def counts_for(self, state: State) -> bool:
        """Return whether the map of `state` has the same cells."""
        names = ("x", "y", "at", "changed")
        return all(getattr(self.state, name) == getattr(state, name) for name in names)

    def chunk(self, progress: Progress) -> None:  # noqa: ARG002  of the cells that are simulated together
        """End the run by `Dropped` if it is no longer needed."""
        if self.dropped:
            raise Dropped

    def begin(self, setup: Setup) -> Iterator[Counts]:
        return counts(setup, self.source, self.state, self)


def can_change(setup: Setup | None, source: Source) -> Cell:
    """Return the parameters that sliders can change, with the dataset's values; none if its model has no two modes.

    They are constant in the dataset, and not zero, which gives a slider no scale.
    """
    if not setup or Offer.ENDING not in setup.config.equations.offers or not set(source.dims) <= set(setup.base):
        return {}
    return {name: value for name, value in setup.base.items() if name not in source.dims and value}


def counts(setup: Setup, source: Source, state: State, job: Job | None = None) -> Iterator[Counts]:
    """Yield the map of counts of a state: of few cells and of all as estimated, then with ever more simulated ones."""
    axes = {name: source.axes[name].values for name in (state.y, state.x) if name}
    every = {name: -(-len(values) // _MOST) for name, values in axes.items()}
    taken = np.meshgrid(*(values[:: every[name]] for name, values in axes.items()), indexing="ij")
    shape = taken[0].shape
    fixed = {**setup.base, **source.parameters_at(tuple(setup.base), state.at), **state.changed}
    given = {name: np.full(taken[0].size, value) for name, value in fixed.items()}
    given |= {name: values.ravel() for name, values in zip(axes, taken, strict=True)}
    columns = setup.config.assembly.body(given)
    place = np.arange(taken[0].size).reshape(shape)
    possible = ~setup.config.tier.impossible(columns)
    status = np.where(possible, SETTLED, IMPOSSIBLE)
    found, simulated = np.zeros(status.shape, "int16"), np.zeros(status.shape, bool)

    def labelled() -> Counts:
        whole = np.ix_(*(np.arange(len(values)) // every[name] for name, values in axes.items()))
        arrays = {COUNT: found, "status": status.astype("int8")}
        known = {name: ([*axes], values.reshape(shape)[whole]) for name, values in arrays.items()}
        dataset = xr.Dataset(known, {**fixed, **{name: source.dataset[name] for name in axes}})
        share = float(simulated.sum() / possible.sum()) if possible.any() else 1.0
        if job:
            job.share = share
        dataset[COUNT].attrs["long_name"] = f"spin reversals, {_words(share)}, {changes(source, state.changed)}"
        return Counts(dataset, share == 1.0)

    for spread in (_COARSE, 1):
        some = place[tuple(slice(None, None, spread) for _ in shape)]
        theirs = take(columns, some.ravel())
        with all_threads():
            values = estimates(setup.config.equations, theirs, check=False)[COUNT].reshape(some.shape)
        found[place] = values[np.ix_(*(np.arange(n) // spread for n in shape))]
        yield (last := labelled())
    yield from _resting(last)
    for spread in _SPREADS:
        some = place[tuple(slice(None, None, spread) for _ in shape)].ravel()
        some = some[possible[some] & ~simulated[some]]
        for begin in range(0, len(some), _TOGETHER):
            cells = some[begin : begin + _TOGETHER]
            theirs = take(given, cells)
            with all_threads():
                result = run(_of_cells(setup.config, theirs, tuple(axes)), reporter=job)
            found[cells], status[cells], simulated[cells] = result["reversals"], result["status"], True
            yield labelled()


def _resting(last: Counts) -> Iterator[Counts]:
    began = time.monotonic()
    while time.monotonic() < began + _REST:
        time.sleep(_REST / 10)
        yield last


def changes(source: Source, changed: Cell) -> str:
    """Say which parameters are not the dataset's."""
    return ", ".join(labels.measured(source.dataset, name, value) for name, value in changed.items())


def _words(share: float) -> str:
    return "simulated" if share == 1.0 else f"estimated, {share:.0%} simulated" if share else "estimated"


def _of_cells(config: Config, columns: Mapping[str, Array], axes: tuple[str, ...]) -> Config:
    """Return the configuration of these cells, whose run estimates no errors and uses the usual kernel."""
    cases = {name: tuple(columns[name].tolist()) for name in axes}
    one = {name: Values.one(float(values[0])) for name, values in columns.items() if name not in axes}
    integrator = config.integrator.model_copy(update={"estimate_errors": False})
    plain = replace(config, measure=measures.default(config.equations), picture=(), samples=None)
    return replace(plain, parameters=one, cases=cases, integrator=integrator)
