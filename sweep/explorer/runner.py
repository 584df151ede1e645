"""Run trajectories and count reversals in a separate thread, so that the page stays responsive."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import count
from queue import PriorityQueue
from typing import Any

import xarray as xr

from sweep.config import InputError, Values
from sweep.config.schema import FOREVER
from sweep.engine.plan import steps_of
from sweep.engine.reporter import Progress, Reporter
from sweep.explorer.setup import Setup
from sweep.explorer.state import MAX_CELLS, Cell
from sweep.faults import printable
from sweep.grid import Array
from sweep.jit import load_numba, showing
from sweep.kernels import measures
from sweep.kernels.status import FAILURES, RUNNING, TIME_LIMIT
from sweep.plots.trajectories import lively_until, reversal_times
from sweep.studies.trajectory import choose, intervals, trajectory

LONG = 30_000.0
"""End of a trajectory without a time limit (`t_end: settled`)."""

MAX_STEPS = 1e8
"""Largest number of steps of a trajectory: an address may ask for any friction, and so for any number of steps."""

MAX_SAMPLES = 200_000
"""Largest number of samples of a trajectory; longer ones are sampled more coarsely."""

COMPILING = "compiling the simulation for this machine; later runs find it in the cache"

_STRETCHES = tuple(0.25**k for k in range(4, -1, -1))
"""A trajectory is run to these shares of its time in turn, so that the beginning of its curve appears at once."""

_REPORT_EVERY = 0.1
"""Seconds between two reports of progress."""


@dataclass(frozen=True, eq=False)
class Curve:
    """A trajectory that was run."""

    dataset: xr.Dataset
    """The result of `sweep.trajectory`, without the dimension `trajectory`."""
    reversals: Array
    """Times of the reversals, in the unit of the dataset."""
    seconds: float
    """The time that the run took."""
    whole: bool = True
    """Whether the curve is complete."""


class Dropped(Exception):
    """Raised to end a run that is no longer needed."""


@dataclass(eq=False)
class Job(Reporter):
    """A trajectory that a page waits for; `report` is called with the job, on the runner's thread, when it changes.

    A subclass can search for something else: its `begin` yields results, ever more of them, with an attribute `whole`.
    """

    cell: Cell
    report: Callable[[Job], None]
    share: float = 0.0
    """Share of the time that has been simulated."""
    delay: str = ""
    """Why the job waits; empty if it runs."""
    curve: Any = None
    """The `Curve` so far; at first that of the job that this one replaces."""
    fault: str = ""
    """Why there will be no curve; empty if there will be one."""
    over: bool = False
    """Whether the job has ended."""
    dropped: bool = False
    """Set when the job is no longer needed: the run ends at its next chunk, and `report` is not called again."""
    t_end: float = 1.0
    """The time at which the run ends."""
    rest: Iterator[Any] = field(default_factory=lambda: iter(()))
    """Continues the run."""
    _reported: float = 0.0

    def begin(self, setup: Setup) -> Iterator[Any]:
        """Run the trajectory of the cell, with the usual measurements, to ever later times, and yield each curve.

        The last one goes to `t_end`, or, once the trajectory has settled, a while after its last event
        (`lively_until`).
        """
        parameters = {name: Values.one(value) for name, value in self.cell.items()}
        usual, seconds = measures.default(setup.config.equations), 0.0
        config = choose(replace(setup.config, parameters=parameters, measure=usual))
        columns, integrator = config.grid.columns(), config.integrator
        t_end = LONG if integrator.t_end >= FOREVER else integrator.t_end
        t_end = min(t_end, MAX_STEPS * float(steps_of(integrator.method, config, columns)[0].min()))
        every = max(float(intervals(config.equations, columns).min()), t_end / MAX_SAMPLES)
        self.t_end = t_end
        for until in (share * t_end for share in _STRETCHES):
            began = time.perf_counter()
            shorter = integrator.model_copy(update={"t_end": until})
            one = trajectory(replace(config, integrator=shorter), every=every, reporter=self)
            lively, seconds = lively_until(one), seconds + time.perf_counter() - began
            still = one["status"] not in (RUNNING, TIME_LIMIT) and lively < one["time"][-1]
            whole = bool(until == t_end or still or one["status"] in FAILURES)
            one = one.sel(time=slice(0, lively)) if whole else one
            yield Curve(one, reversal_times(one), seconds, whole)
            if whole:
                return

    def news(self, delay: str = "") -> None:
        """Report a change, unless the job is no longer needed."""
        self.delay, self._reported = delay, time.perf_counter()
        if not self.dropped:
            self.report(self)

    def chunk(self, progress: Progress) -> None:
        """Report the progress of the run; end it by `Dropped` if it is no longer needed."""
        if self.dropped:
            raise Dropped
        self.share = max(self.share, progress.done / self.t_end)
        if time.perf_counter() - self._reported > _REPORT_EVERY:
            self.news()


class Runner:
    """Run requested trajectories, the first stretch of each before the later stretches of the others."""

    def __init__(self, setup: Setup) -> None:
        self._setup = setup
        self._jobs: PriorityQueue[tuple[float, int, Job]] = PriorityQueue()
        self._numbers = count()
        self._running: Job | None = None
        self._compiles = False
        # Not waited for at the end of the program: a chunk of a kernel cannot be interrupted.
        threading.Thread(target=self._work, daemon=True, name="trajectories").start()

    def submit(self, job: Job) -> None:
        """Run a trajectory, after those submitted earlier have advanced as far."""
        job.rest = job.begin(self._setup)
        self._jobs.put((0.0, next(self._numbers), job))
        if self._compiles:
            job.news(COMPILING)

    def _work(self) -> None:
        # One thread suffices for a trajectory.  Further threads would wait busily, and on shared cores make it ten
        # times as slow.
        load_numba().set_num_threads(1)
        with showing(self._compiling):
            while True:
                *_, self._running = self._jobs.get()
                self._go_on(self._running)

    def _go_on(self, job: Job) -> None:
        if job.dropped:
            return
        try:
            job.curve = next(job.rest)
            job.over = job.curve.whole
        except Dropped:
            return
        except InputError as error:
            job.fault = error.faults[0].message if error.faults else str(error)
        except Exception as error:  # shown on the page, because this thread has to continue
            job.fault = printable(f"{type(error).__name__}: {error}")
        job.over = job.over or bool(job.fault)
        if not job.over:
            self._jobs.put((job.share, next(self._numbers), job))
        job.news()

    @contextmanager
    def _compiling(self) -> Iterator[None]:
        self._compiles = True
        if self._running:
            self._running.news(COMPILING)
        try:
            yield
        finally:
            self._compiles = False


class Drawn:
    """The chosen cells, at most `MAX_CELLS`, in the order of their choice; one of them is active."""

    def __init__(self, cells: Iterable[Cell], runner: Runner | None, report: Callable[[Job], None]) -> None:
        """`report` is called with each job that changes, on the thread of the runner."""
        self._runner, self._report = runner, report
        self._jobs: list[Job] = []
        self.active = 0
        for cell in cells:
            self.add(cell, keep=True)

    @property
    def cells(self) -> list[Cell]:
        return [job.cell for job in self._jobs]

    @property
    def curves(self) -> list[Curve | None]:
        """The curves so far."""
        return [job.curve for job in self._jobs]

    def add(self, cell: Cell, *, keep: bool) -> None:
        """Choose another cell, and run it; it replaces those chosen before, unless these are to be kept."""
        while self._jobs and (not keep or len(self._jobs) == MAX_CELLS):
            self.remove(0)
        self._jobs.append(self._begun(cell))
        self.active = len(self._jobs) - 1

    def show(self, cells: Sequence[Cell]) -> None:
        """Choose these cells; those that were chosen before keep their runs."""
        for job in self._jobs:
            job.dropped = job.cell not in cells
        known = [job for job in self._jobs if not job.dropped]
        self._jobs = [next((job for job in known if job.cell == cell), None) or self._begun(cell) for cell in cells]
        self.active = max(min(self.active, len(self._jobs) - 1), 0)

    def change(self, cell: Cell) -> None:
        """Run the active cell with other parameters; its old curve stays until then."""
        old = self._jobs[self.active]
        old.dropped = True
        self._jobs[self.active] = self._begun(cell, old.curve)

    def remove(self, k: int) -> None:
        self._jobs.pop(k).dropped = True
        self.active = max(min(self.active, len(self._jobs) - 1), 0)

    def running(self) -> Iterator[tuple[int, Job]]:
        """Yield the places of the cells whose runs are in progress, and these runs."""
        return ((k, job) for k, job in enumerate(self._jobs) if not job.over)

    def leave(self) -> None:
        """Drop all runs."""
        for job in self._jobs:
            job.dropped = True

    def _begun(self, cell: Cell, curve: Curve | None = None) -> Job:
        assert self._runner
        self._runner.submit(job := Job(cell, self._report, curve=curve))
        return job
