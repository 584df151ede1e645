"""Runs the trajectories of single cells in a thread of their own, while the page stays responsive."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from queue import SimpleQueue

import xarray as xr

from sweep.config import ConfigError, Values
from sweep.config.faults import printable
from sweep.config.schema import FOREVER
from sweep.engine.reporter import Progress, Reporter
from sweep.explorer.setup import Setup
from sweep.explorer.state import Cell
from sweep.grid import Array
from sweep.jit import showing
from sweep.kernels import measures
from sweep.plots.trajectories import lively_until, reversal_times
from sweep.studies.trajectory import trajectory

LONG = 30_000.0
"""Time in sqrt(c/g) beyond which a trajectory is sampled more coarsely: 200 000 samples of the paper's body.  One
without an end (`t_end: .inf`) ends here."""

COMPILING = "compiling the simulation for this machine; later runs find it in the cache"

_KEPT = 64
"""Trajectories that are remembered."""

_TELL_EVERY = 0.1
"""Seconds between two reports of progress."""


@dataclass(frozen=True)
class Curve:
    """A trajectory that was run."""

    dataset: xr.Dataset
    """As `sweep.trajectory` gives it, without the dimension `trajectory`."""
    reversals: Array
    """Times of the reversals, in the unit of the dataset."""
    seconds: float
    """The time that the run took."""


class Dropped(Exception):
    """Nobody waits for this trajectory any more."""


@dataclass(eq=False)
class Job(Reporter):
    """A trajectory that somebody waits for; `tell` is called with it, on the runner's thread, at all news of it."""

    cell: Cell
    tell: Callable[[Job], None]
    share: float = 0.0
    """The part of the run that is over."""
    delay: str = ""
    """The reason if it does not get on."""
    curve: Curve | None = None
    fault: str = ""
    """The reason if there will be no curve."""
    dropped: bool = False
    """Set by whoever no longer waits: the run is not begun, or ends at its next chunk, and nothing more is told."""
    _told: float = 0.0

    def news(self, delay: str = "") -> None:
        """Tell that something has changed, unless nobody waits."""
        self.delay, self._told = delay, time.perf_counter()
        if not self.dropped:
            self.tell(self)

    def chunk(self, progress: Progress) -> None:
        """Tell how far the run is; ends it by `Dropped` if nobody waits."""
        if self.dropped:
            raise Dropped
        self.share = progress.done / progress.cells
        if time.perf_counter() - self._told > _TELL_EVERY:
            self.news()


def run(setup: Setup, cell: Cell, reporter: Reporter | None = None) -> Curve:
    """Run the trajectory of a cell, with the usual measurements, and keep what is worth a look (`lively_until`)."""
    began = time.perf_counter()
    parameters = {name: Values.one(value) for name, value in cell.items()}
    t_end = setup.config.integrator.patient.t_end
    t_end = LONG if t_end >= FOREVER else t_end
    integrator = setup.config.integrator.model_copy(update={"t_end": t_end})
    usual = measures.default(setup.config.equations)
    config = replace(setup.config, parameters=parameters, measure=usual, integrator=integrator)
    every = t_end / (2 * LONG) if t_end > LONG else None
    one = trajectory(config, every=every, reporter=reporter).isel(trajectory=0)
    one = one.sel(time=slice(0, lively_until(one)))
    return Curve(one, reversal_times(one), time.perf_counter() - began)


class Runner:
    """Runs one trajectory after the other, in the order in which they are asked for."""

    def __init__(self, setup: Setup) -> None:
        self._setup = setup
        self._jobs: SimpleQueue[Job] = SimpleQueue()
        self._known: dict[tuple[tuple[str, float], ...], Curve] = {}
        self._running: Job | None = None
        self._compiles = False
        # Not waited for at the end of the program: a chunk of a kernel cannot be interrupted.
        threading.Thread(target=self._work, daemon=True, name="trajectories").start()

    def submit(self, job: Job) -> None:
        """Run a trajectory as soon as those asked for before are over."""
        self._jobs.put(job)
        if self._compiles:
            job.news(COMPILING)

    def _work(self) -> None:
        with showing(self._compiling):
            while True:
                self._running = self._jobs.get()
                self._finish(self._running)

    def _finish(self, job: Job) -> None:
        try:
            job.curve = self._curve(job)
        except Dropped:
            return
        except ConfigError as error:
            job.fault = error.faults[0].message if error.faults else str(error)
        except Exception as error:  # told on the page: this thread has to go on
            job.fault = printable(f"{type(error).__name__}: {error}")
        job.news()

    def _curve(self, job: Job) -> Curve:
        if job.dropped:
            raise Dropped
        key = tuple(sorted(job.cell.items()))
        if key not in self._known:
            self._known[key] = run(self._setup, job.cell, job)
            if len(self._known) > _KEPT:
                del self._known[next(iter(self._known))]
        return self._known[key]

    @contextmanager
    def _compiling(self) -> Iterator[None]:
        self._compiles = True
        if self._running:
            self._running.news(COMPILING)
        try:
            yield
        finally:
            self._compiles = False
