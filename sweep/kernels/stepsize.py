"""How long a fixed step may be: `step: auto`."""

from __future__ import annotations

import numpy as np

from sweep.kernels.tableau import Tableau
from sweep.models import linear
from sweep.models.coefficients import rattle_period
from sweep.models.model import Array, Columns, Model

STABILITY_SHARE = 0.9
"""Share of the method's stability interval used along the fastest decay."""

FIXED, ACCURACY, STABILITY = range(3)


def automatic_step(model: Model, tableau: Tableau, columns: Columns) -> tuple[Array, Array]:
    """Step of each trajectory in sqrt(c/g), and which of the two limits set it; shapes (cells,)."""
    # Half a period at the most, where even the fastest motion is slow: the windows need two steps.
    with np.errstate(divide="ignore"):
        accuracy = np.minimum(model.radians_a_step / linear.fastest_motion(model, columns), rattle_period(columns) / 2)
        stability = STABILITY_SHARE * tableau.real_stability / model.fastest_decay(columns)
    return np.minimum(accuracy, stability), np.where(stability < accuracy, STABILITY, ACCURACY)
