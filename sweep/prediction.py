"""What theory predicts for every cell: the paper's formulas, and stability by a model's eigenvalues."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numba
import numpy as np

from sweep.grid import Array, Grid
from sweep.models import analytic, stability
from sweep.models.model import FORMULAS, Columns, Model, Tier

# Bodies that a thread handles at a time.  NumPy computes eigenvalues on one thread, in 0.2 ms a body, which counts
# beside the 1 ms of a trajectory; so the bodies are shared among threads.  With fewer bodies at a time the calls
# take longer than the arithmetic; with more, Ctrl-C has to wait longer.
_PART = 1000


@dataclass(frozen=True)
class Formulas:
    """The paper's predictions for bodies with friction."""

    reversals: Array
    """Predicted number of reversals n_r, over the cells."""
    n_c1: tuple[Array, Array]
    """n_c1+ and n_c1-, over the bodies; n_c2± is twice n_c1±."""


@dataclass(frozen=True)
class Stability:
    """The spins at which a model's rattle decays, over the bodies."""

    n_c1: tuple[Array, Array]
    """n_c1+ and n_c1- by the eigenvalues: infinite where the rattle decays at every spin, NaN where it does not decay
    at rest.  NaN too for a model without formulas."""
    ranges: Array
    """Ranges of spin in which the rattle decays, shape (6, bodies), as `stability.stable_ranges` gives them."""


@dataclass(frozen=True)
class Prediction:
    """Everything that is predicted for the cells and bodies of a grid."""

    form_factor: Array
    """L(f), over the bodies."""
    formulas: Formulas | None
    """None for a tier to which they do not apply, because without friction the spin reverses for ever."""
    stability: Stability | None
    """None for a tier that is not simulated, and where the eigenvalues were not asked for."""


def predict(tier: Tier, grid: Grid) -> Prediction:
    """The whole prediction, with the eigenvalues where the tier is simulated."""
    prediction = formulas(tier, grid)
    if not isinstance(tier, Model):
        return prediction
    if prediction.formulas is None:
        ranges = np.full((6, len(prediction.form_factor)), np.nan)
    else:
        ranges = _stable_ranges(tier, grid.bodies()[0].columns())
    return replace(prediction, stability=Stability((ranges[1], ranges[0]), ranges))


def formulas(tier: Tier, grid: Grid) -> Prediction:
    """The prediction without the eigenvalues: what is left costs next to nothing."""
    bodies = grid.bodies()[0].columns()
    found = None
    if FORMULAS in tier.offers:
        found = Formulas(analytic.reversal_count(grid.columns()), analytic.critical_spins(bodies))
    return Prediction(analytic.form_factor(bodies), found, None)


def _stable_ranges(model: Model, bodies: Columns) -> Array:
    parts = np.array_split(np.arange(len(bodies["a"])), max(1, round(len(bodies["a"]) / _PART)))
    some = [{name: values[part] for name, values in bodies.items()} for part in parts]
    with ThreadPoolExecutor(numba.get_num_threads()) as pool:
        return np.concatenate(list(pool.map(lambda each: stability.stable_ranges(model, each), some)), axis=1)
