"""Turns the cells of a grid into images: the method, step, limits and start of each, before any step is taken."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from sweep.config import Config
from sweep.grid import Array, Grid
from sweep.kernels import methods
from sweep.kernels.build import build
from sweep.kernels.kernel import Kernel
from sweep.kernels.method import FIXED, MISSED, REPEAT
from sweep.kernels.methods import AUTO, METHODS
from sweep.kernels.status import IMPOSSIBLE
from sweep.models.model import Columns
from sweep.prediction import Prediction, predict
from sweep.results import dataset

# Each kernel is made once in a process, because its machine code takes a second to load.
_kernel = cache(methods.make_kernel)


@dataclass(frozen=True)
class Choice:
    """The cells that one method runs, and the steps that it takes."""

    method: str
    cells: Array
    """Indices of the cells in the grid, shape (cells,)."""
    kernel: Kernel
    columns: Columns
    """Physical parameters by name, each of shape (cells,)."""
    step: Array
    """The longest step wanted, in sqrt(c/g), shape (cells,)."""
    step_rule: Array
    """What determined this step (`sweep.kernels.method.STEP_RULES`), shape (cells,)."""


@dataclass(frozen=True)
class Part(Choice):
    """The cells that one method runs, with their images."""

    images: Array
    """Shape (cells, rows)."""

    @property
    def status(self) -> Array:
        return np.asarray(self.kernel.table(self.images)["status"])


@dataclass(frozen=True)
class Plan:
    """Everything a simulation needs, before the first step is taken."""

    config: Config
    grid: Grid
    prediction: Prediction
    parts: tuple[Part, ...]
    """One part, unless the configuration has the method chosen for each cell (`method: auto`).  Cells of impossible
    bodies are in none."""

    def results(self) -> dict[str, Array]:
        """The variables of the dataset, over the cells and over their bodies, once all trajectories have ended."""
        arrays: dict[str, Array] = {}
        for part in self.parts:
            found = dataset.measured(part.kernel, part.images, self.config.integrator.t_end)
            table = part.kernel.table(part.images)
            repeated = np.where(table["missed"] > 0, MISSED, REPEAT)
            found["step_rule"] = np.where(table["halvings"] > 0, repeated, part.step_rule)
            if self.config.integrator.method == AUTO:
                found["method"] = np.full(len(part.cells), METHODS[part.method].code)
            for name, values in found.items():
                nothing = np.nan if dataset.VARIABLES[name].dtype.startswith("float") else 0
                blank = np.full((self.grid.size, *values.shape[1:]), nothing)
                arrays.setdefault(name, blank)[part.cells] = values
        simulated = np.concatenate([part.cells for part in self.parts])
        arrays["status"][np.delete(np.arange(self.grid.size), simulated)] = IMPOSSIBLE
        return arrays | dataset.predicted(self.prediction)


def plan(config: Config, grid: Grid | None = None) -> Plan:
    """Give each cell of `grid`, by default all cells of `config`, its method, step, limits and start.

    Kernels that no cache holds are compiled first.
    """
    grid = grid or Grid.of(config)
    build(kernels(config))
    return fill(config, grid, choose(config, grid))


def kernels(config: Config) -> list[Kernel]:
    """All kernels that a run of a configuration may need."""
    method = config.integrator.method
    names = methods.allowed(config.equations) if method == AUTO else (method,)
    names += (methods.PLAIN,) if config.verify and methods.PLAIN not in names else ()
    return [kernel_of(name, config) for name in names]


def kernel_of(method: str, config: Config) -> Kernel:
    """The kernel of a method for the model and the measurements of a configuration."""
    return _kernel(method, config.equations, config.measure, config.integrator.tolerance)


def choose(config: Config, grid: Grid) -> tuple[Choice, ...]:
    """Give each cell of `grid` that has a possible body its method and step; no kernel is compiled for it.

    Without any there is one choice, of no cells.
    """
    model, integrator = config.equations, config.integrator
    columns = grid.columns()
    possible = np.flatnonzero(~model.impossible(columns))
    if len(possible) < grid.size:
        columns = {name: values[possible] for name, values in columns.items()}
    if not len(possible):
        nothing, kernel = np.empty(0), kernel_of(kernels(config)[0].method, config)
        return (Choice(kernel.method, possible, kernel, columns, nothing, nothing),)
    if integrator.method == AUTO:
        chosen, steps, rules = methods.cheapest(model, columns, integrator.tolerance, integrator.t_end)
    else:
        chosen = np.full(len(possible), integrator.method)
        if integrator.step == "auto":
            steps, rules = methods.automatic_step(integrator.method, model, columns, integrator.tolerance)
        else:
            steps, rules = np.full(len(possible), integrator.step), np.full(len(possible), FIXED)
    choices = []
    for method in METHODS:
        if not len(cells := np.flatnonzero(chosen == method)):
            continue
        theirs = {name: values[cells] for name, values in columns.items()}
        choices.append(Choice(method, possible[cells], kernel_of(method, config), theirs, steps[cells], rules[cells]))
    return tuple(choices)


def fill(config: Config, grid: Grid, chosen: Sequence[Choice]) -> Plan:
    """Give each cell of `grid` its limits and start as well, in images of the kernels in `chosen`."""
    prediction = predict(config.equations, grid, config.measure)
    assert prediction.stability is not None  # it is a model
    stable = prediction.stability.ranges
    parts = []
    for each in chosen:
        images = np.empty((0, len(each.kernel.layout.names)))
        if len(each.cells):
            images = each.kernel.images(each.columns, each.step, config.integrator.t_end, stable[:, each.cells])
        parts.append(Part(**vars(each), images=images))
    return Plan(config, grid, prediction, tuple(parts))


def pool(plans: Iterable[Plan]) -> tuple[list[Plan], dict[str, tuple[Kernel, Array]]]:
    """The same plans, with their images as views into one table per method; and the tables, with their kernels."""
    plans = list(plans)
    tables: dict[str, tuple[Kernel, Array]] = {}
    for method in METHODS:
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
