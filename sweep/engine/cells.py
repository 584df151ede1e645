"""Defines cells with everything needed to run them: kernel, parameters, steps, and state rows of their trajectories."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sweep.grid import Array
from sweep.kernels.kernel import Kernel
from sweep.kernels.status import FAILURES
from sweep.models.model import Columns, Model


@dataclass(frozen=True)
class Rules:
    """How long cells run, and how exactly."""

    t_end: float
    tolerance: float
    patience: float | None = None
    settles: bool = True
    """Whether a run ends once the spin can reverse no more."""
    fixed: bool = False
    """Whether the step is prescribed and never changed."""
    twice: bool = False
    """Whether each cell is run a second time, to estimate its error."""
    repeats: bool = False
    """Whether cells above the tolerance are repeated."""


@dataclass(frozen=True)
class Cells:
    """Cells that are run with one method."""

    kernel: Kernel
    model: Model
    """The model in its users' variables; the kernel's model may have others."""
    rules: Rules
    cells: Array
    """Indices among all cells of a batch, shape (cells,)."""
    columns: Columns
    """Physical parameters by name, each of shape (cells,)."""
    step: Array
    """The longest permitted step, in sqrt(c/g), shape (cells,)."""
    step_rule: Array
    """What determined this step (`sweep.kernels.method.STEP_RULES`), shape (cells,)."""
    stable: Array
    """Ranges of spin in which the rattle decays, as `Kernel.images` takes them, shape (7, cells)."""
    images: Array
    """Shape (cells, rows)."""

    @property
    def method(self) -> str:
        return self.kernel.method

    def recorded(self, name: str) -> Array:
        """Return a quantity of the state rows, shape (cells,); NaN if the kernel does not record it."""
        table = self.kernel.table(self.images)
        return table[name] if name in table.layout else np.full(len(self.images), np.nan)

    @property
    def status(self) -> Array:
        return np.asarray(self.kernel.table(self.images)["status"])

    @property
    def failed(self) -> Array:
        """Return a mask of the runs that failed."""
        return np.isin(self.status, FAILURES)

    @property
    def times(self) -> Array:
        """Return the times in sqrt(c/g) at which the runs ended, shape (cells,)."""
        return self.kernel.times(self.images, self.rules.t_end)

    @property
    def inertia(self) -> Array:
        """Return the third part of `Model.energy` at the states of these cells, shape (cells,); NaN for failures."""
        with np.errstate(invalid="ignore", over="ignore"):
            return np.asarray(self.kernel.model.energy(*self.kernel.unpack(self.images))[2])

    def take(self, rows: Array, images: Array | None = None) -> Cells:
        """Return some of these cells, with their own state rows or with others."""
        columns = {name: values[rows] for name, values in self.columns.items()}
        return replace(
            self, cells=self.cells[rows], columns=columns, step=self.step[rows], step_rule=self.step_rule[rows],
            stable=self.stable[:, rows], images=self.images[rows] if images is None else images,
        )  # fmt: skip

    def start(self, step: Array | None = None, t_end: float | Array | None = None) -> Array:
        """Return state rows of these cells at t = 0, with their own steps and time limit, or with others."""
        if not len(self.cells):
            return np.empty((0, len(self.kernel.layout.names)))
        wanted, until = (self.step if step is None else step), (self.rules.t_end if t_end is None else t_end)
        with np.errstate(invalid="ignore"):  # a cell may fail during the start-up of a method
            return self.kernel.images(self.columns, wanted, until, self.stable)
