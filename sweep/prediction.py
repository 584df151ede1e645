"""Predict every cell by theory: by the paper's formulas, and by the eigenvalues of a model."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import NamedTuple

import numpy as np

from sweep.grid import Array, Grid
from sweep.jit import on_all_threads, threads
from sweep.kernels.build import build_estimates
from sweep.kernels.measures import chosen
from sweep.kernels.measures.estimate import Estimate
from sweep.kernels.measures.reversal_times import ReversalTimes
from sweep.kernels.measures.reversals import Reversals
from sweep.models.general import reversal_time
from sweep.models.general.surfaces import ELLIPSOID
from sweep.models.ladder import analytic, slip, slow
from sweep.models.model import Columns, Model, Offer, Tier, take
from sweep.models.slow.estimate import estimate
from sweep.models.theory import linear, stability
from sweep.parameters import PAPER_PARAMETERS

# Most cells that a thread estimates at once.  A cell takes 0.1 ms; while the last ones finish, lanes are idle.
_SOME = 512

# Bodies whose stable ranges are found at once; a body of the slip model takes 13 µs, one of another model 0.1 ms.
_PART = 4096


class Prediction(NamedTuple):
    """Everything that is predicted for the cells and bodies of a grid."""

    variables: dict[str, Array]
    """By their names in the dataset, each over the cells or over the bodies."""
    n_c1: Array
    """n_c1+ and n_c1- of the linear theory, shape (2, bodies): infinite where the rattle decays at every spin, and NaN
    where it does not decay at rest, or where that theory does not apply; empty for a tier that is not simulated."""
    ranges: stability.StableRanges
    """Ranges of spin in which the rattle decays, of each cell."""


@np.errstate(divide="ignore", invalid="ignore", over="ignore")  # of the cells that the model does not fit
def predict(tier: Tier, grid: Grid, measure: Collection[str] = ()) -> Prediction:
    """The whole prediction, with the eigenvalues where the tier is simulated.

    Parameters
    ----------
    measure : specs of the measurements to be predicted: the time of the first reversal if "reversal_times" is among
        them, and the count by the slow equations if "estimate" is, or for their own model "reversals"
    """
    found = _formulas(tier, grid)
    if tier is slow.MODEL and Reversals.name in measure:
        found |= estimates(slip.MODEL, grid.columns())
    if not isinstance(tier, Model):
        return Prediction(found, np.empty((2, 0)), stability.StableRanges.none(0))
    bodies, place = grid.bodies()
    ranges = stability.StableRanges.none(bodies.size)
    if Offer.LINEAR in tier.offers:
        ranges = _stable_ranges(tier, bodies.columns())
    n_c1 = np.stack([ranges.high, ranges.low])
    if Offer.LINEAR in tier.offers or not tier.origin:
        found["n_c1_linear"] = np.where(np.isfinite(n_c1), n_c1, np.nan).T
    if Offer.REVERSAL_TIME in tier.offers and any(isinstance(each, ReversalTimes) for each in chosen(measure)):
        found["t_first_reversal_predicted"] = _first_reversal(tier, grid.columns(), n_c1[:, place])
    if Estimate.name in measure:
        found |= estimates(tier, grid.columns())
    return Prediction(found, n_c1, take(ranges, place))


def _first_reversal(model: Model, columns: Columns, n_c1: Array) -> Array:
    """Predict the time of the first reversal, shape (cells,).

    Only slip makes the spin of a body without couples critical.
    """
    time = np.full(n_c1.shape[1], np.nan)
    possible = np.flatnonzero(~model.impossible(columns))
    upper, lower = n_c1[:, possible] if "mu" in model.parameters else np.zeros((2, len(possible)))
    surface = model.variant.surface if model.variant else ELLIPSOID
    theirs = take(columns, possible)
    time[possible] = reversal_time.first_reversal(theirs, (upper, lower), surface)
    return time


def estimates(model: Model, columns: Columns, *, check: bool = True) -> dict[str, Array]:
    """Return the counts by the slow equations, computed on all threads; `check` as for `estimate`."""
    build_estimates(model)
    size = len(next(iter(columns.values())))
    rounds = max(1, -(-size // (_SOME * threads())))
    together = max(1, -(-size // (rounds * threads())))
    parts = [slice(begin, begin + together) for begin in range(0, size, together)]
    found = on_all_threads(lambda some: estimate(model, take(columns, some), check=check), parts)
    return dict(zip(Estimate.variables, map(np.concatenate, zip(*found, strict=True)), strict=True))


def decay_times(model: Model, grid: Grid) -> Array:
    """Return the time in which the rattle at rest decays by a factor of e, in the model's units, shape (cells,).

    It is that of the mode that decays most slowly; 0 if a mode does not decay, for a body that cannot be, and for a
    model without a linear theory.
    """

    def times(columns: Columns) -> Array:
        constants = model.constants.of(columns)
        growth = linear.growth_rate(model, constants, np.zeros_like(constants[0]))
        return np.divide(-1.0, growth, out=np.zeros((1, len(growth))), where=growth < stability.DECAYS)

    bodies, place = grid.bodies()
    if Offer.LINEAR not in model.offers:
        return np.zeros(len(place))
    return np.asarray(np.nan_to_num(_in_parts(times, model, bodies.columns(), 1)[0])[place])


def _stable_ranges(model: Model, columns: Columns) -> stability.StableRanges:
    """Ranges of spin in which the rattle of bodies decays; NaN for bodies that cannot be."""
    found = _in_parts(lambda some: np.stack(stability.stable_ranges(model, some)), model, columns, 7)
    return stability.StableRanges(*found)


def _in_parts(of: Callable[[Columns], Array], model: Model, columns: Columns, rows: int) -> Array:
    """Evaluate a function of bodies, some at a time, shape (rows, bodies); NaN for those that cannot be."""
    gone = model.impossible(columns)
    found, possible = np.full((rows, len(gone)), np.nan), np.flatnonzero(~gone)
    for begin in range(0, len(possible), _PART):
        some = possible[begin : begin + _PART]
        found[:, some] = of(take(columns, some))
    return found


def _formulas(tier: Tier, grid: Grid) -> dict[str, Array]:
    """The variables that are predicted without eigenvalues: they cost next to nothing.

    The form factor is that of the paper's bodies.  The other formulas do not apply to a tier whose spin reverses for
    ever without friction, nor where body or friction are not the paper's.
    """
    bodies, found = grid.of_bodies().columns(), dict[str, Array]()
    if set(bodies) <= PAPER_PARAMETERS.keys() and not (isinstance(tier, Model) and tier.origin):
        found["form_factor"] = analytic.form_factor(bodies)
    if Offer.FORMULAS in tier.offers:
        found["reversals_predicted"] = analytic.reversal_count(grid.columns())
        found["n_c1"] = np.stack(analytic.critical_spins(bodies), axis=1)
        found["n_c2"] = 2 * found["n_c1"]
    return found
