"""The integration methods by name, the choice of the cheapest, and the automatic step of each."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from sweep.kernels import measures, runge_kutta
from sweep.kernels.adams import method as adams
from sweep.kernels.kernel import Kernel
from sweep.kernels.method import ACCURACY, STABILITY, TOLERANCE, Method
from sweep.kernels.stability import fastest_motion
from sweep.models.model import Array, Columns, Model, zeros

METHODS: dict[str, Method] = {method.name: method for method in (runge_kutta.DOPRI5_METHOD, adams.METHOD)}
"""The first is the plain one, which runs every model."""

PLAIN = next(iter(METHODS))

AUTO = "auto"
"""Stands in place of the name of a method: the cheapest is taken for each cell."""


def allowed(model: Model) -> tuple[str, ...]:
    """Names of the methods that can integrate a model."""
    return tuple(name for name, method in METHODS.items() if method.runs(model))


def cheapest(model: Model, columns: Columns, tolerance: float, t_end: float) -> tuple[Array, Array, Array]:
    """The method that reaches `t_end` within `tolerance` in the least time, with its automatic step.

    Returns the index in `METHODS`, and step and rule as `automatic_step` gives them, each of shape (cells,).
    """
    motion = fastest_motion(model, columns)
    steps, rules, costs = [], [], []
    for method in METHODS.values():
        if method.runs(model):
            step, rule = _step(method, model, columns, motion, tolerance)
            costs.append(method.step_cost * (t_end / step + method.start_up_cost))
        else:
            step = rule = zeros(columns)
            costs.append(zeros(columns) + np.inf)
        steps.append(step)
        rules.append(rule)
    chosen, cells = np.argmin(costs, axis=0), np.arange(len(motion))
    return chosen, np.stack(steps)[chosen, cells], np.stack(rules)[chosen, cells]


def make_kernel(method: str, model: Model, measure: Iterable[str], tolerance: float = TOLERANCE) -> Kernel:
    """The kernel of a method, not compiled yet, for a model and for measurements given by their specs."""
    return METHODS[method].kernel(model, measures.chosen(measure), tolerance)


def automatic_step(method: str, model: Model, columns: Columns, tolerance: float = TOLERANCE) -> tuple[Array, Array]:
    """Step of each trajectory, in sqrt(c/g), and the rule that determined it; both of shape (cells,)."""
    return _step(METHODS[method], model, columns, fastest_motion(model, columns), tolerance)


def _step(method: Method, model: Model, columns: Columns, motion: Array, tolerance: float) -> tuple[Array, Array]:
    with np.errstate(divide="ignore"):
        step = np.minimum(method.accurate_step(model, columns, motion, tolerance), longest_step(model, columns))
        if method.stable_step is None:
            return step, np.full(len(step), ACCURACY)
        stable = method.stable_step(model, columns)
    return np.minimum(step, stable), np.where(stable < step, STABILITY, ACCURACY)


def longest_step(model: Model, columns: Columns) -> Array:
    """A quarter of the rattle's period, in sqrt(c/g), shape (cells,): two steps in half a window of the average."""
    return model.slower_period(columns) / 4
