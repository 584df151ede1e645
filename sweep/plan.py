"""From the cells of a grid to images: what each is run with, before the first step is taken."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sweep.config import Config
from sweep.grid import Array, Grid
from sweep.kernels import methods
from sweep.kernels.lanes import Kernel
from sweep.models import MODELS
from sweep.models.coefficients import rattle_period
from sweep.prediction import Prediction, predict


@dataclass(frozen=True)
class Part:
    """The cells that one method runs."""

    method: str
    cells: Array
    """Their indices in the grid."""
    kernel: Kernel
    step_rule: Array
    images: Array


@dataclass(frozen=True)
class Plan:
    """Everything a simulation needs, before the first step is taken."""

    config: Config
    grid: Grid
    prediction: Prediction
    parts: tuple[Part, ...]
    """One unless the configuration leaves the choice of the method to each cell."""

    def status(self) -> Array:
        return np.concatenate([part.images[:, part.kernel.row("status")] for part in self.parts])


def plan(config: Config, compiling: Callable[[], None] = lambda: None) -> Plan:
    """Lay out the cells of `config` with their methods, steps, limits and starts.

    `compiling` is called for each kernel that no cache holds.
    """
    grid, model, integrator = Grid.of(config), MODELS[config.model], config.integrator
    columns = grid.columns()
    prediction = predict(model, grid)
    assert prediction.stability is not None  # it is a model
    stable = prediction.stability.ranges[:, grid.bodies()[1]]
    if integrator.method == "auto":
        chosen = methods.cheapest(model, columns, integrator.tolerance, integrator.t_end)
    else:
        chosen = np.full(grid.size, methods.METHODS.index(integrator.method))
    parts = []
    for i in np.unique(chosen):
        method, cells = methods.METHODS[i], np.flatnonzero(chosen == i)
        kernel = methods.make_kernel(method, model, config.measure, integrator.tolerance)
        if not kernel.is_compiled():
            compiling()
        theirs = {name: values[cells] for name, values in columns.items()}
        if integrator.step == "auto":
            step, rule = methods.automatic_step(method, model, theirs, integrator.tolerance)
        else:
            step, rule = np.full(len(cells), integrator.step), np.full(len(cells), methods.FIXED)
        images = kernel.images(theirs, step, integrator.t_end, stable[:, cells], rattle_period(theirs))
        parts.append(Part(method, cells, kernel, rule, images))
    return Plan(config, grid, prediction, tuple(parts))
