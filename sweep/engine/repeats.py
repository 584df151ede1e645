"""Looks again at cells whose run failed or missed its tolerance, and repeats them with a shorter step.

A failure is a statement about physics, so one run does not settle it: with too long a step a body seems to lift off, to
jam or to topple that does nothing of the kind.  Two runs have to agree, the second with half the step of the first.
Each is stopped a few steps ahead of its failure and followed from there (`sweep.kernels.failure`); the failure is true
if both meet the same one at the same time.

Each cell is judged by its own results alone, so nothing depends on which cells were repeated with it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sweep.engine import executor
from sweep.engine.plan import Plan
from sweep.grid import Array
from sweep.kernels.failure import approach
from sweep.kernels.kernel import Kernel
from sweep.kernels.lanes import STABLE
from sweep.kernels.methods import METHODS
from sweep.kernels.status import DIVERGED, FAILURES, RUNNING
from sweep.models.model import Columns, Model, stack, take

ROUNDS, FALSE_ROUNDS = 3, 8
"""Largest number of repeats, each with half the step of the one before; and the same where every run so far has failed
falsely, because then its numbers are worth nothing."""

MOST_STEPS = 1e8
"""Steps beyond which a repeat is not tried: a minute for one cell, or for all that fill the lanes beside it.  If only
the way to a failure is shorter, that is repeated, once."""

SAME = 1e-6
"""Largest difference of the times at which two runs meet the same failure, in sqrt(c/g)."""

TOLERANCE_TIME = 400.0
"""The time in sqrt(c/g) to which a tolerance refers; a longer run may have a larger error, in proportion."""

ROUND_OFF = 1e-13
"""An error in spin that no shorter step makes smaller, in sqrt(g/c)."""

UNSOUND = 0.01
"""Relative error of the energy balance beyond which a run is never called sound."""

# How many steps ahead of a failure, and how many beyond it, a run is followed in short steps.  The longest history of a
# method has eight points: so far back no point comes from the failure.
_AHEAD, _BEYOND = 8, 2

# Cells that are followed between two calls of `after_chunk`: half a second at most friction.
_BATCH = 64


@dataclass(frozen=True)
class Cells:
    """Cells of one method, all of which have ended, with what is needed to start them again."""

    model: Model
    kernel: Kernel
    images: Array
    """Shape (cells, rows)."""
    columns: Columns
    """Physical parameters by name, each of shape (cells,)."""
    step: Array
    """The step asked for in the first run, in sqrt(c/g), shape (cells,)."""
    t_end: float
    tolerance: float
    balance: float
    """How many times as large as the error in spin the error of the energy balance may be (`Method.balance`)."""
    fixed: bool
    """Whether the configuration gives the step.  It is then never changed: shorter steps only serve to tell whether
    a failure is true."""
    stop_when_settled: bool

    def take(self, rows: Array) -> Cells:
        """Some of these cells, with a copy of their images."""
        columns = {name: values[rows] for name, values in self.columns.items()}
        return replace(self, images=self.images[rows], columns=columns, step=self.step[rows])

    def start(self, halvings: int | Array) -> Array:
        """Images at t = 0, with steps that are halved so many times."""
        stable = self.kernel.table(self.images).columns(STABLE).T
        images = self.kernel.images(self.columns, self.step / 2.0**halvings, self.t_end, stable)
        self.kernel.table(images)["halvings"] = halvings
        return images

    @property
    def failed(self) -> Array:
        """Whether each run failed."""
        return np.isin(self.kernel.table(self.images)["status"], FAILURES)

    @property
    def unsound(self) -> Array:
        """Whether the energy balance is so wrong that no number of the run can be right."""
        if "energy_error" not in self.kernel.measure:
            return np.zeros(len(self.images), bool)
        table = self.kernel.table(self.images)
        return np.asarray(~(table["violation"] <= UNSOUND * table["energy_start"]))

    @property
    def excess(self) -> Array:
        """Error of the energy balance, in units of what the tolerance allows.

        It is 0 where no run measures it, and infinite where a run failed.
        An error in energy is turned into one in spin at the fastest spin that the energy at the start allows.
        Of 330 cells of configs/mu_b.yaml the error in spin at t = 400 was, in the median, 1.4 times that with adams,
        and a fourteenth of it with dopri5, whose first steps are as coarse as the slip allows: hence `balance`.
        """
        table = self.kernel.table(self.images)
        if "energy_error" not in self.kernel.measure:
            return np.where(self.failed, np.inf, 0.0)
        with np.errstate(invalid="ignore"):  # the states of a run that failed
            _, _, inertia = self.kernel.model.energy(*self.kernel.unpack(self.images))
        scale = np.sqrt(2 * inertia * table["energy_start"])
        error = np.divide(table["violation"], scale, out=np.zeros(len(scale)), where=scale > 0)
        unit = self.model.spin_unit(self.columns)
        longer = np.maximum(self.kernel.times(self.images, self.t_end) * unit / TOLERANCE_TIME, 1)
        allowed = self.balance * max(self.tolerance, ROUND_OFF) * longer * unit
        return np.where(self.failed, np.inf, error / allowed)


def repeat_all(
    plans: Sequence[Plan], tables: Mapping[str, tuple[Kernel, Array]], after_chunk: Callable[[], None] = lambda: None
) -> None:
    """Repeat the cells of `plans` that need it, and make what their images say true, in place.

    A failure gets its true status, and its time in `failed_at`.  Where two runs do not meet the same one, the step is
    halved again, at most `ROUNDS` times, until a run ends soundly and within its tolerance.  The images of that run
    take the place of those of the first.  A run that still fails without meeting the same failure twice has `DIVERGED`,
    and so has every run whose energy balance is off by more than `UNSOUND`.  One that only misses its tolerance is
    `missed`.

    Parameters
    ----------
    tables : for each method, its kernel and the images of all cells that it runs, in the order of `plans`;
        all of them have ended
    after_chunk : called after each chunk of work, when the cells that are not decided yet are `RUNNING`
    """
    jobs = []
    for method, (kernel, images) in tables.items():
        cells = cells_of(plans, method, kernel, images)
        rows = np.flatnonzero(cells.failed if cells.fixed else cells.failed | (cells.excess > 1))
        jobs.append((cells, rows, cells.take(rows)))
        kernel.table(images)["status"][rows] = RUNNING
    for cells, rows, first in jobs:
        _repeat(cells, rows, first, after_chunk)
        cells.kernel.table(cells.images)["status"][cells.unsound & ~cells.failed] = DIVERGED


def cells_of(plans: Sequence[Plan], method: str, kernel: Kernel, images: Array) -> Cells:
    """The cells of `plans` that a method runs."""
    config, integrator = plans[0].config, plans[0].config.integrator
    parts = [part for each in plans for part in each.parts if part.method == method]
    return Cells(
        model=config.equations,
        kernel=kernel,
        images=images,
        columns={name: np.concatenate([part.columns[name] for part in parts]) for name in parts[0].columns},
        step=np.concatenate([part.step for part in parts]),
        t_end=integrator.t_end,
        tolerance=integrator.tolerance,
        balance=METHODS[method].balance,
        fixed=integrator.step != "auto",
        stop_when_settled=integrator.stop_when_settled,
    )


def _repeat(cells: Cells, rows: Array, first: Cells, after_chunk: Callable[[], None]) -> None:
    """Decide the cells with the indices `rows`; `first` are these cells after their first run."""
    now, met, halvings = first, Met.nothing(len(rows)), 0
    brief = np.zeros(len(rows), bool)
    """Whether a repeat goes to where the run before failed, and no further."""
    while len(rows):
        before = now
        if halvings:
            most = np.where(brief, 2 * (now.kernel.table(now.images)["done"] + _BEYOND), np.inf)
            now = replace(now, images=now.start(halvings))
            _run(now, most, after_chunk)
        met, met_before = _meet(now, halvings, after_chunk), met
        table = now.kernel.table(now.images)
        if cells.fixed:
            last, within = np.full(len(rows), halvings == 1), now.step
        else:
            rounds = np.where(now.failed & ~met.agrees(met_before, np.inf), FALSE_ROUNDS, ROUNDS)
            long, failed_late = 2 * table["goal"] > MOST_STEPS, 2 * table["done"] > MOST_STEPS
            last = (halvings >= rounds) | (long & (brief | ~now.failed | failed_late))
            within = np.where(last & ~now.unsound, np.inf, SAME)
        true = met.agrees(met_before, within)
        table["missed"] = missed = ~true & ~(now.excess <= 1)
        over = ~missed | last
        # A brief run that did not fail is no result.
        images = np.where((brief & ~true)[:, None], before.images, (first if cells.fixed else now).images)[over]
        cells.images[rows[over]] = _concluded(cells.kernel, images, met.take(over), true[over])
        brief = np.zeros(len(rows), bool) if cells.fixed else long
        rows, first, now, met, brief = rows[~over], first.take(~over), now.take(~over), met.take(~over), brief[~over]
        halvings += 1


def _run(cells: Cells, most: Array, after_chunk: Callable[[], None]) -> None:
    """Run the cells to their ends, or until they have taken `most` steps, shape (cells,)."""
    goal = cells.kernel.table(cells.images)["goal"]
    wanted = goal.copy()
    goal[:] = np.minimum(wanted, most)
    executor.execute(cells.kernel, cells.images, stop_when_settled=cells.stop_when_settled, after_chunk=after_chunk)
    goal[:] = wanted


@dataclass(frozen=True)
class Met:
    """What runs that failed have met, as the approach in short steps tells it."""

    kind: Array
    """`LIFT_OFF`, `PARADOX`, `TOPPLED`, or `DIVERGED` where no step is short enough; `RUNNING` where a run has met
    nothing, shape (cells,)."""
    time: Array
    """When, in sqrt(c/g), shape (cells,)."""

    @classmethod
    def nothing(cls, cells: int) -> Met:
        return cls(np.full(cells, RUNNING), np.zeros(cells))

    def take(self, rows: Array) -> Met:
        return Met(self.kind[rows], self.time[rows])

    def agrees(self, other: Met, within: float | Array) -> Array:
        """Whether both have met the same failure, at times that differ by at most `within`, shape (cells,)."""
        near = np.abs(self.time - other.time) <= within
        return np.asarray((self.kind != RUNNING) & (self.kind == other.kind) & near)


def _concluded(kernel: Kernel, images: Array, met: Met, true: Array) -> Array:
    """`images` with a status that is true: a failure that is not `true` is one of the integration."""
    table = kernel.table(images)
    failed = np.isin(table["status"], FAILURES)
    table["status"] = np.where(true, met.kind, np.where(failed, DIVERGED, table["status"]))
    table["failed_at"] = np.where(true, met.time, 0.0)
    return images


def _meet(cells: Cells, halvings: int, after_batch: Callable[[], None]) -> Met:
    """What the failed ones of `cells`, which were run with steps halved so many times, have really met."""
    met = Met.nothing(len(cells.images))
    rows = np.flatnonzero(cells.failed)
    if not len(rows):
        return met
    ahead = cells.take(rows)
    table = cells.kernel.table(ahead.images)
    step, end, goal = table["step"], cells.kernel.times(ahead.images, cells.t_end), table["done"] - _AHEAD
    # Run again to a few steps ahead of the failure, or else begin at the start.
    late = goal > 0
    begin = np.where(late, end - _AHEAD * step, 0.0)
    states = stack(cells.model.start(ahead.columns))
    if late.any():
        again = ahead.take(late).start(halvings)
        cells.kernel.table(again)["goal"] = goal[late]
        executor.execute(cells.kernel, again, stop_when_settled=cells.stop_when_settled, after_chunk=after_batch)
        states[:, late] = cells.kernel.model_states(again)
    constants = cells.model.constants.of(ahead.columns)
    stretch = end + _BEYOND * step - begin
    for first in range(0, len(rows), _BATCH):
        batch = slice(first, first + _BATCH)
        kind, passed = approach(cells.model, states[:, batch], take(constants, batch), stretch[batch])
        met.kind[rows[batch]], met.time[rows[batch]] = kind, begin[batch] + passed
        after_batch()
    return met
