"""Estimates the error of each cell, and repeats cells that exceed the tolerance.

Each cell is run a second time, with longer steps and to the time at which it ended. The error of this *companion* is
larger by a power of the ratio of the steps, so the difference of the two spins gives the error of the first run
(Hairer, Nørsett and Wanner 1993, section II.4). Whatever the motion does to an error, it does to this difference too:
if it amplifies errors without bound, the difference is large, and no shorter step helps. If the companion counts
differently from the run, a slightly different start or another computer might do so too.

A count is judged by where the spins of both runs will rest, as the margins are, and not by their spins at the end of
the run, which is in mid-swing: there a delay of the last reversal looks like a large error, or like another count.

After a reversal that grew from round-off no difference of two runs is an error: both have the same floor, so both are
early. The error of such a cell is unknown: it is neither repeated nor said to miss its tolerance.

Two runs can end at the same spin by chance, however wrong both are. Then their rattles differ: if the spin with the
energy of the difference of their states is large, the cell is repeated. But the rattles agree too if the motion has
amplified all errors along one direction. The reported error is therefore at least a small share of the expected one: of
the geometric mean of the tolerance, from which the step was chosen, and of the estimate from the energy balance. For
`adams` that mean gives the error to a factor of seven, whatever the motion.

A cell misses its tolerance once a shorter step does not help. Another method for these cells was tried: of nine that
`adams` missed, `dopri5` claimed seven, and was right in three.

The other error estimates are worse: local ones (the embedded formula, predictor less corrector) and the energy balance
know nothing of what the motion does to an error; the balance misses it by a factor of 10 to 30. A tangent costs twice
the first run. Figures: docs/explanation/accuracy.md.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from sweep.engine import ending
from sweep.engine.cells import COMPANION, ERRORS, Cells, Lives
from sweep.engine.failures import MOST_STEPS
from sweep.engine.plan import TOLERANCE_TIME, Plan
from sweep.grid import Array
from sweep.kernels.measures.margin import last_arc
from sweep.kernels.measures.noise import RoundOff
from sweep.kernels.measures.resting_spin import ends_as_predicted
from sweep.kernels.measures.reversals import Reversals
from sweep.kernels.method import REPEAT
from sweep.kernels.methods import METHODS
from sweep.kernels.status import COUNT_DOUBTS, FAILURES, SETTLED, TIME_LIMIT, Doubt
from sweep.models.model import stack

ROUNDS = 4
"""Largest number of repeats of a cell."""

AIM = 0.5
"""Share of the tolerance to which an error is reduced: for most cells it is known within a factor of two."""

SHORTEST = 8.0
"""Largest factor by which one repeat shortens the step."""

ROUND_OFF = 1e-13
"""An error in spin that no shorter step reduces, in sqrt(g/c)."""

AMPLIFIED = 1e3
"""Ratio of an error to the estimate from the energy balance above which the motion may amplify round-off as much: the
first repeat then shortens the step by `_MILD`, which shows cheaply whether shorter steps help."""

APART = 0.1
"""The same for the difference of the two spins relative to their size: above it they have nothing in common."""

OF_RATTLE = 1 / 20
"""Share of the error of the rattle above which spins are assumed to agree by chance. With a sixtieth, one of 300
wide cells was off by five times the tolerance unnoticed. Where no other estimate applies, this is the least reported
error."""

CLEAR = 10.0
"""Required ratio of the margin of a count to its estimated error: about one in a hundred estimates is more than ten
times too small (docs/explanation/accuracy.md)."""

# The factor of a first repeat that may not help, and the least one of further repeats: with less, chance decides
# whether the error falls.
_MILD = 2.0

# A step that is shorter by some factor has to reduce the error by at least this power of the factor. Otherwise a
# further step is of no use. With the third power, a cell whose first estimate was too small by chance was given up.
_LEAST_ORDER = 2

# A factor below which an error that does not fall says nothing.
_TOO_LITTLE = 1.5

# The order assumed for both methods when a step is shortened, and how close to the limit of stability a longer one may
# come, starting from the share of the limit used by automatic steps.
_ORDER, _NEARER = 5, 1.1

# Ratio of steps below which two runs are too similar to give an error.
_ALIKE = 1.02


class Errors(NamedTuple):
    """Results of comparing cells with their companions, each of shape (cells,)."""

    spin: Array
    """Error of the final spin from the spin of the companion, infinite if that failed; for a run that failed, from the
    repeat that met the same failure, or NaN."""
    rattle: Array
    """Error of the rattle, as the spin with its energy; NaN without a companion."""
    least: Array
    """Lower bound on the reported error of the spin; NaN without a companion."""
    reversals: Array
    """Counts of the companions, with the reversals that are still to come; NaN where there is none."""
    overshoot: Array
    """Estimated error of the margin to one reversal fewer; NaN if it is not measured, or without a companion."""
    nearest_approach: Array
    """Estimated error of the margin to one reversal more."""
    apart: Array
    """Difference of the spins relative to the spins themselves."""

    @property
    def reported(self) -> Array:
        """Return the estimated error of the final spin, shape (cells,)."""
        return np.asarray(np.fmax(self.spin, self.least))


def accompany(lives: Lives, which: Array) -> None:
    """Start the companions of the cells `which`, setting their own runs aside."""
    run = lives.take(which)
    lives.aside[which] = run.rows
    lives.enter(which, COMPANION, companions(run), settles=_ends_by_itself(run))


def after_companion(lives: Lives, which: Array) -> Array:
    """Estimate the errors of the cells `which`, whose companions have ended; those above the tolerance run again.

    A step fixed by the configuration or by a search is kept. Otherwise the step is shortened, at most `ROUNDS` times,
    until the error is below `AIM` times the tolerance.  A cell whose error stays above the tolerance has `missed` it.

    Returns
    -------
    The indices of the cells that are not repeated.
    """
    notes, rules, method = lives.notes, lives.cells.rules, METHODS[lives.cells.method]
    now, other = lives.cells.take(which, lives.aside[which]), lives.take(which)
    errors, limit, most = compare(now, other), allowed(now), notes["most_error"][which]
    shorter = np.fmax((errors.spin / (AIM * limit)) ** (1 / _ORDER), 1.0)
    large = errors.spin > AIM * limit
    by_chance = ~large & (OF_RATTLE * errors.rattle > AIM * limit)
    shorter = np.where(np.isinf(errors.spin) | by_chance, method.longer, shorter)
    first = notes["repeats"][which] == 0
    doubtful = first & ((errors.spin > AMPLIFIED * imbalance(now)) | (errors.apart > APART))
    shorter = np.clip(shorter, np.where(first, 1.0, _MILD), np.where(doubtful, _MILD, SHORTEST))
    hopeless = errors.spin > most
    long = shorter * now.kernel.table(now.rows)["done"] > MOST_STEPS
    known = ~limited_by_round_off(now)
    again = (large | by_chance) & known & ~hopeless & ~long & (notes["repeats"][which] < ROUNDS) & rules.repeats
    if not rules.fixed:
        notes["missed"][which] = ~again & ((errors.reported > limit) & known | (notes["missed"][which] > 0))
    lives.cells.rows[which] = now.rows
    lives.note(which, ERRORS, stack(errors).T)
    on = which[again]
    any_error = by_chance | (shorter < _TOO_LITTLE)
    notes["most_error"][on] = np.where(any_error, np.inf, errors.spin / shorter**_LEAST_ORDER)[again]
    notes["repeats"][on] += 1
    lives.note(on, ERRORS, np.nan)
    notes["step_rule"][on] = REPEAT
    notes["step"][on] /= shorter[again]
    ending.begin(lives, on, lives.take(on).start())
    return which[~again]


def allowed(part: Cells) -> Array:
    """Return the permitted error in spin at the ends of the runs, in the model's units, shape (cells,)."""
    unit = part.model.spin_unit(part.columns)
    longer = np.maximum(part.times * unit / TOLERANCE_TIME, 1)
    return np.asarray(max(part.rules.tolerance, ROUND_OFF) * longer * unit)


