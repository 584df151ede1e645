"""How long a fixed step may be: `step: auto`."""

from __future__ import annotations

import numpy as np

from sweep.kernels.tableau import Tableau
from sweep.models import linear
from sweep.models.model import Array, Columns, Model

STABILITY_SHARE = 0.9
"""Share of the method's stability interval used along the fastest decay."""

RADIANS_A_STEP = 0.07
"""Phase of the fastest rattle in one step.  Spin errors at t = 400 (a = 10, b = 3, n0 = 0.05 and 0.1,
μ = 20, where accuracy decides): 3e-9 and 1e-8; they fall as its fifth power."""

FIXED, ACCURACY, STABILITY = range(3)


def automatic_step(model: Model, tableau: Tableau, columns: Columns) -> tuple[Array, Array]:
    """Step of each trajectory in sqrt(c/g), and which of the two limits set it; shapes (cells,)."""
    accuracy = RADIANS_A_STEP / linear.fastest_oscillation(model, columns)
    with np.errstate(divide="ignore"):
        stability = STABILITY_SHARE * tableau.real_stability / model.fastest_decay(columns)
    return np.minimum(accuracy, stability), np.where(stability < accuracy, STABILITY, ACCURACY)
