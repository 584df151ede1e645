"""The integration methods by name, the choice of the cheapest, and the automatic step of each."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from sweep.kernels import measures
from sweep.kernels.adams import kernel as adams
from sweep.kernels.kernel import Kernel, Stepper
from sweep.kernels.method import ACCURACY, STABILITY, TOLERANCE, Tolerance
from sweep.kernels.runge_kutta import TABLEAUS
from sweep.models.model import Array, Columns, Model
from sweep.models.theory.linear import fastest_motion

METHODS: dict[str, Stepper] = {method.name: method for method in (*TABLEAUS, adams.METHOD)}
"""The first is the plain method, which runs every model."""

PLAIN = next(iter(METHODS))

AUTO = "auto"
"""Stands in for the name of a method: the cheapest is chosen for each cell."""


def allowed(model: Model, measure: Iterable[str] = ()) -> tuple[str, ...]:
    """Names of the methods that can integrate a model and make measurements, given by their specs."""
    kinds = measures.chosen(measure)
    return tuple(
        name
        for name, method in METHODS.items()
        if method.runs(model) and all(method.makes(each, model) for each in kinds)
    )


def automatic(model: Model, measure: Iterable[str] = ()) -> tuple[str, ...]:
    """Names of the methods among which `auto` chooses for a model and for measurements."""
    return tuple(name for name in allowed(model, measure) if METHODS[name].automatic)


def cheapest(
    model: Model, columns: Columns, tolerance: Tolerance, t_end: float, measure: Iterable[str] = ()
) -> tuple[Array, Array, Array]:
    """Choose the method that reaches `t_end` within `tolerance` in the least time, with its automatic step.

    Returns the names of the methods, with the step and rule of `automatic_step`, each of shape (cells,).
    """
    rates, names = (fastest_motion(model, columns), model.fastest_decay(columns)), automatic(model, measure)
    found = [_step(METHODS[name], model, columns, *rates, tolerance) for name in names]
    with np.errstate(divide="ignore"):  # at hardly any friction a method may have no step at all
        costs = [METHODS[name].step_cost * (t_end / step + METHODS[name].start_up_cost)
                 for name, (step, _) in zip(names, found, strict=True)]  # fmt: skip
    chosen, cells = np.argmin(costs, axis=0), np.arange(len(rates[0]))
    steps, rules = (np.stack(values)[chosen, cells] for values in zip(*found, strict=True))
    return np.array(names)[chosen], steps, rules


def make_kernel(method: str, model: Model, measure: Iterable[str], tolerance: float = TOLERANCE) -> Kernel:
    """The kernel of a method, not compiled yet, for a model and for measurements given by their specs."""
    return Kernel(METHODS[method], model, measures.complete(measures.chosen(measure), model), tolerance)


def automatic_step(
    method: str, model: Model, columns: Columns, tolerance: Tolerance = TOLERANCE
) -> tuple[Array, Array]:
    """Step of each trajectory, in sqrt(c/g), and the rule that determined it; both of shape (cells,)."""
    rates = fastest_motion(model, columns), model.fastest_decay(columns)
    return _step(METHODS[method], model, columns, *rates, tolerance)


def _step(
    method: Stepper, model: Model, columns: Columns, motion: Array, decay: Array, tolerance: Tolerance
) -> tuple[Array, Array]:
    with np.errstate(divide="ignore"):
        accurate = method.accurate_step(model, columns, motion, decay, tolerance)
        step = np.minimum(accurate, longest_step(model, columns))
        stable = method.stable_step(decay)
    return np.minimum(step, stable), np.where(stable < step, STABILITY, ACCURACY)


def longest_step(model: Model, columns: Columns) -> Array:
    """A quarter of the rattle's period, in sqrt(c/g), shape (cells,): two steps in half a window of the average."""
    return model.slower_period(columns) / 4