def limited_by_round_off(part: Cells) -> Array:
    """Return in which cells a reversal grew from round-off, shape (cells,)."""
    return np.asarray(part.recorded(RoundOff.name) > 0)


def _ends_by_itself(part: Cells) -> Array:
    """Return whose companions run to their own ends, because round-off decides when the cells end, shape (cells,)."""
    return limited_by_round_off(part) & part.rules.settles


def imbalance(part: Cells) -> Array:
    """Return the energy balance's error as one in spin, at the fastest spin that the energy allows, shape (cells,).

    It is infinite if the run does not measure it.
    """
    if "energy_error" not in part.kernel.measure:
        return np.full(len(part.cells), np.inf)
    table = part.kernel.table(part.rows)
    scale = np.sqrt(2 * part.inertia * table["energy_start"])
    return np.asarray(np.divide(table["violation"], scale, out=np.zeros(len(scale)), where=scale > 0))


def companions(part: Cells) -> Array:
    """Return state rows at t = 0 of the companions of cells, none of which has failed.

    They run as long as the cells, or to their own ends.
    """
    until = np.where(_ends_by_itself(part), part.rules.t_end, part.times)
    return part.start(part.kernel.table(part.rows)["step"] * _ratio(part), until)


def errors_of(lives: Lives) -> Errors:
    """Return the errors of all cells, as far as known."""
    table = lives.cells.kernel.table(lives.cells.rows)
    errors = Errors(*lives.notes.columns(ERRORS).T)
    spin = np.where(np.isinf(errors.spin), np.nan, errors.spin)
    return errors._replace(spin=np.where(table["failed_at"] > 0, table["failed_error"], spin))


