"""Repeats cells whose run failed with shorter steps, to find out what really happens.

A failure is a statement about physics, so one run does not settle it: too long a step can produce a spurious lift-off,
jam or topple. Two runs have to agree, the second with half the step of the first. Each is stopped a few steps ahead of
its failure and followed from there (`sweep.kernels.failure`); the failure is genuine if both meet the same one at the
same time.

Each cell is judged by its own results alone, so nothing depends on which cells were repeated with it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sweep.engine import ending
from sweep.engine.cells import APPROACH, MET, Cells, Lives
from sweep.grid import Array
from sweep.interrupt import point
from sweep.kernels.build import APPROACH as COMPILED
from sweep.kernels.build import build
from sweep.kernels.failure import approach
from sweep.kernels.kernel import FAILURE
from sweep.kernels.method import REPEAT
from sweep.kernels.methods import METHODS
from sweep.kernels.status import DIVERGED, FAILURES, RUNNING
from sweep.models.model import stack, take

ROUNDS, FALSE_ROUNDS = 3, 8
"""Largest number of repeats, each with half the step of the one before; and the same if every run so far has failed
spuriously, which makes its numbers worthless."""

MOST_STEPS = 1e8
"""Steps above which no further repeat is tried: a minute for one cell, or for all that fill the lanes next to it."""

SAME = 1e-6
"""Largest time difference at which two runs meet the same failure, in sqrt(c/g)."""

UNSOUND = 0.01
"""Relative error of the energy balance above which a run is never considered sound."""

# Number of steps ahead of a failure, and beyond it, in which a run is followed with short steps. The longest history of
# a method has eight points, so none of them comes from the failure.
_AHEAD, _BEYOND = 8, 2

# Number of cells followed between two calls of `after_chunk`: half a second at most friction.
_AT_A_TIME = 64


class Met(NamedTuple):
    """The failures that runs met, according to the approach with short steps."""

    kind: Array
    """`LIFT_OFF`, `PARADOX`, `TOPPLED`, or `DIVERGED` where no step is short enough; `RUNNING` where a run has met
    nothing, shape (cells,)."""
    time: Array
    """Time of the failure, in sqrt(c/g), shape (cells,)."""
    spin: Array
    """Spin at that time, shape (cells,)."""
    doubt: Array
    """Largest change of the spin within the uncertainty of that time, shape (cells,)."""

    @classmethod
    def nothing(cls, cells: int) -> Met:
        """Return the record of runs that did not fail."""
        return cls(np.full(cells, RUNNING), *np.zeros((3, cells)))

    def agrees(self, other: Met, within: float | Array) -> Array:
        """Return where both have met the same failure, at times that differ by at most `within`, shape (cells,)."""
        near = np.abs(self.time - other.time) <= within
        return np.asarray((self.kind != RUNNING) & (self.kind == other.kind) & near)


def unsound(cells: Cells) -> Array:
    """Return where the energy balance is so wrong that no number of the run can be right, shape (cells,)."""
    if "energy_error" not in cells.kernel.measure:
        return np.zeros(len(cells.cells), bool)
    table = cells.kernel.table(cells.rows)
    return np.asarray(~(table["violation"] <= UNSOUND * table["energy_start"]))


def look_at(lives: Lives, which: Array) -> Array:
    """Examine the finished runs of the cells `which`; repeat those that failed until the outcome is certain.

    A genuine failure gets its status, its time and the spin at that time. If two runs do not meet the same failure, the
    step is halved again, at most `ROUNDS` times, until a run ends soundly. That run replaces the first.  A run that
    still fails without meeting the same failure twice has `DIVERGED`, and so has every run whose energy balance is off
    by more than `UNSOUND`.

    Returns
    -------
    The indices of the cells whose outcome is now known; the others continue.
    """
    cells, begun = lives.take(which), lives.notes["halvings"][which] > 0
    failed = cells.failed
    open_ = begun | failed if cells.rules.fixed else begun | failed | unsound(cells)
    fresh = which[open_ & ~begun]
    lives.note(fresh, MET, np.array([RUNNING, 0, 0, 0]))
    at_start, nothing = _approach(lives, which[failed]), which[open_ & ~failed]
    concluded = after_approach(lives, at_start), _conclude(lives, nothing, Met.nothing(len(nothing)))
    return np.concatenate([which[~open_], *concluded])


def _approach(lives: Lives, which: Array) -> Array:
    """Rerun failed cells to a few steps ahead of their failures.

    Returns
    -------
    The indices of cells that fail so early that there is nothing to rerun.
    """
    cells = lives.take(which)
    goal = cells.kernel.table(cells.rows)["done"] - _AHEAD
    lives.aside[which] = cells.rows
    late = goal > 0
    lives.enter(which[late], APPROACH, cells.take(late).start(), goal=goal[late])
    return which[~late]


def after_approach(lives: Lives, which: Array) -> Array:
    """Follow cells from a few steps ahead of a failure, and conclude; returns as `look_at`."""
    if not len(which):
        return which
    met, cells = Met.nothing(len(which)), lives.cells.take(which, lives.aside[which])
    model, table, constants = cells.model, cells.kernel.table(cells.rows), cells.model.constants.of(cells.columns)
    late = table["done"] > _AHEAD
    begin = np.where(late, cells.times - _AHEAD * table["step"], 0.0)
    states = stack(model.start(cells.columns))
    states[:, late] = cells.kernel.model_states(lives.cells.rows[which[late]])
    stretch = cells.times + _BEYOND * table["step"] - begin
    build([cells.kernel], COMPILED)
    for first in range(0, len(which), _AT_A_TIME):
        some = slice(first, first + _AT_A_TIME)
        found = approach(model, states[:, some], take(constants, some), stretch[some])
        met.kind[some], passed, met.spin[some], met.doubt[some] = found
        met.time[some] = begin[some] + passed
        point()
    lives.cells.rows[which] = cells.rows
    return _conclude(lives, which, met)


def _conclude(lives: Lives, which: Array, met: Met) -> Array:
    """Decide the outcome of the cells `which`, whose runs have `met` something; returns as `look_at`."""
    notes, now = lives.notes, lives.take(which)
    table, rules = now.kernel.table(now.rows), now.rules
    halvings, before = notes["halvings"][which], Met(*notes.columns(MET)[which].T)
    if rules.fixed:
        last, within = halvings == 1, notes["step_before"][which]
    else:
        rounds = np.where(now.failed & ~met.agrees(before, np.inf), FALSE_ROUNDS, ROUNDS)
        last = (halvings >= rounds) | ((halvings > 0) & (2 * table["done"] > MOST_STEPS))
        within = np.where(last & ~unsound(now), np.inf, SAME)
    true = met.agrees(before, within)
    doubtful = ~true & (now.failed | unsound(now))
    over = ~doubtful | last
    # With a fixed step, the run with half the step only confirms.
    back = over & rules.fixed & (halvings > 0)
    here = which[over]
    step, rows = now.step[over], now.rows[over]
    step[back[over]], rows[back[over]] = notes["step_before"][which[back]], lives.before[which[back]]
    _set_true(lives, here, rows, take(met, over), take(before, over), true[over])
    notes["step"][here] = step
    if not rules.fixed:
        repeated = halvings[over] > 0
        notes["step_rule"][here[repeated]] = REPEAT
        notes["missed"][here] = doubtful[over] | (~repeated & (notes["missed"][here] > 0))
    _halve(lives, which[~over], take(met, ~over))
    return np.asarray(here)


def deny_unsound(lives: Lives, which: Array) -> None:
    """Mark cells of `which` as diverged if their energy balance is wrong, although they did not fail."""
    cells = lives.take(which)
    wrong = which[unsound(cells) & ~cells.failed]
    lives.cells.kernel.table(lives.cells.rows)["status"][wrong] = DIVERGED


def _set_true(lives: Lives, which: Array, rows: Array, met: Met, before: Met, true: Array) -> None:
    """Set `rows`, with final statuses, as the state rows of the cells `which`.

    A failure that is not `true` is an artefact of the integration. `before` holds what the runs with steps of twice the
    length have met.
    """
    table, method = lives.cells.kernel.table(rows), METHODS[lives.cells.method]
    error = np.maximum(np.abs(met.spin - before.spin) / (2**method.error_order - 1), met.doubt)
    failed = np.isin(table["status"], FAILURES)
    table["status"] = np.where(true, met.kind, np.where(failed, DIVERGED, table["status"]))
    for name, values in zip(FAILURE, (met.time, met.spin, error), strict=True):
        table[name] = np.where(true, values, 0.0)
    lives.cells.rows[which], lives.notes["halvings"][which] = rows, 0


def _halve(lives: Lives, which: Array, met: Met) -> None:
    """Rerun the cells `which` with half the step."""
    notes, now = lives.notes, lives.take(which)
    lives.note(which, MET, stack(met).T)
    notes["halvings"][which] += 1
    notes["step_before"][which], lives.before[which] = now.step, now.rows
    notes["step"][which] = now.step / 2
    ending.begin(lives, which, lives.take(which).start())
