"""What theory says of every cell: the paper's formulas and a model's eigenvalues."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numba
import numpy as np

from sweep.grid import Array, Grid
from sweep.models import analytic, linear
from sweep.models.model import Columns, Model, Tier, stack

# Bodies that a thread takes at a time.  Numpy takes eigenvalues on one thread, 0.5 ms a body, where a trajectory
# takes 1 ms.  With fewer the calls take longer than the numbers; with more Ctrl-C waits longer.
_PART = 1000


@dataclass(frozen=True)
class Formulas:
    """The paper's predictions for bodies with friction."""

    reversals: Array
    """Over the cells."""
    n_c1: tuple[Array, Array]
    """Plus and minus, over the bodies; n_c2 is twice that."""


@dataclass(frozen=True)
class Stability:
    """Where a model's rattle decays, over the bodies: the cells without their start."""

    n_c1: tuple[Array, Array]
    """Plus and minus; infinite where the rattle decays at every spin, NaN where at none."""
    ranges: Array
    """Shape (6, bodies), as `Kernel.images` takes them."""


@dataclass(frozen=True)
class Prediction:
    form_factor: Array
    """Over the bodies."""
    formulas: Formulas | None
    """None for a tier without friction: it reverses for ever."""
    stability: Stability | None
    """None for a tier that is not simulated, and where the eigenvalues are not asked for."""


def predict(tier: Tier, grid: Grid) -> Prediction:
    prediction = formulas(tier, grid)
    if not isinstance(tier, Model):
        return prediction
    bodies, body = grid.bodies()
    stability = _stability(tier, grid.columns(), bodies.columns(), body, prediction.formulas)
    return replace(prediction, stability=stability)


def formulas(tier: Tier, grid: Grid) -> Prediction:
    """What costs next to nothing: all but the eigenvalues."""
    bodies = grid.bodies()[0].columns()
    found = None
    if "mu" in tier.parameters:
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
