"""Prepares each cell: method, step, limits and initial state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from sweep.config import Config
from sweep.engine.cells import Cells, Choice, Rules
from sweep.grid import Array, Grid
from sweep.jit import on_all_threads
from sweep.kernels import methods
from sweep.kernels.build import build
from sweep.kernels.kernel import Kernel
from sweep.kernels.method import FIXED, Tolerance
from sweep.kernels.methods import AUTO, METHODS
from sweep.models.model import Columns, take
from sweep.models.theory.linear import fastest_spin
from sweep.models.theory.stability import StableRanges
from sweep.prediction import Prediction, decay_times, predict

TOLERANCE_TIME = 400.0
"""The time in sqrt(c/g) to which a tolerance refers; the permitted error of a longer run grows in proportion."""

_DECAY_TIMES, _TURN, _LOOSEST = 2.0, 1.5, 8.0
"""The least length of the run of a calm body, in decay times of its rattle; the largest angle by which a calm body can
turn in a period of its rattle; and the largest ratio of the tolerance for a first step to the tolerance."""

# Each kernel is made once in a process, because its machine code takes a second to load.
_kernel = cache(methods.make_kernel)


@dataclass(frozen=True)
class Plan:
    """Everything that a simulation needs before the first step."""

    config: Config
    grids: tuple[Grid, ...]
    """The grids; their cells are numbered consecutively."""
    predictions: tuple[Prediction, ...]
    parts: tuple[Cells, ...]
    """One part, unless the configuration lets the method be chosen for each cell (`method: auto`). Cells of impossible
    bodies are in none."""

    def by_grid(self, arrays: dict[str, Array]) -> list[dict[str, Array]]:
        """Split `arrays` over all cells by grid, and add the predictions for cells and bodies."""
        ends = np.cumsum([grid.size for grid in self.grids])
        return [
            {name: values[end - grid.size : end] for name, values in arrays.items()} | prediction.variables
            for grid, prediction, end in zip(self.grids, self.predictions, ends, strict=True)
        ]


def plan(config: Config, *grids: Grid, also: Sequence[str] = ()) -> Plan:
    """Prepare each cell of `grids`, by default all cells of `config`: method, step, limits and initial state.

    Kernels that no cache holds are compiled first; `also` as for `sweep.kernels.build.build`.
    """
    grids = grids or (config.grid,)
    chosen = choose(config, *grids)
    build(kernels(config, chosen), *also)
    predictions = tuple(on_all_threads(lambda grid: predict(config.equations, grid, config.measure), grids))
    stable = StableRanges(*np.concatenate([each.ranges for each in predictions], axis=1))
    how = config.integrator
    fixed = how.step != "auto"
    repeats, tolerance = config.repeats and not fixed, config.tolerance
    rules = Rules(
        how.t_end, tolerance, how.first_leg, how.settles, fixed, how.estimate_errors, repeats, config.by_count
    )
    parts = list[Cells]()
    for each in chosen:
        theirs = take(stable, each.cells)
        rows, fine = each.kernel.initial(each.columns, theirs), np.full(len(each.cells), tolerance)
        parts.append(Cells(**vars(each), model=config.equations, rules=rules, tolerance=fine, stable=theirs, rows=rows))
    return Plan(config, grids, predictions, tuple(parts))


def kernels(config: Config, chosen: Sequence[Choice] = ()) -> list[Kernel]:
    """Return the kernels that run the cells of `chosen`, or all that a run may need."""
    method = config.integrator.method
    names = [each.kernel.method for each in chosen] or (
        methods.automatic(config.equations, config.measure) if method == AUTO else [method]
    )
    return [kernel_of(name, config) for name in dict.fromkeys(names)]


def kernel_of(method: str, config: Config) -> Kernel:
    """Return the kernel of a method for the model and the measurements of a configuration."""
    return _kernel(method, config.equations, config.measure, config.integrator.tolerance_number)


def choose(config: Config, *grids: Grid) -> tuple[Choice, ...]:
    """Choose method and step of each cell of `grids` that has a possible body, without compiling or initial states.

    If there are no such cells, there is one choice with no cells.
    """
    model, integrator = config.equations, config.integrator
    each = [grid.columns() for grid in grids]
    columns = {name: np.concatenate([some[name] for some in each]) for name in each[0]}
    possible = np.flatnonzero(~model.impossible(columns))
    columns = take(columns, possible)
    if not len(possible):
        return (Choice(kernels(config)[0], possible, columns, np.empty(0), np.empty(0)),)
    tolerance = np.concatenate([first_tolerance(config, grid) for grid in grids])[possible]
    if integrator.method == AUTO:
        chosen, steps, rules = methods.cheapest(model, columns, tolerance, integrator.t_end, config.measure)
    else:
        chosen = np.full(len(possible), integrator.method)
        steps, rules = steps_of(integrator.method, config, columns, tolerance)
    choices = []
    for method in METHODS:
        if len(cells := np.flatnonzero(chosen == method)):
            kernel, theirs = kernel_of(method, config), take(columns, cells)
            choices.append(Choice(kernel, possible[cells], theirs, steps[cells], rules[cells]))
    return tuple(choices)


def first_tolerance(config: Config, grid: Grid) -> Array:
    """Return the tolerance for which the first step of each cell is chosen, shape (cells,).

    It exceeds the tolerance itself if the run will be long, and if a second run will show whether its error is too
    large and the cell has to be repeated: the permitted error grows with time, and a long run forgets its early errors.
    With the step for the tolerance itself, half of the cells of `configs/mu_b.yaml` end with less than a hundredth of
    the permitted error (scripts/LOG.md). A body that spins fast may soon lift off or topple, so its run may be short.
    """
    how, model, columns, tolerance = config.integrator, config.equations, grid.columns(), config.tolerance
    if not (how.estimate_errors and config.repeats and how.step == "auto"):
        return np.full(grid.size, tolerance)
    least, possible = np.zeros(grid.size), ~model.impossible(columns)
    columns = take(columns, possible)
    calm = fastest_spin(model, columns) * model.slower_period(columns) < _TURN
    decay = decay_times(model, grid)[possible] * model.spin_unit(columns)
    least[possible] = np.where(calm, _DECAY_TIMES * decay, 0.0)
    return np.asarray(tolerance * np.clip(least / TOLERANCE_TIME, 1.0, _LOOSEST))


def steps_of(method: str, config: Config, columns: Columns, tolerance: Tolerance | None = None) -> tuple[Array, Array]:
    """Return the step of each cell with a method, configured or automatic, and what set it; both of shape (cells,).

    By default the automatic step is the one for the configuration's own tolerance.
    """
    step, cells = config.integrator.step, len(next(iter(columns.values())))
    if step == "auto":
        tolerance = config.integrator.tolerance_number if tolerance is None else tolerance
        return methods.automatic_step(method, config.equations, columns, tolerance)
    return np.full(cells, step), np.full(cells, FIXED)
