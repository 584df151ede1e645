"""Defines cells with everything needed to run them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sweep.grid import Array
from sweep.kernels.kernel import Kernel
from sweep.kernels.layout import Table
from sweep.kernels.status import FAILURES
from sweep.models.model import Columns, Model, take
from sweep.models.theory.stability import StableRanges


@dataclass(frozen=True)
class Rules:
    """How long cells run, and how exactly."""

    t_end: float
    tolerance: float
    first_leg: float | None = None
    """Time after which only those runs go on whose end can be predicted."""
    settles: bool = True
    """Whether a run ends once the spin can reverse no more."""
    fixed: bool = False
    """Whether the step is prescribed and never changed."""
    twice: bool = False
    """Whether each cell is run a second time, to estimate its error."""
    repeats: bool = False
    """Whether cells above the tolerance are repeated."""
    by_count: bool = False
    """Whether a cell is repeated until its count is certain too, with a finer tolerance."""


@dataclass(frozen=True)
class Choice:
    """How to run the cells of one method."""

    kernel: Kernel
    cells: Array
    """Indices among all cells of a batch, shape (cells,)."""
    columns: Columns
    """Physical parameters by name, each of shape (cells,)."""
    step: Array
    """The longest permitted step, in sqrt(c/g), shape (cells,)."""
    step_rule: Array
    """What determined this step (`sweep.kernels.method.STEP_RULES`), shape (cells,)."""


@dataclass(frozen=True, kw_only=True)
class Cells(Choice):
    """The same cells, with all that is needed to run them."""

    model: Model
    """The model in its users' variables; the kernel's model may have others."""
    rules: Rules
    tolerance: Array
    """The tolerance for which each is integrated, at most that of the rules, shape (cells,)."""
    stable: StableRanges
    """Ranges of spin in which the rattle decays."""
    rows: Array
    """State rows, shape (cells, quantities); those of a plan are at t = 0, and have no steps yet."""

    @property
    def method(self) -> str:
        return self.kernel.method

    @property
    def table(self) -> Table:
        """Return the state rows, accessed by the names of their quantities."""
        return self.kernel.table(self.rows)

    def recorded(self, name: str) -> Array:
        """Return a quantity of the state rows, shape (cells,); NaN if the kernel does not record it."""
        return self.table[name] if name in self.kernel.layout else np.full(len(self.rows), np.nan)

    @property
    def status(self) -> Array:
        return self.table["status"]

    @property
    def failed(self) -> Array:
        """Return a mask of the runs that failed."""
        return np.isin(self.status, FAILURES)

    @property
    def times(self) -> Array:
        """Return the times in sqrt(c/g) at which the runs ended, shape (cells,)."""
        return self.kernel.times(self.rows, self.rules.t_end)

    @property
    def inertia(self) -> Array:
        """Return the third part of `Model.energy` at the states of these cells, shape (cells,); NaN for failures."""
        with np.errstate(invalid="ignore", over="ignore"):
            return np.asarray(self.kernel.model.energy(*self.kernel.unpack(self.rows))[2])

    def take(self, which: Array, rows: Array | None = None) -> Cells:
        """Return some of these cells, with their own state rows or with others."""
        return replace(
            self, cells=self.cells[which], columns=take(self.columns, which), step=self.step[which],
            step_rule=self.step_rule[which], tolerance=self.tolerance[which], stable=take(self.stable, which),
            rows=self.rows[which] if rows is None else rows,
        )  # fmt: skip

    def start(self, step: Array | None = None, t_end: float | Array | None = None) -> Array:
        """Return the state rows of a plan, ready for their own steps and time limit, or for others."""
        wanted, until = (self.step if step is None else step), (self.rules.t_end if t_end is None else t_end)
        return self.kernel.begin(self.rows, self.columns, wanted, until)
