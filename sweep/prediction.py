"""What theory says of every cell: the paper's formulas and the full model's eigenvalues."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sweep.grid import Array, Grid
from sweep.models import analytic, linear
from sweep.models.coefficients import rattle_period
from sweep.models.model import Columns, Model, stack


@dataclass(frozen=True)
class Prediction:
    """Arrays over the cells (`reversals`) or over the bodies, the cells without their start."""

    reversals: Array
    n_c1: tuple[Array, Array]
    """Plus and minus, by the paper's formulas; n_c2 is twice that."""
    n_c1_linear: tuple[Array, Array]
    """From the model's own eigenvalues; infinite where the rattle decays at every spin."""
    stable: Array
    """Ranges of spin in which the rattle decays, shape (6, bodies), as `Kernel.images` takes them."""
    form_factor: Array
    period: Array
    """Of the slower rattle: the window over which spins are averaged."""


def predict(model: Model, grid: Grid) -> Prediction:
    columns, (body_grid, body) = grid.columns(), grid.bodies()
    bodies = body_grid.columns()
    n_c1 = analytic.critical_spins(bodies)
    upper, lower = linear.critical_spins(model, bodies, n_c1)
    reach = np.zeros(body_grid.size)
    np.maximum.at(reach, body, _fastest_spin(model, columns))
    below, above = (linear.outer_range(model, bodies, n, reach) for n in (lower, upper))
    return Prediction(
        reversals=analytic.reversal_count(columns),
        n_c1=n_c1,
        n_c1_linear=(upper, lower),
        stable=np.stack([lower, upper, *below[::-1], *above]),
        form_factor=analytic.form_factor(bodies),
        period=rattle_period(bodies),
    )


def _fastest_spin(model: Model, columns: Columns) -> Array:
    """The |spin| that a start could reach if all its energy went into it."""
    start = stack(model.start(columns)), stack(model.constants(columns))
    spin, rattle, inertia = model.energy.py_func(*start)  # type: ignore[attr-defined]
    return np.asarray(np.sqrt(spin**2 + 2 * rattle / inertia))