def compare(part: Cells, companion: Cells) -> Errors:
    """Compare the cells of `part` with their companions, once all have ended."""
    kernel, both = part.kernel, (part.rows, companion.rows)
    table, other = map(kernel.table, both)
    (states, constants), (others, _) = map(kernel.unpack, both)
    with np.errstate(invalid="ignore", over="ignore"):  # the companion may have failed
        spins = [kernel.model.energy(each, constants)[0] for each in (states, others)]
        _, energy, inertia = kernel.model.energy(states - others, constants)
        rattle = np.sqrt(2 * np.abs(energy) / inertia)
    ratio = other["step"] / table["step"]
    larger = np.where(ratio > _ALIKE, ratio, np.nan) ** METHODS[part.method].error_order - 1
    failed = np.isin(other["status"], FAILURES)
    difference, size = np.abs(spins[0] - spins[1]), np.abs(spins[0]) + np.abs(spins[1])
    apart = np.divide(difference, size, out=np.zeros_like(size), where=~failed & (size > 0))
    spin = np.where(failed, np.inf, difference / larger)
    rattle = np.where(failed, np.nan, rattle / larger)
    counts, overshoot, nearest = _of_counts(part, companion, larger, failed)
    return Errors(spin, rattle, _least(part, rattle), counts, overshoot, nearest, apart)


def _of_counts(part: Cells, companion: Cells, larger: Array, failed: Array) -> Array:
    """Return the counts of the companions and the errors of both margins, shape (3, cells); NaN where unknown.

    Parameters
    ----------
    larger : ratio of the difference of two runs to the error, shape (cells,)
    failed : mask of the cells whose companions have failed, shape (cells,)
    """
    if Reversals.name not in part.kernel.measure:
        return np.full((3, len(failed)), np.nan)
    table, other = (part.kernel.table(each.rows) for each in (part, companion))
    predicted = ends_as_predicted(table) & ~failed
    ours, theirs = last_arc(table, predicted), last_arc(other, predicted)
    # Round-off does not shrink with the step.
    larger = np.where(limited_by_round_off(part), np.fmin(larger, 1.0), larger)
    margins = [np.abs(one - another) / larger for one, another in zip(ours[1:], theirs[1:], strict=True)]
    return np.where(failed, np.nan, [theirs.reversals, *margins])


