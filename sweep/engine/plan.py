"""From the cells of a grid to images: what each is run with, before the first step is taken."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from sweep.config import Config
from sweep.grid import Array, Grid
from sweep.kernels import methods
from sweep.kernels.build import build
from sweep.kernels.lanes import Kernel
from sweep.models import MODELS
from sweep.models.coefficients import rattle_period
from sweep.prediction import Prediction, predict
from sweep.results import dataset

# One of each in a process: its machine code takes a second to load.
_kernel = cache(methods.make_kernel)


@dataclass(frozen=True)
class Part:
    """The cells that one method runs."""

    method: str
    cells: Array
    """Their indices in the grid."""
    kernel: Kernel
    step_rule: Array
    images: Array

    @property
    def status(self) -> Array:
        return np.asarray(self.images[:, self.kernel.row("status")])


@dataclass(frozen=True)
class Plan:
    """Everything a simulation needs, before the first step is taken."""

    config: Config
    grid: Grid
    prediction: Prediction
    parts: tuple[Part, ...]
    """One unless the configuration leaves the choice of the method to each cell."""

    def results(self) -> dict[str, Array]:
        """What the dataset says of the cells and of their bodies, once the images are at their ends."""
        arrays: dict[str, Array] = {}
        for part in self.parts:
            found = dataset.measured(part.kernel, part.images, self.config.integrator.t_end)
            found["step_rule"] = part.step_rule
            if self.config.integrator.method == "auto":
                found["method"] = np.full(len(part.cells), methods.METHODS.index(part.method))
            for name, values in found.items():
                arrays.setdefault(name, np.empty(self.grid.size))[part.cells] = values
        return arrays | dataset.predicted(self.prediction)


def plan(config: Config, grid: Grid | None = None, compiling: Callable[[], None] = lambda: None) -> Plan:
    """Lay out the cells of `grid`, by default all of `config`, with their methods, steps, limits and starts.

    `compiling` is called for each kernel that no cache holds.
    """
    grid = grid or Grid.of(config)
    model, integrator = MODELS[config.model], config.integrator
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
        kernel = _kernel(method, model, config.measure, integrator.tolerance)
        if not kernel.is_compiled():
            compiling()
            build(method, model.name, config.measure)
        theirs = {name: values[cells] for name, values in columns.items()}
        if integrator.step == "auto":
            step, rule = methods.automatic_step(method, model, theirs, integrator.tolerance)
        else:
            step, rule = np.full(len(cells), integrator.step), np.full(len(cells), methods.FIXED)
        images = kernel.images(theirs, step, integrator.t_end, stable[:, cells], rattle_period(theirs))
        parts.append(Part(method, cells, kernel, rule, images))
    return Plan(config, grid, prediction, tuple(parts))


def pool(plans: Iterable[Plan]) -> tuple[list[Plan], dict[str, tuple[Kernel, Array]]]:
    """The same plans with their images as views into one table a method, and these tables."""
    plans = list(plans)
    tables: dict[str, tuple[Kernel, Array]] = {}
    for method in methods.METHODS:
        found = [part for each in plans for part in each.parts if part.method == method]
        if found:
            tables[method] = found[0].kernel, np.concatenate([part.images for part in found])
    reached = dict.fromkeys(tables, 0)
    pooled = []
    for each in plans:
        parts = []
        for part in each.parts:
            begin = reached[part.method]
            reached[part.method] = end = begin + len(part.cells)
            parts.append(replace(part, images=tables[part.method][1][begin:end]))
        pooled.append(replace(each, parts=tuple(parts)))
    return pooled, tables
