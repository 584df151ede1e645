"""Takes a cell from its start to a result that can be trusted.

    run → over? → failed? ── no → second run → within its tolerance? ── yes → done
     ↑              ↓ yes                        ↓ no                          ↑
     │           approach → the same twice? ─────│──────────────────────── yes ┘
     │                          ↓ no             ↓
     └─────────────── repeat with a shorter step ┘

A run has one leg or two: it stops at the time `stop_early`, and goes on to `t_end` only if the spin will reverse once
more, or it can be predicted when it will be over. A run that fails makes an approach: it runs again from the start,
with the same step, to a few steps ahead of the failure, and from there short steps show what it meets. A second run,
with longer steps, goes to the end of the first; the difference of their spins gives the error, which is infinite if the
second run fails. A repeat begins anew with a shorter step, and everything is decided again. The last run that is not a
second one is the result.

When a stage of a cell has ended, `next_of` says where the cell goes next; the queue (`sweep.engine.executor`) applies
it. Each cell is judged by its own results alone, so nothing depends on which cells are with it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from sweep.engine import failures, over
from sweep.engine.cells import Cells
from sweep.engine.errors import (
    OF_RATTLE,
    Errors,
    allowed,
    compare,
    doubts_of_counts,
    imbalance,
    limited_by_round_off,
    second_steps,
)  # fmt: skip
from sweep.engine.executor import keep_busy
from sweep.engine.failures import Met
from sweep.engine.lives import (
    APPROACH,
    DONE,
    FIRST,
    RUN,
    SECOND,
    Approach,
    Done,
    Lives,
    Next,
    NextLeg,
    Repeat,
    Resume,
    Second,
    note,
)  # fmt: skip
from sweep.grid import Array
from sweep.kernels.kernel import FAILURE
from sweep.kernels.layout import Table
from sweep.kernels.measures.reversals import Reversals
from sweep.kernels.method import TOLERANCE
from sweep.kernels.status import DIVERGED, FAILURES, SETTLED, TIME_LIMIT, Doubt
from sweep.models.model import take

Going = Iterator[tuple[Array, Next]]
"""Indices of cells, and where they go next."""

MOST_STEPS = 1e8
"""Steps above which no further repeat is tried: a minute for one cell, or for all that fill the lanes next to it."""


def live(lives: Sequence[Lives], after_chunk: Callable[[], None] = lambda: None) -> None:
    """Take all cells through their lives; `after_chunk` as for `keep_busy`."""
    keep_busy(lives, next_of, after_chunk)


def next_of(lives: Lives, which: Array) -> Going:
    """Say where the cells `which` go, whose stages have ended."""
    stage = lives.stage[which]
    for ended, rules in ((RUN, _after_run), (APPROACH, _after_approach), (SECOND, _after_second_run)):
        if (stage == ended).any():
            yield from rules(lives, which[stage == ended])


def _after_run(lives: Lives, which: Array) -> Going:
    """Is it over? The slow equations predict what is left to come of the spin (`sweep.engine.over`).

    A run that has settled although its spin may reverse once more goes on from there to the end of its leg, and cannot
    settle on the way. At the end of a leg a run has settled if its spin will surely reverse no more. If its spin will
    reverse, or its rattle grows or winds down, the second leg follows the first. Otherwise, and at `t_end`, it ends
    with `TIME_LIMIT`. A failed run makes an approach. Any other is judged at once: it has met nothing.
    """
    run, settles = lives.take(which), lives.cells.rules.settles
    left = over.predicted(run, at_limit=settles)
    early, (final, further) = over.too_early(run, left), over.at_limit(run, left)
    further &= settles & (lives.cells.rules.first_leg is not None) & (lives.notes["leg"][which] == FIRST)
    note(lives.notes, "left", which, left)
    lives.table["status"][which[final & settles]] = SETTLED
    yield which[early], Resume()
    yield which[further], NextLeg()
    yield which[run.failed], Approach()
    sound = which[~(early | further | run.failed)]
    yield from _judged(lives, sound, Met.nothing(len(sound)))


def _after_approach(lives: Lives, which: Array) -> Going:
    """Find out what failed runs have met, and judge them."""
    failed = lives.take(which, lives.aside)
    met = failures.met(failed, lives.rows[which])
    lives.rows[which] = failed.rows
    yield from _judged(lives, which, met)


ROUNDS, FALSE_ROUNDS = 3, 8
"""Largest number of repeats because of a failure, each with half the step of the one before; and the same for a run
that meets another failure than the run before, which makes its numbers worthless."""

SAME = 1e-6
"""Largest time difference at which two runs meet the same failure, in sqrt(c/g)."""


def _judged(lives: Lives, which: Array, met: Met) -> Going:
    """Did it truly fail? The cells have ended, and `met` something, or nothing.

    A failure is a statement about physics, which needs two runs: it is genuine if the run before, with twice the step,
    met the same failure at the same time. The row then gets its kind, its time and the spin at that time from the run
    with the shorter step, and the cell is done, without a second run. Otherwise the cell is repeated with half the
    step. So is a run whose energy balance is off by more than `failures.UNSOUND`, whether it failed or not. As soon as
    a run is sound, it counts as the first from then on, with its step, and the failures are forgotten.

    After `ROUNDS` halvings, or when half the step would need more than `MOST_STEPS`, the same failure at another time
    suffices if the energy balance is sound. A run that meets another failure than the run before is halved up to
    `FALSE_ROUNDS` times. What is still doubtful then has `DIVERGED`.

    With a fixed step, a failed run is repeated once, with half the step. If that meets the same failure within the time
    of one step, the failure is genuine, and its time and spin are those of the repeat. Otherwise the cell has
    `DIVERGED`, as has at once a run that did not fail but has no energy balance. The state of the first run is kept.
    """
    notes, rules, now = lives.notes[which], lives.cells.rules, lives.take(which)
    unsound, begun = failures.unsound(now), notes["halvings"] > 0
    before = Met(*(notes["met"][name].copy() for name in Met._fields))
    if rules.fixed:
        last, within = begun, notes["step_before"]
    else:
        rounds = np.where(now.failed & ~met.agrees(before, np.inf), FALSE_ROUNDS, ROUNDS)
        last = (notes["halvings"] >= rounds) | (begun & (2 * now.table["done"] > MOST_STEPS))
        within = np.where(last & ~unsound, np.inf, SAME)
    true = met.agrees(before, within)
    doubtful = ~true & (now.failed | (unsound & (not rules.fixed)))
    again = doubtful & ~last
    if again.any():
        on = which[again]
        note(lives.notes, "met", on, take(met, again))
        lives.notes["halvings"][on] += 1
        lives.notes["step_before"][on], lives.before[on] = now.step[again], now.rows[again]
        yield on, Repeat(now.step[again] / 2, now.tolerance[again])
    here = which[~again]
    if rules.fixed:
        back = here[begun[~again]]
        lives.rows[back], lives.notes["step"][back] = lives.before[back], lives.notes["step_before"][back]
    table = lives.cells.kernel.table(lives.rows[here])
    _set_outcome(lives.cells, table, take(met, ~again), take(before, ~again), true[~again], unsound[~again])
    lives.rows[here], lives.notes["halvings"][here], lives.notes["met"][here] = table.rows, 0, 0
    failed = np.isin(table["status"], FAILURES)
    yield here[failed], Done()
    yield from _run_twice(lives, here[~failed])


def _set_outcome(cells: Cells, table: Table, met: Met, before: Met, true: Array, unsound: Array) -> None:
    """Set the final statuses of the rows in `table`, and the time of each failure and the spin at that time.

    A failure that is not `true` is an artefact of the integration. `before` holds what the runs with steps of twice the
    length have met.
    """
    error = np.maximum(np.abs(met.spin - before.spin) / (2**cells.kernel.stepper.error_order - 1), met.doubt)
    false = np.isin(table["status"], FAILURES) | unsound
    table["status"] = np.where(true, met.kind, np.where(false, DIVERGED, table["status"]))
    for name, values in zip(FAILURE, (met.time, met.spin, error), strict=True):
        table[name] = np.where(true, values, 0.0)


def _run_twice(lives: Lives, which: Array) -> Going:
    """Run sound cells a second time, with longer steps, to the times at which they ended.

    Where a reversal grew from round-off, which makes its time and that of the end arbitrary, the second run goes to an
    end of its own.
    """
    if not lives.cells.rules.twice:
        yield which, Done()
    elif len(which):
        run = lives.take(which)
        by_itself = limited_by_round_off(run) & run.rules.settles
        yield which, Second(second_steps(run), np.where(by_itself, run.rules.t_end, run.times), by_itself)


def _after_second_run(lives: Lives, which: Array) -> Going:
    """Is it within its tolerance? The second run gives the error of the first (`sweep.engine.errors`).

    A step fixed by the configuration or by a search is kept. Otherwise the cell is repeated with a shorter step, until
    the error is below `AIM` times what the tolerance permits. If it is above all that is permitted when no shorter step
    is of use (`_shorter`), the cell has missed its tolerance, usually because the motion amplifies round-off: two runs
    may then agree by chance, so its error is at least the spread of the spins at the ends of its first run and its
    repeats. (Of four such cells, one claimed a 23rd of its error; its spread is 2.5 times too small.)

    With `tolerance: auto` this tolerance is coarse, and a cell is also repeated because its count is uncertain, until
    its own tolerance is near `TOLERANCE`. From there on only the error of the spin decides, and a count may stay
    uncertain.

    After a reversal that grew from round-off the error is unknown: the cell is not repeated because of it, though it
    may be because of its count, nor said to miss its tolerance.
    """
    first, second, notes = lives.take(which, lives.aside), lives.take(which), lives.notes
    found = compare(first, second, lives.left(which))
    coarse, count = first.rules.by_count & (first.tolerance > 2 * TOLERANCE), first.recorded(Reversals.name)
    # A count that two fine runs do not share stays uncertain. Where errors are amplified, each repeat gives chance
    # another try at two runs that agree: so a count of 47 became certain that may be 40.
    other = np.isfinite(notes["count"][which]) & (notes["count"][which] != count)
    found = found._replace(reversals=np.where(other, np.nan, found.reversals))
    permitted, known = allowed(first, first.rules.tolerance), ~limited_by_round_off(first)
    excess = np.where(known, found.spin / (AIM * permitted), 0.0)
    by_chance = known & (excess <= 1) & (OF_RATTLE * found.rattle > AIM * permitted)
    doubts = doubts_of_counts(first, found)
    if first.rules.by_count:
        excess = np.where(coarse, np.fmax(excess, _of_count(first, found, doubts)), excess)
    shorter, most = _shorter(first, found, excess, by_chance, coarse, notes[which])
    again = np.isfinite(shorter) & first.rules.repeats
    missed = ~again & known & (found.reported > permitted) & (not first.rules.fixed)
    spin = first.kernel.spins(first.rows)
    notes["lowest"][which] = lowest = np.fmin(notes["lowest"][which], spin)
    notes["highest"][which] = highest = np.fmax(notes["highest"][which], spin)
    found = found._replace(spin=np.where(missed, np.fmax(found.spin, highest - lowest), found.spin))
    lives.rows[which] = first.rows
    note(notes, "error", which, found)
    notes["doubts"][which] = doubts | Doubt.TOLERANCE * missed
    notes["repeats"][which] += again
    notes["count"][which] = np.where(first.rules.by_count & again & ~coarse, count, notes["count"][which])
    notes["most_excess"][which[again]] = most[again]
    finer = shorter**_ORDER if first.rules.by_count else np.ones(len(which))
    yield which[again], Repeat(first.step[again] / shorter[again], first.tolerance[again] / finer[again])
    yield which[~again], Done()


def _of_count(run: Cells, errors: Errors, doubts: Array) -> Array:
    """Return the factor by which errors of a coarse run have to fall for a count to be certain, shape (cells,).

    It is infinite where this is unknown: if the second run counts otherwise, or the spin cannot be predicted beyond the
    first leg. A parity that contradicts the spin says nothing at a time limit, because the spin may be about to
    reverse.
    """
    limited = run.status == TIME_LIMIT
    unpredicted = limited & (run.rules.first_leg is not None)
    another = (doubts & Doubt.STEP > 0) | ((doubts & Doubt.PARITY > 0) & ~limited) | unpredicted
    factor = np.where(doubts & Doubt.MARGIN, errors.of_margins / AIM, 0.0)
    return np.where(another | np.isnan(factor), np.inf, factor)


REPEATS = 4
"""Largest number of repeats of a cell because of its error."""

AIM = 0.5
"""Share of the tolerance to which an error is reduced: for most cells it is known within a factor of two."""

SHORTEST = 8.0
"""Largest factor by which one repeat shortens the step."""

AMPLIFIED = 1e3
"""Ratio of an error to the estimate from the energy balance above which the motion may amplify round-off as much: the
first repeat then shortens the step by `_MILD`, which shows cheaply whether shorter steps help."""

APART = 0.1
"""The same for the difference of the two spins relative to their size: above it they have nothing in common."""

# The factor of a first repeat that may not help, and the least one of further repeats: with less, chance decides
# whether the error falls.
_MILD = 2.0

# A step that is shorter by some factor has to reduce the error by at least this power of the factor. Otherwise a
# further step is of no use. With the third power, a cell whose first estimate was too small by chance was given up.
_LEAST_ORDER = 2

# A factor below which an error that does not fall says nothing.
_TOO_LITTLE = 1.5

# The order assumed for both methods when a step is shortened.
_ORDER = 5


def _shorter(
    run: Cells, errors: Errors, excess: Array, by_chance: Array, coarse: Array, notes: Array
) -> tuple[Array, Array]:
    """Return the factors by which to shorten the steps, and the largest excess with which to repeat again, (cells,).

    A factor is NaN if the error is small enough, or if no shorter step is of use: a cell misses its tolerance once a
    shorter step does not help. Another method for these cells was tried: of thirteen that `adams` missed, `dopri5`
    claimed ten, and was right in three.

    With `tolerance: auto`, a cell whose motion amplifies errors, or that two coarse runs count differently, goes at
    once to the step for `TOLERANCE`: with small factors, 20 counts of `configs/mu_b.yaml` stayed uncertain in vain.

    Parameters
    ----------
    excess : the factor by which the errors have to fall, shape (cells,); infinite where it is unknown
    by_chance : where spins agree, but not the rattles, shape (cells,)
    coarse : where a count may still need a finer tolerance, shape (cells,)
    notes : what is noted of the cells, shape (cells,)
    """
    first = notes["repeats"] == 0
    unknown, doubtful = np.isinf(excess), (errors.spin > AMPLIFIED * imbalance(run)) | (errors.apart > APART)
    shorter = np.where(unknown | by_chance, run.kernel.stepper.longer, np.fmax(excess ** (1 / _ORDER), 1.0))
    shorter = np.clip(shorter, np.where(first, 1.0, _MILD), np.where(first & doubtful, _MILD, SHORTEST))
    at_once = coarse & (unknown | doubtful | ~first)
    shorter = np.where(at_once, (run.tolerance / TOLERANCE) ** (1 / _ORDER), shorter)
    long = shorter * run.table["done"] > MOST_STEPS
    tried = ((excess > 1) | by_chance) & ~(excess > notes["most_excess"]) & ~long & (notes["repeats"] < REPEATS)
    any_excess = by_chance | (shorter < _TOO_LITTLE) | coarse
    return np.where(tried, shorter, np.nan), np.where(any_excess, np.inf, excess / shorter**_LEAST_ORDER)


def progress(lives: Sequence[Lives]) -> tuple[float, int]:
    """Return the completed share of the work, as a number of cells, and the number of failed cells.

    The length of a run that has not ended is guessed from those that have.
    """
    cells = failed = 0
    done, left = 0.0, 0.0
    for each in lives:
        stage, now, before = each.stage, each.table, each.cells.kernel.table(each.aside)["done"]
        first = np.isin(stage, (RUN, APPROACH))
        again = 1 / each.cells.kernel.stepper.longer if each.cells.rules.twice else 0.0
        ended = np.where(stage == SECOND, before, now["done"])[~first]
        usual = np.maximum(ended.mean() if len(ended) else now["goal"][first].mean(), now["done"][first])
        done += now["done"].sum() + before[stage == SECOND].sum() + again * now["done"][stage == DONE].sum()
        left += ((1 + again) * usual - now["done"][first]).sum()
        usual = np.minimum(now["goal"], again * before)
        left += np.maximum(usual - now["done"], 0)[stage == SECOND].sum()
        status = now["status"][stage == DONE]
        cells, failed = cells + len(stage), failed + int(np.isin(status, FAILURES).sum())
    return cells * (done / (done + left) if done else 0.0), failed
