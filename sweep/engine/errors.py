"""Finds the error of each cell, and runs cells again that are not within the tolerance.

Each cell is run a second time, in longer steps and to the time at which it ended.  The error of this *companion* is
larger by a power of the ratio of the steps, so the difference of the two spins tells the error of the first run
(Hairer, Nørsett and Wanner 1993, section II.4).  Whatever the motion does to an error, it does to this difference too:
where it amplifies errors without bound, the difference is large, and no shorter step helps.  Where the companion counts
other reversals than the run, so might another start or another computer.

Two runs can end at the same spin by chance, however wrong both are.  Then their rattles differ: where the spin whose
energy is that of the difference of their states is large, the cell is repeated.  But the rattles agree too where the
motion has amplified all errors along one direction.  So the error is told as at least a small share of what is to be
expected: of the geometric mean of the tolerance, by which the step was chosen, and of what the energy balance tells.
For `adams` that mean tells the error to a factor of seven, whatever the motion.

Of the other ways to an error, local estimates (the embedded formula, predictor less corrector) and the energy balance
know nothing of what the motion does to an error; the balance misses it by a factor of 10 to 30.  A tangent costs twice
the first run.  Figures: docs/explanation/accuracy.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from sweep.engine import final
from sweep.engine.executor import Work
from sweep.engine.plan import Part, Plan
from sweep.engine.repeats import MOST_STEPS, decide_failures
from sweep.grid import Array
from sweep.kernels.measures.margin import EXTREMES
from sweep.kernels.method import MISSED, REPEAT
from sweep.kernels.methods import METHODS
from sweep.kernels.status import FAILURES, IMPOSSIBLE, RUNNING, SETTLED
from sweep.models.model import take

ROUNDS = 3
"""Largest number of repeats of a cell."""

AIM = 0.5
"""Share of the tolerance above which an error is made smaller: it is known within a factor of two for most cells."""

SHORTEST = 8.0
"""Largest factor by which a repeat has a shorter step.  An error that asks for more is taken as one that the motion
amplifies without bound."""

TOLERANCE_TIME = 400.0
"""The time in sqrt(c/g) to which a tolerance refers; a longer run may have a larger error, in proportion."""

ROUND_OFF = 1e-13
"""An error in spin that no shorter step makes smaller, in sqrt(g/c)."""

AMPLIFIED = 1e3
"""Ratio of an error to what the energy balance tells, beyond which no step that is shorter by more than `_MILD` is
tried: the motion amplifies errors so much that it amplifies round-off too."""

APART = 0.1
"""The same for the difference of the two spins relative to their size: they have nothing in common any more."""

OF_RATTLE = 1 / 20
"""Share of the error of the rattle beyond which spins are taken to agree by chance.  With a sixtieth, one of 300 wide
cells was off by five times the tolerance unawares.  Where nothing else is to be expected, an error is told as at least
that much."""

DECIDED = 10.0
"""How many times its estimated error the margin of a count has to be: of estimates, one in some hundred is more than
ten times too small (docs/explanation/accuracy.md)."""

_MILD = 2.0

# A step that is shorter by some factor has to make the error smaller by at least this power of the factor.  Otherwise
# there is no use in another step.
_LEAST_ORDER = 3

# The order that is expected of both methods when a step is made shorter, and how close to the limit of stability a
# longer one may come, from the share of the limit that automatic steps take.
_ORDER, _NEARER = 5, 1.1

# Ratio of steps below which two runs are too much alike to tell an error.
_ALIKE = 1.02


class Errors(NamedTuple):
    """What the companions of a run's cells tell, each of shape (cells,)."""

    spin: Array
    """Error of the spin at the end by the spin of the companion, infinite if that failed; for a run that failed, by the
    repeat that met the same failure, or NaN."""
    rattle: Array
    """Error of the rattle, as that of the spin with its energy; NaN where there is no companion."""
    least: Array
    """What the error of the spin is told to be at least; NaN where there is no companion."""
    reversals: Array
    """The companions' counts; NaN where there is none."""
    apart: Array
    """Difference of the spins relative to the spins themselves."""
    overshoot: Array
    """Estimated error of the margin to one reversal fewer; NaN where it is not measured, or there is no companion."""
    nearest_approach: Array
    """The same to one more."""

    @property
    def told(self) -> Array:
        """Estimated error of the spin at the end, shape (cells,)."""
        return np.asarray(np.fmax(self.spin, self.least))


