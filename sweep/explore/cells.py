"""Trajectories of single cells, run in a thread of their own while the page stays responsive."""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import xarray as xr

from sweep.config import Config, ConfigError, Values
from sweep.config.faults import printable
from sweep.engine.reporter import Progress, Reporter
from sweep.explore.setup import Setup
from sweep.explore.state import Cell
from sweep.grid import Array
from sweep.jit import showing
from sweep.kernels import measures
from sweep.plots.trajectories import reversal_times
from sweep.studies.trajectory import trajectory

SAMPLES = 60_000
"""Samples of a trajectory at most, about: more are no longer drawn fluently."""

COMPILING = "compiling the simulation for this machine; later runs find it in the cache"

_KEPT = 64
"""Trajectories that are remembered."""

_TELL_EVERY = 0.1
"""Seconds between two reports of progress."""


@dataclass(frozen=True)
class Curve:
    """A trajectory that was run."""

    cell: Cell
    dataset: xr.Dataset
    """As `sweep.trajectory` gives it, without the dimension `trajectory`."""
    reversals: Array
    """Times of the reversals, in sqrt(c/g)."""
    seconds: float
    """What it took."""


@dataclass(frozen=True)
class News:
    """What a run has to tell: how far it is, or its end."""

    share: float = 0.0
    note: str = ""
    curve: Curve | None = None
    fault: str = ""


Tell = Callable[[News], None]


def single(config: Config, cell: Cell) -> Config:
    """`config` with the parameters of one cell, and the usual measurements, which tell spin and energies."""
    parameters = {name: Values((value,), False, value) for name, value in cell.items()}
    return replace(config, parameters=parameters, measure=measures.default(config.equations))


def run(setup: Setup, cell: Cell, reporter: Reporter | None = None) -> Curve:
    """Run the trajectory of a cell, sampled as densely as `SAMPLES` allow."""
    began = time.perf_counter()
    config = single(setup.config, cell)
    found = trajectory(config, every=_interval(config, reporter), reporter=reporter)
    one = found.isel(trajectory=0)
    return Curve(cell, one, reversal_times(one), time.perf_counter() - began)


def _interval(config: Config, reporter: Reporter | None) -> float | None:
    """The time between samples that keeps a long trajectory to `SAMPLES`; None where the usual one does."""
    if config.integrator.t_end <= SAMPLES / 2:
        return None
    stop = float(trajectory(config, every=config.integrator.t_end, reporter=reporter)["t_stop"][0])
    return None if stop <= SAMPLES / 2 else stop / SAMPLES


class _Superseded(Exception):
    """Nobody waits for this trajectory any more."""


@dataclass
class _Job:
    key: Hashable
    setup: Setup
    cell: Cell
    tell: Tell
    superseded: bool = False


class Runner(Reporter):
    """Runs one trajectory at a time, in the order of the requests; a newer request of the same key replaces the older.

    What a run has to tell goes to the `tell` of its request, on this thread.
    """

    def __init__(self) -> None:
        self._waiting: OrderedDict[Hashable, _Job] = OrderedDict()
        self._known: OrderedDict[Hashable, Curve] = OrderedDict()
        self._job: _Job | None = None
        self._compiles = False
        self._told = 0.0
        self._changed = threading.Condition()
        # Not waited for at the end of the program: a chunk of a kernel cannot be interrupted.
        threading.Thread(target=self._work, daemon=True, name="trajectories").start()

    def submit(self, key: Hashable, setup: Setup, cell: Cell, tell: Tell) -> None:
        """Run the trajectory of `cell` for the curve `key`."""
        with self._changed:
            self._drop(key)
            self._waiting[key] = _Job(key, setup, cell, tell)
            self._changed.notify()
        if self._compiles:
            tell(News(note=COMPILING))

    def warm_up(self, setup: Setup) -> None:
        """Compile the simulation, or load it from the cache, before the first click needs it."""
        self.submit("first", setup, setup.base, lambda _: None)

    def cancel(self, wanted: Callable[[Any], bool]) -> None:
        """Forget the requests whose keys are `wanted`."""
        with self._changed:
            running = [self._job.key] if self._job else []
            for key in [*self._waiting, *running]:
                if wanted(key):
                    self._drop(key)

    def _drop(self, key: Hashable) -> None:
        self._waiting.pop(key, None)
        if self._job and self._job.key == key:
            self._job.superseded = True

    def chunk(self, progress: Progress) -> None:
        """Tell how far the running trajectory is, and end it if nobody waits for it."""
        job = self._job
        if job is None or job.superseded:
            raise _Superseded
        if progress.seconds < _TELL_EVERY or time.perf_counter() - self._told > _TELL_EVERY:
            self._told = time.perf_counter()
            job.tell(News(progress.done / progress.cells))

    def _work(self) -> None:
        with showing(self._compiling):
            while True:
                with self._changed:
                    self._job = None
                    while not self._waiting:
                        self._changed.wait()
                    _, self._job = self._waiting.popitem(last=False)
                self._finish(self._job)

    def _finish(self, job: _Job) -> None:
        try:
            news = News(1.0, curve=self._curve(job))
        except _Superseded:
            return
        except ConfigError as error:
            news = News(fault=error.faults[0].message if error.faults else str(error))
        except Exception as error:  # told on the page: this thread has to go on
            news = News(fault=printable(f"{type(error).__name__}: {error}"))
        if not job.superseded:
            job.tell(news)

    def _curve(self, job: _Job) -> Curve:
        key = tuple(sorted(job.cell.items()))
        if key not in self._known:
            self._known[key] = run(job.setup, job.cell, self)
            if len(self._known) > _KEPT:
                self._known.popitem(last=False)
        return self._known[key]

    @contextmanager
    def _compiling(self) -> Iterator[None]:
        self._compiles = True
        if job := self._job:
            job.tell(News(note=COMPILING))
        try:
            yield
        finally:
            self._compiles = False
