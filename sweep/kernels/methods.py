"""The integration methods by name: what a model can be run with, and how long a step may be."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from sweep.kernels.adams import kernel as adams
from sweep.kernels.adams.kernel import AdamsKernel
from sweep.kernels.lanes import TOLERANCE, Kernel
from sweep.kernels.tableau import DOPRI5
from sweep.models import linear
from sweep.models.coefficients import rattle_period
from sweep.models.model import Array, Columns, Model
from sweep.models.slip_split import SPLIT

METHODS = ("dopri5", "adams")

STABILITY_SHARE = 0.9
"""Share of the stability interval of dopri5 used along the fastest decay."""

FIXED, ACCURACY, STABILITY = range(3)

# Time of a step and lane, and of start-up in steps, relative to dopri5's step (`sweep bench`, and 4.6 to 6.4 µs of
# start-up beside 22 ns a step, on one thread).
_COST = {"dopri5": (1.0, 0.0), "adams": (0.64, 390.0)}


def allowed(model: Model) -> tuple[str, ...]:
    """Methods that can run a model: adams has the slip model's equations built in."""
    return METHODS if model.name == SPLIT.name else ("dopri5",)


def cheapest(model: Model, columns: Columns, tolerance: float, t_end: float) -> Array:
    """Index in `METHODS` of the method that reaches `t_end` to `tolerance` in the least time, shape (cells,)."""
    costs = []
    for method in allowed(model):
        per_step, start_up = _COST[method]
        step, _ = automatic_step(method, model, columns, tolerance)
        costs.append(per_step * (t_end / step + start_up))
    return np.asarray(np.argmin(costs, axis=0))


def make_kernel(method: str, model: Model, measure: Iterable[str], tolerance: float = TOLERANCE) -> Kernel:
    return AdamsKernel(measure, tolerance) if method == "adams" else Kernel(model, DOPRI5, measure)


def automatic_step(method: str, model: Model, columns: Columns, tolerance: float = TOLERANCE) -> tuple[Array, Array]:
    """Step of each trajectory in sqrt(c/g), and which of the two limits set it; shapes (cells,)."""
    # Half a period at the most, where even the fastest motion is slow: the windows need two steps.
    longest = rattle_period(columns) / 2
    with np.errstate(divide="ignore"):
        if method == "adams":
            step = np.minimum(adams.accurate_step(columns, tolerance), longest)
            return step, np.full(len(step), ACCURACY)
        radians = model.radians_a_step * (tolerance / TOLERANCE) ** (1 / DOPRI5.order)
        accuracy = np.minimum(radians / linear.fastest_motion(model, columns), longest)
        stability = STABILITY_SHARE * DOPRI5.real_stability / model.fastest_decay(columns)
    return np.minimum(accuracy, stability), np.where(stability < accuracy, STABILITY, ACCURACY)