def _least(part: Cells, rattle: Array) -> Array:
    """Return lower bounds on the errors of the cells of `part`, shape (cells,), given the error of the rattle."""
    share, balance = METHODS[part.method].least_error, imbalance(part)
    known = np.isfinite(balance + rattle) & (share > 0) & (not part.rules.fixed)
    expected = np.sqrt(np.where(known, balance, 0.0) * allowed(part))
    return np.where(known, share * expected, OF_RATTLE * rattle)


def _ratio(part: Cells) -> Array:
    """Return the ratio of the companions' steps to the cells' steps, shape (cells,), within the stability limit."""
    method = part.kernel.stepper
    with np.errstate(divide="ignore"):
        stable = _NEARER * method.stable_step(part.model.fastest_decay(part.columns))
    return np.asarray(np.clip(stable / part.kernel.table(part.rows)["step"], _NEARER, method.longer))


def results(job: Plan, lives: Sequence[Lives]) -> dict[str, Array]:
    """Collect the simulated variables of `job` by name, over all cells, with accuracies where cells were run twice."""
    found = job.results()
    counted, twice = "reversals" in found, any(part.rules.twice for part in job.parts)
    against = {Doubt.TIME_LIMIT: found["status"] == TIME_LIMIT} if counted else {}
    if twice:
        against |= _estimated(job, lives, found)
    for bit, where in against.items():
        found["doubts"] |= bit * where
    sound = np.isin(found["status"], (SETTLED, TIME_LIMIT))
    found["doubts"][~sound] = 0
    if Doubt.MARGIN in against:
        found["certain"] = sound & (found["doubts"] & COUNT_DOUBTS == 0)
    return found


def _estimated(job: Plan, lives: Sequence[Lives], found: dict[str, Array]) -> dict[Doubt, Array]:
    """Add the errors of cells that were run twice to `found`; return which cells they give reason to doubt."""
    errors = Errors(*np.full((len(Errors._fields), len(found["status"])), np.nan))
    missed = np.zeros(len(found["status"]), bool)
    for each in lives:
        for whole, part in zip(errors, errors_of(each), strict=True):
            whole[each.cells.cells] = part
        missed[each.cells.cells] = each.notes["missed"]
    found["spin_error"] = np.where(found["doubts"] & Doubt.ROUND_OFF, np.nan, errors.reported)
    against = {Doubt.TOLERANCE: missed}
    if "reversals" in found:
        against[Doubt.STEP] = errors.reversals != found["reversals"]  # a failed companion has the count NaN
    if "margin_more" in found:
        clear = _clear(found, errors, slows=job.config.equations.slows)
        against[Doubt.MARGIN] = (found["status"] == SETTLED) & ~clear
        against[Doubt.PARITY] = ~_consistent(job, found)
    return against


def _clear(found: Mapping[str, Array], errors: Errors, *, slows: bool) -> Array:
    """Return where both margins of a count are larger than ten times their errors, shape (cells,).

    Two runs may agree in one margin by chance, however wrong both are; that they agree in both is less likely. So the
    larger error counts for both, unless a couple slows the spin, and with it the error of the overshoot.
    """
    larger = np.fmax(errors.overshoot, errors.nearest_approach)
    below = (found["reversals"] == 0) | (found["margin_fewer"] > CLEAR * larger)
    return np.asarray(below & (found["margin_more"] > CLEAR * (errors.nearest_approach if slows else larger)))


def _consistent(job: Plan, found: Mapping[str, Array]) -> Array:
    """Return where the parity of the count matches the signs of the spin at start and end, shape (cells,)."""
    consistent = np.zeros(len(found["reversals"]), bool)
    for part in job.parts:
        model = part.model
        start, _, _ = model.energy(model.start(part.columns), model.constants.of(part.columns))
        turned = start * found["spin_final"][part.cells]
        odd = found["reversals"][part.cells] % 2 == 1
        consistent[part.cells] = np.where(odd, turned <= 0, turned >= 0)
    return consistent
