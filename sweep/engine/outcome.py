"""Collects the results of cells whose lives have ended: the simulated variables, and the reasons to doubt them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from sweep.engine.errors import Errors
from sweep.engine.lives import Lives
from sweep.engine.plan import Plan
from sweep.grid import Array
from sweep.kernels.methods import AUTO
from sweep.kernels.status import COUNT_DOUBTS, IMPOSSIBLE, SETTLED, TIME_LIMIT, Doubt
from sweep.results import dataset

CLEAR = 10.0
"""Required ratio of the margin of a count to its estimated error: about one in a hundred estimates is more than ten
times too small (docs/explanation/accuracy.md)."""


def errors_of(lives: Lives) -> Errors:
    """Return the errors of all cells, as far as known."""
    errors, table = Errors(*(lives.notes["error"][name] for name in Errors._fields)), lives.table
    spin = np.where(np.isinf(errors.spin), np.nan, errors.spin)
    return errors._replace(spin=np.where(table["failed_at"] > 0, table["failed_error"], spin))


def _simulated(job: Plan, lives: Sequence[Lives]) -> dict[str, Array]:
    """Collect the simulated variables by name, each over all cells."""
    size = sum(grid.size for grid in job.grids)
    arrays: dict[str, Array] = {}
    for each in lives:
        part = each.take()
        found = dataset.measured(part.kernel, part.rows, part.rules.t_end, each.left())
        found["step_rule"] = part.step_rule
        if job.config.integrator.method == AUTO:
            found["method"] = np.full(len(part.cells), part.kernel.stepper.code)
        for name, values in found.items():
            nothing = np.nan if dataset.VARIABLES[name].dtype.startswith("float") else 0
            blank = np.full((size, *values.shape[1:]), nothing)
            arrays.setdefault(name, blank)[part.cells] = values
    simulated = np.concatenate([part.cells for part in job.parts])
    arrays["status"][np.delete(np.arange(size), simulated)] = IMPOSSIBLE
    return arrays


def results(job: Plan, lives: Sequence[Lives]) -> dict[str, Array]:
    """Collect the simulated variables of `job` by name, over all cells, with accuracies where cells were run twice."""
    found = _simulated(job, lives)
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
        against[Doubt.STEP] = errors.reversals != found["reversals"]  # a failed second run has the count NaN
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
