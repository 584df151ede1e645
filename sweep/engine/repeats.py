"""Looks again at cells whose run failed or missed its tolerance, and repeats them with a shorter step.

A failure is a statement about physics, so one run does not settle it: with too long a step a body seems to lift off, to
jam or to topple that does nothing of the kind.  Two runs have to agree, the second with half the step of the first.
Each is stopped a few steps ahead of its failure and followed from there (`sweep.kernels.failure`); the failure is true
if both meet the same one at the same time.

Each cell is judged by its own results alone, so nothing depends on which cells were repeated with it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from sweep.engine import executor
from sweep.engine.plan import Part, Plan
from sweep.grid import Array
from sweep.kernels.failure import approach
from sweep.kernels.kernel import Kernel
from sweep.kernels.methods import METHODS
from sweep.kernels.status import DIVERGED, FAILURES, RUNNING
from sweep.models.model import stack, take

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
_AT_A_TIME = 64


def unsound(part: Part) -> Array:
    """Tell where the energy balance is so wrong that no number of the run can be right, shape (cells,)."""
    if "energy_error" not in part.kernel.measure:
        return np.zeros(len(part.images), bool)
    table = part.kernel.table(part.images)
    return np.asarray(~(table["violation"] <= UNSOUND * table["energy_start"]))


def excess(part: Part) -> Array:
    """Error of the energy balance, in units of what the tolerance allows, shape (cells,).

    It is 0 where no run measures it, and infinite where a run failed.
    An error in energy is turned into one in spin at the fastest spin that the energy at the start allows.
    Of 330 cells of configs/mu_b.yaml the error in spin at t = 400 was, in the median, 1.4 times that with adams, and a
    fourteenth of it with dopri5, whose first steps are as coarse as the slip allows: hence `Method.balance`.
    """
    kernel, model, integrator = part.kernel, part.config.equations, part.config.integrator
    table, failed = kernel.table(part.images), part.failed
    if "energy_error" not in kernel.measure:
        return np.where(failed, np.inf, 0.0)
    with np.errstate(invalid="ignore"):  # the states of a run that failed
        _, _, inertia = kernel.model.energy(*kernel.unpack(part.images))
    scale = np.sqrt(2 * inertia * table["energy_start"])
    error = np.divide(table["violation"], scale, out=np.zeros(len(scale)), where=scale > 0)
    unit = model.spin_unit(part.columns)
    longer = np.maximum(kernel.times(part.images, integrator.t_end) * unit / TOLERANCE_TIME, 1)
    allowed = METHODS[part.method].balance * max(integrator.tolerance, ROUND_OFF) * longer * unit
    return np.where(failed, np.inf, error / allowed)


def repeat_all(job: Plan, after_chunk: Callable[[], None] = lambda: None) -> None:
    """Repeat the cells of `job` that need it, and make what their images say true, in place; all of them have ended.

    A failure gets its true status, and its time in `failed_at`.  Where two runs do not meet the same one, the step is
    halved again, at most `ROUNDS` times, until a run ends soundly and within its tolerance.  The images of that run
    take the place of those of the first.  A run that still fails without meeting the same failure twice has `DIVERGED`,
    and so has every run whose energy balance is off by more than `UNSOUND`.  One that only misses its tolerance is
    `missed`.

    `after_chunk` is called after each chunk of work, when the cells that are not decided yet are `RUNNING`.
    """
    waiting = []
    for part in job.parts:
        rows = np.flatnonzero(part.failed if _fixed(part) else part.failed | (excess(part) > 1))
        waiting.append((part, rows, part.take(rows)))
        part.kernel.table(part.images)["status"][rows] = RUNNING
    for part, rows, first in waiting:
        _repeat(part, rows, first, after_chunk)
        part.kernel.table(part.images)["status"][unsound(part) & ~part.failed] = DIVERGED


def _fixed(part: Part) -> bool:
    """Tell whether the configuration gives the step, which is then never changed: shorter ones tell true failures."""
    return part.config.integrator.step != "auto"


def _repeat(part: Part, rows: Array, first: Part, after_chunk: Callable[[], None]) -> None:
    """Decide the cells of `part` with the indices `rows`; `first` are these cells after their first run."""
    fixed, now, met, halvings = _fixed(part), first, Met.nothing(len(rows)), 0
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
        if fixed:
            last, within = np.full(len(rows), halvings == 1), now.step
        else:
            rounds = np.where(now.failed & ~met.agrees(met_before, np.inf), FALSE_ROUNDS, ROUNDS)
            long, failed_late = 2 * table["goal"] > MOST_STEPS, 2 * table["done"] > MOST_STEPS
            last = (halvings >= rounds) | (long & (brief | ~now.failed | failed_late))
            within = np.where(last & ~unsound(now), np.inf, SAME)
        true = met.agrees(met_before, within)
        table["missed"] = missed = ~true & ~(excess(now) <= 1)
        over = ~missed | last
        # A brief run that did not fail is no result.
        images = np.where((brief & ~true)[:, None], before.images, (first if fixed else now).images)[over]
        part.images[rows[over]] = _concluded(part.kernel, images, met.take(over), true[over])
        brief = np.zeros(len(rows), bool) if fixed else long
        rows, first, now, met, brief = rows[~over], first.take(~over), now.take(~over), met.take(~over), brief[~over]
        halvings += 1


def _run(part: Part, most: Array, after_chunk: Callable[[], None]) -> None:
    """Run the cells to their ends, or until they have taken `most` steps, shape (cells,)."""
    goal = part.kernel.table(part.images)["goal"]
    wanted = goal.copy()
    goal[:] = np.minimum(wanted, most)
    settle = part.config.integrator.stop_when_settled
    executor.execute(part.kernel, part.images, stop_when_settled=settle, after_chunk=after_chunk)
    goal[:] = wanted


@dataclass(frozen=True)
class Met:
    """Holds what runs that failed have met, as the approach in short steps tells it."""

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
        """Tell where both have met the same failure, at times that differ by at most `within`, shape (cells,)."""
        near = np.abs(self.time - other.time) <= within
        return np.asarray((self.kind != RUNNING) & (self.kind == other.kind) & near)


def _concluded(kernel: Kernel, images: Array, met: Met, true: Array) -> Array:
    """`images` with a status that is true: a failure that is not `true` is one of the integration."""
    table = kernel.table(images)
    failed = np.isin(table["status"], FAILURES)
    table["status"] = np.where(true, met.kind, np.where(failed, DIVERGED, table["status"]))
    table["failed_at"] = np.where(true, met.time, 0.0)
    return images


def _meet(part: Part, halvings: int, after_chunk: Callable[[], None]) -> Met:
    """Find what the failed cells of `part`, which were run with steps halved so many times, have really met."""
    met = Met.nothing(len(part.images))
    rows = np.flatnonzero(part.failed)
    if not len(rows):
        return met
    model, ahead = part.config.equations, part.take(rows)
    table = part.kernel.table(ahead.images)
    step, end, goal = (
        table["step"],
        part.kernel.times(ahead.images, part.config.integrator.t_end),
        table["done"] - _AHEAD,
    )
    # Run again to a few steps ahead of the failure, or else begin at the start.
    late = goal > 0
    begin = np.where(late, end - _AHEAD * step, 0.0)
    states = stack(model.start(ahead.columns))
    if late.any():
        again = ahead.take(late)
        again = replace(again, images=again.start(halvings))
        _run(again, goal[late], after_chunk)
        states[:, late] = part.kernel.model_states(again.images)
    constants = model.constants.of(ahead.columns)
    stretch = end + _BEYOND * step - begin
    for first in range(0, len(rows), _AT_A_TIME):
        some = slice(first, first + _AT_A_TIME)
        kind, passed = approach(model, states[:, some], take(constants, some), stretch[some])
        met.kind[rows[some]], met.time[rows[some]] = kind, begin[some] + passed
        after_chunk()
    return met
