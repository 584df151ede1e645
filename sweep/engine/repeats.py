"""Looks again at cells whose run failed, with a shorter step, and finds out what is true.

A failure is a statement about physics, so one run does not settle it: with too long a step a body seems to lift off, to
jam or to topple that does nothing of the kind.  Two runs have to agree, the second with half the step of the first.
Each is stopped a few steps ahead of its failure and followed from there (`sweep.kernels.failure`); the failure is true
if both meet the same one at the same time.

Each cell is judged by its own results alone, so nothing depends on which cells were repeated with it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sweep.engine import final
from sweep.engine.executor import Work
from sweep.engine.plan import Part
from sweep.grid import Array
from sweep.kernels.build import APPROACH, build
from sweep.kernels.failure import approach
from sweep.kernels.kernel import FAILURE
from sweep.kernels.layout import BLOCK
from sweep.kernels.method import MISSED, REPEAT
from sweep.kernels.methods import METHODS
from sweep.kernels.status import DIVERGED, RUNNING, SETTLED
from sweep.models.model import stack, take

ROUNDS, FALSE_ROUNDS = 3, 8
"""Largest number of repeats, each with half the step of the one before; and the same where every run so far has failed
falsely, because then its numbers are worth nothing."""

MOST_STEPS = 1e8
"""Steps beyond which a repeat is not tried: a minute for one cell, or for all that fill the lanes beside it.  If only
the way to a failure is shorter, that alone is repeated."""

SAME = 1e-6
"""Largest difference of the times at which two runs meet the same failure, in sqrt(c/g)."""

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


def decide_failures(part: Part, work: Work, name: str) -> None:
    """Make what the images of `part`, all of which have ended, say about failures true, in place.

    A failure gets its true status, its time and the spin at that time.  Where two runs do not meet the same one, the
    step is halved again, at most `ROUNDS` times, until a run ends soundly.  That run takes the place of the first.  A
    run that still fails without meeting the same failure twice has `DIVERGED`, and so has every run whose energy
    balance is off by more than `UNSOUND`.

    `name` is that of the runs of `part`, to which the names of repeats are added.  While `work` goes on, the cells that
    are not decided yet are `RUNNING`.
    """
    rows = np.flatnonzero(part.failed if part.fixed else part.failed | unsound(part))
    first = part.take(rows)
    part.kernel.table(part.images)["status"][rows] = RUNNING
    _repeat(part, rows, first, work, name)
    part.kernel.table(part.images)["status"][unsound(part) & ~part.failed] = DIVERGED


def _repeat(part: Part, rows: Array, first: Part, work: Work, name: str) -> None:
    """Decide the cells of `part` with the indices `rows`; `first` are these cells after their first run."""
    now, met, halvings = first, Met.nothing(len(rows)), 0
    brief = np.zeros(len(rows), bool)
    """Whether a repeat goes to where the run before failed, and no further."""
    while len(rows):
        before = now
        if halvings:
            # A run may be stopped before the failure that lies ahead of it.
            steps = np.maximum(now.times, met.time) / now.kernel.table(now.images)["step"]
            most = np.where(brief, 2 * (steps + _BEYOND) + BLOCK, np.inf)
            now = now.start(2)
            final.run(now, work, f"{name} halved {halvings}", most)
        met, met_before = _meet(now, work, f"{name} halved {halvings} approach"), met
        table = now.kernel.table(now.images)
        if part.fixed:
            last, within = np.full(len(rows), halvings == 1), first.step
        else:
            rounds = np.where(now.failed & ~met.agrees(met_before, np.inf), FALSE_ROUNDS, ROUNDS)
            long, failed_late = 2 * table["goal"] > MOST_STEPS, 2 * table["done"] > MOST_STEPS
            last = (halvings >= rounds) | (long & (~now.failed | failed_late))
            within = np.where(last & ~unsound(now), np.inf, SAME)
        true = met.agrees(met_before, within)
        doubtful = ~true & (now.failed | unsound(now))
        over = ~doubtful | last
        # A brief run that did not fail is no result.
        back = over & brief & ~true
        for here, kept in ((over & ~back, first if part.fixed else now), (back, before)):
            done = kept.take(here)
            _conclude(done, take(met, here), take(met_before, here), true[here])
            rule = part.step_rule[rows[here]] if part.fixed else np.where(doubtful[here], MISSED, REPEAT)
            part.put(rows[here], done, np.where(halvings or doubtful[here], rule, part.step_rule[rows[here]]))
        brief = np.zeros(len(rows), bool) if part.fixed else long
        rows, first, now, met, brief = rows[~over], first.take(~over), now.take(~over), take(met, ~over), brief[~over]
        halvings += 1


class Met(NamedTuple):
    """Holds what runs that failed have met, as the approach in short steps tells it."""

    kind: Array
    """`LIFT_OFF`, `PARADOX`, `TOPPLED`, or `DIVERGED` where no step is short enough; `RUNNING` where a run has met
    nothing, shape (cells,)."""
    time: Array
    """When, in sqrt(c/g), shape (cells,)."""
    spin: Array
    """The spin at that time, shape (cells,)."""
    doubt: Array
    """How much the spin may change in what the approach leaves of that time, shape (cells,)."""

    @classmethod
    def nothing(cls, cells: int) -> Met:
        """What so many runs have met that did not fail."""
        return cls(np.full(cells, RUNNING), *np.zeros((3, cells)))

    def agrees(self, other: Met, within: float | Array) -> Array:
        """Tell where both have met the same failure, at times that differ by at most `within`, shape (cells,)."""
        near = np.abs(self.time - other.time) <= within
        return np.asarray((self.kind != RUNNING) & (self.kind == other.kind) & near)


def _conclude(part: Part, met: Met, met_before: Met, true: Array) -> None:
    """Give `part` statuses that are true, in place: a failure that is not `true` is one of the integration.

    `met_before` is what the runs in steps of twice the length have met.
    """
    table, method = part.kernel.table(part.images), METHODS[part.method]
    error = np.maximum(np.abs(met.spin - met_before.spin) / (2**method.error_order - 1), met.doubt)
    table["status"] = np.where(true, met.kind, np.where(part.failed, DIVERGED, table["status"]))
    for name, values in zip(FAILURE, (met.time, met.spin, error), strict=True):
        table[name] = np.where(true, values, 0.0)


def _meet(part: Part, work: Work, name: str) -> Met:
    """Find what the failed cells of `part` have really met."""
    met = Met.nothing(len(part.images))
    rows = np.flatnonzero(part.failed)
    if not len(rows):
        return met
    model, ahead = part.config.equations, part.take(rows)
    table = part.kernel.table(ahead.images)
    step, end, goal = table["step"], ahead.times, table["done"] - _AHEAD
    # Run again to a few steps ahead of the failure, or else begin at the start.
    late = goal > 0
    begin = np.where(late, end - _AHEAD * step, 0.0)
    states = stack(model.start(ahead.columns))
    if late.any():
        again = ahead.take(late).start()
        work.run(name, again.kernel, again.images, settle=again.settles, most=goal[late])
        # What failed later has gone on from where it settled.
        again.kernel.table(again.images)["status"][again.status == SETTLED] = RUNNING
        work.run(f"{name} on", again.kernel, again.images, most=goal[late])
        states[:, late] = part.kernel.model_states(again.images)
    constants = model.constants.of(ahead.columns)
    stretch = end + _BEYOND * step - begin
    build([part.kernel], APPROACH)
    for first in range(0, len(rows), _AT_A_TIME):
        some = slice(first, first + _AT_A_TIME)
        here = rows[some]
        ends = approach(model, states[:, some], take(constants, some), stretch[some])
        met.kind[here], passed, met.spin[here], met.doubt[here] = ends
        met.time[here] = begin[some] + passed
        work.after_chunk()
    return met