def keep_tolerance(job: Plan, work: Work) -> Errors:
    """Find the error of each cell of `job`, whose runs have all ended, and repeat cells above the tolerance, in place.

    A step that the configuration fixes stays, and so does that of a search.  Otherwise it is made shorter, `ROUNDS`
    times at most, until the error is below `AIM` times what the tolerance allows.  A cell whose error stays above the
    tolerance is `MISSED`.

    While `work` goes on, the cells whose error is not known yet are `RUNNING`.
    """
    found = Errors(*np.full((len(Errors._fields), sum(grid.size for grid in job.grids)), np.nan))
    waiting = []
    for part in job.parts:
        rows = np.flatnonzero(~part.failed)
        first, table = part.take(rows), part.kernel.table(part.images)
        waiting.append((part, rows, first))
        table["status"][rows] = RUNNING
        met = np.flatnonzero(table["failed_at"] > 0)
        found.spin[part.cells[met]] = table["failed_error"][met]
    for part, rows, first in waiting:
        _keep(part, rows, first, found, work)
    found.spin[np.isinf(found.spin)] = np.nan
    return found


def allowed(part: Part) -> Array:
    """Error in spin that the tolerance allows at the ends of the runs, in the model's units, shape (cells,)."""
    unit = part.config.equations.spin_unit(part.columns)
    longer = np.maximum(part.times * unit / TOLERANCE_TIME, 1)
    return np.asarray(max(part.config.integrator.tolerance, ROUND_OFF) * longer * unit)


def imbalance(part: Part) -> Array:
    """Error of the energy balance as one in spin, at the fastest spin that the energy allows, shape (cells,).

    Infinite if the run does not measure it.
    """
    if "energy_error" not in part.kernel.measure:
        return np.full(len(part.cells), np.inf)
    table = part.kernel.table(part.images)
    scale = np.sqrt(2 * part.inertia * table["energy_start"])
    return np.asarray(np.divide(table["violation"], scale, out=np.zeros(len(scale)), where=scale > 0))


def _keep(part: Part, rows: Array, now: Part, found: Errors, work: Work) -> None:
    """Decide the cells of `part` with the indices `rows`; `now` are these cells after their first run.

    Their errors are put into those `found`, which are over all cells.
    """
    rules, most = part.step_rule[rows], np.full(len(rows), np.inf)
    for round_ in range(ROUNDS + 1):
        name = f"{part.method} repeat {round_}"
        other = companions(now)
        work.run(f"{name} companion", other.kernel, other.images)
        errors, limit = compare(now, other), allowed(now)
        shorter = np.fmax((errors.spin / (AIM * limit)) ** (1 / _ORDER), 1.0)
        large = errors.spin > AIM * limit
        by_chance = ~large & (OF_RATTLE * errors.rattle > AIM * limit)
        shorter = np.where(np.isinf(errors.spin) | by_chance, METHODS[part.method].companion, shorter)
        hopeless = (shorter > SHORTEST) | (errors.spin > most)
        hopeless |= (shorter > _MILD) & ((errors.spin > AMPLIFIED * imbalance(now)) | (errors.apart > APART))
        long = np.fmin(shorter, SHORTEST) * now.kernel.table(now.images)["done"] > MOST_STEPS
        again = (large | by_chance) & ~hopeless & ~long & (round_ < ROUNDS) & (not part.fixed) & part.config.repeats
        missed = (errors.told > limit) & (not part.fixed)
        done = now.take(~again)
        part.put(rows[~again], done, np.where(missed, MISSED, rules)[~again])
        for whole, some in zip(found, take(errors, ~again), strict=True):
            whole[part.cells[rows[~again]]] = some
        if not again.any():
            return
        most = np.where(by_chance, np.inf, errors.spin / shorter**_LEAST_ORDER)[again]
        rows = rows[again]
        now = now.take(again).start(shorter[again])
        rules = np.full(len(rows), REPEAT)
        name = f"{part.method} repeat {round_ + 1}"
        final.run(now, work, name)
        decide_failures(now, work, name)
        failed = now.failed
        part.put(rows[failed], now.take(failed), now.step_rule[failed])
        rows, now, most, rules = rows[~failed], now.take(~failed), most[~failed], rules[~failed]


