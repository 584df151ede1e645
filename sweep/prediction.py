"""What theory predicts for every cell: the paper's formulas, and stability by a model's eigenvalues."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sweep.grid import Array, Grid
from sweep.kernels.stability import stable_ranges
from sweep.models import analytic, stability
from sweep.models.linear import fastest_spin
from sweep.models.model import FORMULAS, LINEAR, Model, Tier
from sweep.models.scene import PAPERS


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
    """Ranges of spin in which the rattle decays, shape (6, cells), as `stability.stable_ranges` gives them: all those
    that the trajectory of the cell can reach."""
    applies: bool = True
    """Whether n_c1 is worth telling: not of a user's model to which the linear theory does not apply."""


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


def predict(tier: Tier, grid: Grid) -> Prediction:
    """The whole prediction, with the eigenvalues where the tier is simulated."""
    prediction = formulas(tier, grid)
    if not isinstance(tier, Model):
        return prediction
    if LINEAR not in tier.offers:
        nothing = np.full(grid.bodies()[0].size, np.nan)
        nowhere = np.full((6, grid.size), np.nan)
        return replace(prediction, stability=Stability((nothing, nothing), nowhere, applies=not tier.origin))
    return replace(prediction, stability=_stability(tier, grid))


def _stability(model: Model, grid: Grid) -> Stability:
    bodies, place = grid.bodies()
    columns = bodies.columns()
    near, covered = stable_ranges(model, columns)
    ranges = near[:, place]
    # A body may have ranges at spins that only some of its trajectories reach.
    far = fastest_spin(model, grid.columns()) > covered[place]
    if far.any():
        some, again = np.unique(place[far], return_inverse=True)
        all_of_them = stability.stable_ranges(model, {name: values[some] for name, values in columns.items()})
        ranges[:, far] = all_of_them[:, again]
    return Stability((near[1], near[0]), ranges)


def formulas(tier: Tier, grid: Grid) -> Prediction:
    """The prediction without the eigenvalues: what is left costs next to nothing."""
    bodies = grid.bodies()[0].columns()
    found = None
    if FORMULAS in tier.offers:
        found = Formulas(analytic.reversal_count(grid.columns()), analytic.critical_spins(bodies))
    papers = set(bodies) <= PAPERS and not (isinstance(tier, Model) and tier.origin)
    return Prediction(analytic.form_factor(bodies) if papers else None, found, None)
