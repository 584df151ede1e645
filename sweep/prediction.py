"""What theory predicts for every cell: the paper's formulas, and stability by a model's eigenvalues."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numba
import numpy as np

from sweep.grid import Array, Grid
from sweep.models import analytic, linear
from sweep.models.model import FORMULAS, Columns, Model, Tier, stack

# Bodies that a thread handles at a time.  NumPy computes eigenvalues on one thread, in 0.5 ms a body, which counts
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
    """n_c1+ and n_c1- by the eigenvalues, as `sweep.models.linear.critical_spins` gives them: infinite where the
    rattle decays at every spin, NaN where it does not decay at rest.  NaN too for a model without formulas."""
    ranges: Array
    """Bounds of the ranges of spin in which the rattle decays, shape (6, bodies), as `Kernel.images` takes them."""


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
    bodies, body = grid.bodies()
    stability = _stability(tier, grid.columns(), bodies.columns(), body, prediction.formulas)
    return replace(prediction, stability=stability)


def formulas(tier: Tier, grid: Grid) -> Prediction:
    """The prediction without the eigenvalues: what is left costs next to nothing."""
    bodies = grid.bodies()[0].columns()
    found = None
    if FORMULAS in tier.offers:
        found = Formulas(analytic.reversal_count(grid.columns()), analytic.critical_spins(bodies))
    return Prediction(analytic.form_factor(bodies), found, None)


def _stability(model: Model, columns: Columns, bodies: Columns, body: Array, formulas: Formulas | None) -> Stability:
    cells = len(bodies["a"])
    if formulas is None:
        never = np.full(cells, np.nan)
        return Stability((never, never), stack((never,) * 6))
    reach = np.zeros(cells)
    np.maximum.at(reach, body, linear.fastest_spin(model, columns))

    def ranges(part: Array) -> Array:
        some = {name: values[part] for name, values in bodies.items()}
        upper, lower = linear.critical_spins(model, some, (formulas.n_c1[0][part], formulas.n_c1[1][part]))
        below, above = (linear.outer_range(model, some, n, reach[part]) for n in (lower, upper))
        return stack((lower, upper, *below[::-1], *above))

    parts = np.array_split(np.arange(cells), max(1, round(cells / _PART)))
    with ThreadPoolExecutor(numba.get_num_threads()) as pool:
        found = np.concatenate(list(pool.map(ranges, parts)), axis=1)
    return Stability((found[1], found[0]), found)
