"""Estimates the error of each cell from a second run.

A second run takes longer steps, to the time at which the first run ended. Its error is larger by a power of the ratio
of the steps, so the difference of the two spins gives the error of the first run (Hairer, Nørsett and Wanner 1993,
section II.4). Whatever the motion does to an error, it does to this difference too: if it amplifies errors without
bound, the difference is large, and no shorter step helps. If the second run counts differently from the first, a
slightly different start or another computer might do so too.

A count is judged by where the spins of both runs will rest, as the margins are, and not by their spins at the end of
the run, which is in mid-swing: there a delay of the last reversal looks like a large error, or like another count.

Two runs can end at the same spin by chance, however wrong both are. Then their rattles differ, as the spin with the
energy of the difference of their states shows. But the rattles agree too if the motion has amplified all errors along
one direction. The reported error is therefore at least a small share of the expected one: of the geometric mean of the
tolerance, from which the step was chosen, and of the estimate from the energy balance. For `adams` that mean gives the
error to a factor of seven, whatever the motion.

The other error estimates are worse: local ones (the embedded formula, predictor less corrector) and the energy balance
know nothing of what the motion does to an error; the balance misses it by a factor of 10 to 30. A tangent costs twice
the first run. Figures: docs/explanation/accuracy.md.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sweep.engine.cells import Cells
from sweep.engine.plan import TOLERANCE_TIME
from sweep.grid import Array
from sweep.kernels.measures.margin import EXTREMES, Margin, last_arc, margins
from sweep.kernels.measures.noise import RoundOff
from sweep.kernels.measures.resting_spin import endings, ends_as_predicted, only
from sweep.kernels.measures.reversals import Reversals
from sweep.kernels.status import SETTLED, Doubt
from sweep.models.slow.estimate import Ending

ROUND_OFF = 1e-13
"""An error in spin that no shorter step reduces, in sqrt(g/c)."""

CLEAR = 10.0
"""Required ratio of the margin of a count to its estimated error: about one in a hundred estimates is more than ten
times too small (docs/explanation/accuracy.md)."""

OF_RATTLE = 1 / 20
"""Share of the error of the rattle above which spins are assumed to agree by chance. With a sixtieth, one of 300
wide cells was off by five times the tolerance unnoticed. Where no other estimate applies, this is the least reported
error."""

# How close to the limit of stability a longer step may come, starting from the share of it used by automatic steps.
_NEARER = 1.1

# Ratio of steps below which two runs are too similar to give an error.
_ALIKE = 1.02


class Errors(NamedTuple):
    """Results of comparing first and second runs, each of shape (cells,)."""

    spin: Array
    """Error of the final spin from the spin of the second run, infinite if that failed; for a run that failed, from the
    repeat that met the same failure, or NaN."""
    rattle: Array
    """Error of the rattle, as the spin with its energy; NaN without a second run."""
    least: Array
    """Lower bound on the reported error of the spin; NaN without a second run."""
    reversals: Array
    """Counts of the second runs, with the reversals that are still to come; NaN where there is none."""
    of_margins: Array
    """Ten times the estimated errors of the margins relative to the margins, the larger of both: above 1, another count
    is possible. NaN if they are not measured, or without a second run."""
    apart: Array
    """Difference of the spins relative to the spins themselves."""

    @property
    def reported(self) -> Array:
        """Return the estimated error of the final spin, shape (cells,)."""
        return np.asarray(np.fmax(self.spin, self.least))


def allowed(part: Cells, tolerance: float | Array) -> Array:
    """Return the error in spin that a tolerance permits at the ends of the runs, in the model's units, (cells,)."""
    unit = part.model.spin_unit(part.columns)
    longer = np.maximum(part.times * unit / TOLERANCE_TIME, 1)
    return np.asarray(np.fmax(tolerance, ROUND_OFF) * longer * unit)


def limited_by_round_off(part: Cells) -> Array:
    """Return in which cells a reversal grew from round-off, shape (cells,)."""
    return np.asarray(part.recorded(RoundOff.name) > 0)


def imbalance(part: Cells) -> Array:
    """Return the energy balance's error as one in spin, at the fastest spin that the energy allows, shape (cells,).

    It is infinite if the run does not measure it.
    """
    if "energy_error" not in part.kernel.measure:
        return np.full(len(part.cells), np.inf)
    table = part.table
    scale = np.sqrt(2 * part.inertia * table["energy_start"])
    return np.asarray(np.divide(table["violation"], scale, out=np.zeros(len(scale)), where=scale > 0))


