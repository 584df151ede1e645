"""Turns the cells of grids into images: the method, step, limits and start of each, before any step is taken."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from sweep.config import Config
from sweep.grid import Array, Grid
from sweep.jit import on_all_threads
from sweep.kernels import methods
from sweep.kernels.build import build
from sweep.kernels.kernel import Kernel
from sweep.kernels.method import FIXED
from sweep.kernels.methods import AUTO, METHODS
from sweep.kernels.status import FAILURES, IMPOSSIBLE
from sweep.models.model import Columns
from sweep.prediction import Prediction, predict
from sweep.results import dataset

# Each kernel is made once in a process, because its machine code takes a second to load.
_kernel = cache(methods.make_kernel)


@dataclass(frozen=True)
class Choice:
    """The cells that one method runs, and the steps that it takes."""

    kernel: Kernel
    cells: Array
    """Their indices among all cells, shape (cells,)."""
    columns: Columns
    """Physical parameters by name, each of shape (cells,)."""
    step: Array
    """The longest step wanted, in sqrt(c/g), shape (cells,)."""
    step_rule: Array
    """What determined this step (`sweep.kernels.method.STEP_RULES`), shape (cells,)."""

    @property
    def method(self) -> str:
        return self.kernel.method


@dataclass(frozen=True)
class Part(Choice):
    """The cells that one method runs, with their images."""

    config: Config
    stable: Array
    """The ranges of spin in which the rattle decays, as `Kernel.images` takes them, shape (6, cells)."""
    images: Array
    """Shape (cells, rows)."""

    @property
    def status(self) -> Array:
        return np.asarray(self.kernel.table(self.images)["status"])

    @property
    def failed(self) -> Array:
        """Tell which runs failed."""
        return np.isin(self.status, FAILURES)

    def take(self, rows: Array) -> Part:
        """Some of these cells, with a copy of their images."""
        columns = {name: values[rows] for name, values in self.columns.items()}
        return replace(
            self, cells=self.cells[rows], columns=columns, step=self.step[rows], step_rule=self.step_rule[rows],
            stable=self.stable[:, rows], images=self.images[rows],
        )  # fmt: skip

    @property
    def settles(self) -> bool:
        """Tell whether runs end where the spin can reverse no more."""
        return self.config.integrator.stop_when_settled

    @property
    def fixed(self) -> bool:
        """Tell whether the configuration gives the step, which is then never changed."""
        return self.config.integrator.step != "auto"

    @property
    def times(self) -> Array:
        """Times in sqrt(c/g) at which the runs have ended, shape (cells,)."""
        return self.kernel.times(self.images, self.config.integrator.t_end)

    @property
    def inertia(self) -> Array:
        """The third part of `Model.energy` at the states of these cells, shape (cells,); NaN where one has failed."""
        with np.errstate(invalid="ignore"):
            return np.asarray(self.kernel.model.energy(*self.kernel.unpack(self.images))[2])

    def start(self, shorter: float | Array = 1.0) -> Part:
        """These cells at t = 0, with steps that are shorter by a factor, a number or of shape (cells,)."""
        step = self.step / shorter
        if not len(step):
            return replace(self, step=step, images=np.empty((0, len(self.kernel.layout.names))))
        return replace(self, step=step, images=self.starting(step, self.config.integrator.t_end))

    def starting(self, step: Array, t_end: float | Array) -> Array:
        """Make the images of these cells at t = 0; a cell may fail within the start-up of a method."""
        with np.errstate(invalid="ignore"):
            return self.kernel.images(self.columns, step, t_end, self.stable)

    def put(self, rows: Array, other: Part, rule: int | Array) -> None:
        """Replace the runs of the cells `rows` by those of `other`, in place; `rule` says what set their steps."""
        self.images[rows], self.step[rows], self.step_rule[rows] = other.images, other.step, rule


@dataclass(frozen=True)
class Plan:
    """Everything that a simulation needs, before the first step is taken."""

    config: Config
    grids: tuple[Grid, ...]
    """The cells are those of the first grid, followed by those of the next, and so on."""
    predictions: tuple[Prediction, ...]
    parts: tuple[Part, ...]
    """One part, unless the configuration has the method chosen for each cell (`method: auto`).  Cells of impossible
    bodies are in none."""

    def results(self) -> dict[str, Array]:
        """Collect what was simulated, by name, each over all cells, once all trajectories have ended."""
        size = sum(grid.size for grid in self.grids)
        arrays: dict[str, Array] = {}
        for part in self.parts:
            found = dataset.measured(part.kernel, part.images, self.config.integrator.t_end)
            found["step_rule"] = part.step_rule
            if self.config.integrator.method == AUTO:
                found["method"] = np.full(len(part.cells), METHODS[part.method].code)
            for name, values in found.items():
                nothing = np.nan if dataset.VARIABLES[name].dtype.startswith("float") else 0
                blank = np.full((size, *values.shape[1:]), nothing)
                arrays.setdefault(name, blank)[part.cells] = values
        simulated = np.concatenate([part.cells for part in self.parts])
        arrays["status"][np.delete(np.arange(size), simulated)] = IMPOSSIBLE
        return arrays

    def by_grid(self, arrays: dict[str, Array]) -> list[dict[str, Array]]:
        """`arrays` over all cells cut into those of each grid, with the predictions for its cells and bodies."""
        ends = np.cumsum([grid.size for grid in self.grids])
        return [
            {name: values[end - grid.size : end] for name, values in arrays.items()} | prediction.variables
            for grid, prediction, end in zip(self.grids, self.predictions, ends, strict=True)
        ]


def plan(config: Config, *grids: Grid, also: Sequence[str] = ()) -> Plan:
    """Give each cell of `grids`, by default all cells of `config`, its method, step, limits and start.

    What these cells need and no cache holds is compiled first; `also` as of `sweep.kernels.build.build`.
    """
    grids = grids or (config.grid,)
    chosen = choose(config, *grids)
    build(kernels(config, chosen), *also)
    predictions = tuple(on_all_threads(lambda grid: predict(config.equations, grid, config.measure), grids))
    stable = np.concatenate([each.ranges for each in predictions], axis=1)
    parts = [Part(**vars(each), config=config, stable=stable[:, each.cells], images=np.empty(0)) for each in chosen]
    return Plan(config, grids, predictions, tuple(part.start() for part in parts))


def kernels(config: Config, chosen: Sequence[Choice] = ()) -> list[Kernel]:
    """The kernels that run the cells of `chosen`, or all that a run may need."""
    method = config.integrator.method
    names = [each.method for each in chosen] or (methods.allowed(config.equations) if method == AUTO else [method])
    return [kernel_of(name, config) for name in dict.fromkeys(names)]


def kernel_of(method: str, config: Config) -> Kernel:
    """The kernel of a method for the model and the measurements of a configuration."""
    return _kernel(method, config.equations, config.measure, config.integrator.tolerance)


def choose(config: Config, *grids: Grid) -> tuple[Choice, ...]:
    """Give each cell of `grids` that has a possible body its method and step; no kernel is compiled for it.

    Without any there is one choice, of no cells.
    """
    model, integrator = config.equations, config.integrator
    each = [grid.columns() for grid in grids]
    columns = {name: np.concatenate([some[name] for some in each]) for name in each[0]}
    possible = np.flatnonzero(~model.impossible(columns))
    columns = {name: values[possible] for name, values in columns.items()}
    if not len(possible):
        return (Choice(kernels(config)[0], possible, columns, np.empty(0), np.empty(0)),)
    if integrator.method == AUTO:
        chosen, steps, rules = methods.cheapest(model, columns, integrator.tolerance, integrator.t_end)
    else:
        chosen, (steps, rules) = np.full(len(possible), integrator.method), steps_of(integrator.method, config, columns)
    choices = []
    for method in METHODS:
        if len(cells := np.flatnonzero(chosen == method)):
            theirs = {name: values[cells] for name, values in columns.items()}
            choices.append(Choice(kernel_of(method, config), possible[cells], theirs, steps[cells], rules[cells]))
    return tuple(choices)


def steps_of(method: str, config: Config, columns: Columns) -> tuple[Array, Array]:
    """Step of each cell with a method, the configured or the automatic one, and what set it; both of shape (cells,)."""
    step, cells = config.integrator.step, len(next(iter(columns.values())))
    if step == "auto":
        return methods.automatic_step(method, config.equations, columns, config.integrator.tolerance)
    return np.full(cells, step), np.full(cells, FIXED)