def companions(part: Part) -> Part:
    """The companions at t = 0 of all cells of `part`, none of which has failed."""
    if not len(part.cells):
        return part
    step = part.kernel.table(part.images)["step"] * _ratio(part)
    return replace(part, images=part.starting(step, part.times))


def compare(part: Part, companion: Part) -> Errors:
    """Compare the cells of `part` with their companions, when all have ended."""
    kernel, both = part.kernel, (part.images, companion.images)
    table, other = map(kernel.table, both)
    (states, constants), (others, _) = map(kernel.unpack, both)
    with np.errstate(invalid="ignore", over="ignore"):  # the states of a companion that failed
        spins = [kernel.model.energy(each, constants)[0] for each in (states, others)]
        _, energy, inertia = kernel.model.energy(states - others, constants)
        rattle = np.sqrt(2 * np.abs(energy) / inertia)
    ratio = other["step"] / table["step"]
    larger = np.where(ratio > _ALIKE, ratio, np.nan) ** METHODS[part.method].error_order - 1
    failed = np.isin(other["status"], FAILURES)
    difference, size = np.abs(spins[0] - spins[1]), np.abs(spins[0]) + np.abs(spins[1])
    apart = np.divide(difference, size, out=np.zeros_like(size), where=~failed & (size > 0))
    counts = other["reversals"] if "reversals" in kernel.measure else np.nan
    margins = np.full((len(EXTREMES), len(failed)), np.nan)
    if "margin" in kernel.measure:
        margins = np.stack([np.abs(table[name] - other[name]) for name in EXTREMES]) / larger
    margins[:, failed] = np.nan
    spin = np.where(failed, np.inf, difference / larger)
    rattle = np.where(failed, np.nan, rattle / larger)
    return Errors(spin, rattle, _least(part, rattle), np.where(failed, np.nan, counts), apart, *margins)


def _least(part: Part, rattle: Array) -> Array:
    """What the errors of the cells of `part` are at least, shape (cells,), if that of the rattle is `rattle`."""
    share, balance = METHODS[part.method].least_error, imbalance(part)
    known = np.isfinite(balance + rattle) & (share > 0) & (not part.fixed)
    expected = np.sqrt(np.where(known, balance, 0.0) * allowed(part))
    return np.where(known, share * expected, OF_RATTLE * rattle)


def _ratio(part: Part) -> Array:
    """Ratio of the companions' steps to those of the cells, shape (cells,), within what is stable."""
    method, ratio = METHODS[part.method], np.full(len(part.cells), METHODS[part.method].companion)
    if method.stable_step is None:
        return ratio
    with np.errstate(divide="ignore"):
        stable = _NEARER * method.stable_step(part.config.equations, part.columns)
    return np.asarray(np.clip(stable / part.kernel.table(part.images)["step"], _NEARER, ratio))


def results(job: Plan, errors: Errors | None) -> dict[str, Array]:
    """Collect what was simulated and, with `errors`, how exact it is: by name, each over all cells of `job`."""
    found = job.results()
    if errors is None:
        return found
    found["spin_error"] = errors.told
    if "reversals" in found:
        sound = ~np.isin(found["status"], (*FAILURES, IMPOSSIBLE))
        found["sensitive"] = sound & (errors.reversals != found["reversals"])  # a companion that fails counts NaN
    if "margin_more" in found:
        found["decided"] = _decided(found, errors) & _consistent(job, found)
    return found


def _decided(found: Mapping[str, Array], errors: Errors) -> Array:
    """Find the counts that are final and certain, shape (cells,)."""
    firm = (found["sensitive"] == 0) & (found["window_dependent"] == 0) & (found["status"] == SETTLED)
    below = (found["reversals"] == 0) | (found["margin_fewer"] > DECIDED * errors.overshoot)
    return np.asarray(firm & below & (found["margin_more"] > DECIDED * errors.nearest_approach))


def _consistent(job: Plan, found: Mapping[str, Array]) -> Array:
    """Tell where the parity of the count is that of the signs of the spin at the start and the end, shape (cells,)."""
    consistent = np.zeros(len(found["reversals"]), bool)
    for part in job.parts:
        model = part.config.equations
        start, _, _ = model.energy(model.start(part.columns), model.constants.of(part.columns))
        turned = start * found["spin_final"][part.cells]
        odd = found["reversals"][part.cells] % 2 == 1
        consistent[part.cells] = np.where(odd, turned <= 0, turned >= 0)
    return consistent
