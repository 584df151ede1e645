"""Predict every cell by theory: by the paper's formulas, and by the eigenvalues of a model."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from sweep.grid import Array, Grid
from sweep.kernels.measures.first_reversal import FirstReversal
from sweep.models.general import reversal_time, variants
from sweep.models.ladder import analytic
from sweep.models.model import FORMULAS, LINEAR, REVERSAL_TIME, Model, Tier
from sweep.models.theory import stability
from sweep.parameters import PAPER_PARAMETERS

# Bodies whose eigenvalues are found at once (about 60 MB); a body takes 0.1 ms.
_PART = 4096


@dataclass(frozen=True)
class Formulas:
    """The paper's predictions for bodies with friction."""

    reversals: Array
    """Predicted number of reversals n_r, over the cells."""
    n_c1: tuple[Array, Array]
    """n_c1+ and n_c1-, over the bodies; n_c2± is twice n_c1±."""


@dataclass(frozen=True)
class Stability:
    """The spins at which a model's rattle decays."""

    n_c1: tuple[Array, Array]
    """n_c1+ and n_c1- of the linear theory, over the bodies: infinite where the rattle decays at every spin, NaN where
    it does not decay at rest.  NaN too for a model to which the linear theory does not apply."""
    ranges: Array
    """Ranges of spin in which the rattle decays, shape (6, cells), as `stability.stable_ranges` gives them."""
    applies: bool = True
    """Whether n_c1 is worth telling: not of a user's model to which the linear theory does not apply."""


@dataclass(frozen=True)
class ReversalTime:
    """The time of the first reversal by Garcia and Hubbard (1988)."""

    time: Array
    """In the units of the model, over the cells; NaN where there is none."""
    reason: Array
    """Why there is none, as in `sweep.models.general.reversal_time.REASONS`, over the cells."""


@dataclass(frozen=True)
class Prediction:
    """Everything that is predicted for the cells and bodies of a grid."""

    form_factor: Array | None
    """L(f), over the bodies; None for bodies that are not the paper's."""
    formulas: Formulas | None
    """None for a tier to which they do not apply, because the spin reverses for ever without friction, or because body
    or friction are not the paper's."""
    stability: Stability | None
    """None for a tier that is not simulated, and where the eigenvalues were not asked for."""
    reversal_time: ReversalTime | None = None
    """None for a tier that does not offer it, and where it was not asked for."""


def predict(tier: Tier, grid: Grid, measure: Collection[str] = ()) -> Prediction:
    """The whole prediction, with the eigenvalues where the tier is simulated.

    Parameters
    ----------
    measure : the measurements to be predicted; the time of the first reversal is if "first_reversal" is among them
    """
    prediction = formulas(tier, grid)
    if not isinstance(tier, Model):
        return prediction
    if LINEAR not in tier.offers:
        nothing = np.full(grid.of_bodies().size, np.nan)
        found = Stability((nothing, nothing), np.full((6, grid.size), np.nan), applies=not tier.origin)
    else:
        found = _stability(tier, grid)
    timed = REVERSAL_TIME in tier.offers and FirstReversal.name in measure
    return replace(prediction, stability=found, reversal_time=_reversal_time(tier, grid, found) if timed else None)


def _reversal_time(model: Model, grid: Grid, found: Stability) -> ReversalTime:
    """Only slip makes the spin of a body without couples critical."""
    _, place = grid.bodies()
    columns, slips = grid.columns(), "mu" in model.parameters
    time, reason = np.full(grid.size, np.nan), np.full(grid.size, reversal_time.NOT_KNOWN)
    possible = np.flatnonzero(~model.impossible(columns))
    upper, lower = (n[place][possible] if slips else np.zeros(len(possible)) for n in found.n_c1)
    *_, surface = variants.parts(model.name)
    theirs = {name: values[possible] for name, values in columns.items()}
    time[possible], reason[possible] = reversal_time.first_reversal(theirs, (upper, lower), surface)
    return ReversalTime(time, reason)


def _stability(model: Model, grid: Grid) -> Stability:
    bodies, place = grid.bodies()
    columns = bodies.columns()
    possible = np.flatnonzero(~model.impossible(columns))
    ranges = np.full((6, bodies.size), np.nan)
    for begin in range(0, len(possible), _PART):
        some = possible[begin : begin + _PART]
        ranges[:, some] = stability.stable_ranges(model, {name: values[some] for name, values in columns.items()})
    return Stability((ranges[1], ranges[0]), ranges[:, place])


def formulas(tier: Tier, grid: Grid) -> Prediction:
    """The prediction without the eigenvalues: what is left costs next to nothing."""
    bodies = grid.of_bodies().columns()
    found = None
    if FORMULAS in tier.offers:
        found = Formulas(analytic.reversal_count(grid.columns()), analytic.critical_spins(bodies))
    papers = set(bodies) <= PAPER_PARAMETERS.keys() and not (isinstance(tier, Model) and tier.origin)
    return Prediction(analytic.form_factor(bodies) if papers else None, found, None)
