"""What theory says of every cell: the paper's formulas and the full model's eigenvalues."""

from __future__ import annotations

from dataclasses import dataclass

from sweep.grid import Array, Grid
from sweep.models import analytic, linear
from sweep.models.coefficients import rattle_period
from sweep.models.model import Model


@dataclass(frozen=True)
class Prediction:
    """Arrays over the cells (`reversals`) or over the bodies, the cells without their start."""

    reversals: Array
    n_c1: tuple[Array, Array]
    """Plus and minus, by the paper's formulas; n_c2 is twice that."""
    n_c1_linear: tuple[Array, Array]
    """From the model's own eigenvalues; infinite where the rattle decays at every spin."""
    form_factor: Array
    period: Array
    """Of the slower rattle: the window over which spins are averaged."""


def predict(model: Model, grid: Grid) -> Prediction:
    bodies = grid.bodies()[0].columns()
    n_c1 = analytic.critical_spins(bodies)
    return Prediction(
        reversals=analytic.reversal_count(grid.columns()),
        n_c1=n_c1,
        n_c1_linear=linear.critical_spins(model, bodies, n_c1),
        form_factor=analytic.form_factor(bodies),
        period=rattle_period(bodies),
    )