def compare(first: Cells, second: Cells, left: Ending) -> Errors:
    """Compare the first runs of cells with their second runs, once all have ended.

    `left` is what is left to come of the spins of the first runs.
    """
    kernel, table, other = first.kernel, first.table, second.table
    (states, constants), (others, _) = kernel.unpack(first.rows), kernel.unpack(second.rows)
    with np.errstate(invalid="ignore", over="ignore"):  # the second run may have failed
        spins = [kernel.model.energy(each, constants)[0] for each in (states, others)]
        _, energy, inertia = kernel.model.energy(states - others, constants)
        rattle = np.sqrt(2 * np.abs(energy) / inertia)
    ratio = other["step"] / table["step"]
    larger = np.where(ratio > _ALIKE, ratio, np.nan) ** kernel.stepper.error_order - 1
    difference, size = np.abs(spins[0] - spins[1]), np.abs(spins[0]) + np.abs(spins[1])
    apart = np.divide(difference, size, out=np.zeros_like(size), where=~second.failed & (size > 0))
    spin = np.where(second.failed, np.inf, difference / larger)
    rattle = np.where(second.failed, np.nan, rattle / larger)
    counts, of_margins = _of_counts(first, second, left, larger)
    return Errors(spin, rattle, _least(first, rattle), counts, of_margins, apart)


def _of_counts(first: Cells, second: Cells, left: Ending, larger: Array) -> tuple[Array, Array]:
    """Return `reversals` and `of_margins` of `Errors`, each of shape (cells,).

    `larger` is the ratio of the difference of two runs to the error, shape (cells,). Two runs may agree in one margin
    by chance, however wrong both are; that they agree in both is less likely. So the larger error counts for both,
    unless a couple damps the spin, and with it the error of the overshoot.
    """
    if Reversals.name not in first.kernel.measure:
        return np.full(len(larger), np.nan), np.full(len(larger), np.nan)
    predicted = ends_as_predicted(first.table, left) & ~second.failed
    ours = last_arc(first.table, only(predicted, left))
    theirs = last_arc(second.table, endings(second.table, predicted))
    # Round-off does not shrink with the step.
    larger = np.where(limited_by_round_off(first), np.fmin(larger, 1.0), larger)
    overshoot, nearest = (np.abs(getattr(ours, name) - getattr(theirs, name)) / larger for name in EXTREMES)
    both, more, fewer = np.fmax(overshoot, nearest), *margins(first.table, left)
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = (nearest if first.model.damped else both) / more
        relative = np.where(first.table["reversals"] > 0, np.maximum(relative, both / fewer), relative)
    count, of_margins = np.where(second.failed, np.nan, [theirs.reversals, CLEAR * relative])
    return count, of_margins


def doubts_of_counts(cells: Cells, errors: Errors) -> Array:
    """Return the doubts that second runs raise about the counts of first runs, bits of `Doubt`, shape (cells,)."""
    count = cells.recorded(Reversals.name)
    doubts: Array = np.zeros(len(count), int)
    if Reversals.name in cells.kernel.measure:
        doubts |= Doubt.STEP * (errors.reversals != count)  # a failed second run has the count NaN
    if Margin.name in cells.kernel.measure:
        doubts |= Doubt.MARGIN * ((cells.status == SETTLED) & ~(errors.of_margins < 1))
        doubts |= Doubt.PARITY * ~_consistent(cells, count)
    return doubts


def _consistent(cells: Cells, count: Array) -> Array:
    """Return where the parity of the count matches the signs of the spin at start and end, shape (cells,)."""
    model, columns = cells.model, cells.columns
    start, _, _ = model.energy(model.start(columns), model.constants.of(columns))
    turned = start * cells.kernel.spins(cells.rows)
    return np.asarray(np.where(count % 2 == 1, turned <= 0, turned >= 0))


def _least(part: Cells, rattle: Array) -> Array:
    """Return lower bounds on the errors of the cells of `part`, shape (cells,), given the error of the rattle."""
    share, balance = part.kernel.stepper.least_error, imbalance(part)
    known = np.isfinite(balance + rattle) & (share > 0) & (not part.rules.fixed)
    expected = np.sqrt(np.where(known, balance, 0.0) * allowed(part, part.tolerance))
    return np.where(known, share * expected, OF_RATTLE * rattle)


def second_steps(part: Cells) -> Array:
    """Return the steps of the second runs, in sqrt(c/g), shape (cells,): longer, but within the stability limit."""
    method = part.kernel.stepper
    with np.errstate(divide="ignore"):
        stable = _NEARER * method.stable_step(part.table["decay"])
    return np.asarray(part.table["step"] * np.clip(stable / part.table["step"], _NEARER, method.longer))
