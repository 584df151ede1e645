"""Cells, with all that is needed to run them: kernel, parameters, steps, and the images of their trajectories."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sweep.config import Config
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
    """Whether a run ends where the spin can reverse no more."""
    fixed: bool = False
    """Whether the step is given, and never changed."""
    twice: bool = False
    """Whether each cell is run a second time, for its error."""
    repeats: bool = False
    """Whether cells above the tolerance are repeated."""

    @classmethod
    def of(cls, config: Config) -> Rules:
        """The rules of a configuration."""
        said, fixed = config.integrator, config.integrator.step != "auto"
        return cls(
            said.t_end, said.tolerance, said.patience, said.stop_when_settled, fixed, said.estimate_errors,
            config.repeats and not fixed,
        )  # fmt: skip


@dataclass(frozen=True)
class Cells:
    """The cells that one method runs."""

    kernel: Kernel
    model: Model
    """In the variables of its users: that of the kernel may have others."""
    rules: Rules
    cells: Array
    """Their indices among all cells of a batch, shape (cells,)."""
    columns: Columns
    """Physical parameters by name, each of shape (cells,)."""
    step: Array
    """The longest step wanted, in sqrt(c/g), shape (cells,)."""
    step_rule: Array
    """What determined this step (`sweep.kernels.method.STEP_RULES`), shape (cells,)."""
    stable: Array
    """The ranges of spin in which the rattle decays, as `Kernel.images` takes them, shape (6, cells)."""
    images: Array
    """Shape (cells, rows)."""

    @property
    def method(self) -> str:
        return self.kernel.method

    @property
    def status(self) -> Array:
        return np.asarray(self.kernel.table(self.images)["status"])

    @property
    def failed(self) -> Array:
        """Tell which runs failed."""
        return np.isin(self.status, FAILURES)

    @property
    def times(self) -> Array:
        """Times in sqrt(c/g) at which the runs have ended, shape (cells,)."""
        return self.kernel.times(self.images, self.rules.t_end)

    @property
    def inertia(self) -> Array:
        """The third part of `Model.energy` at the states of these cells, shape (cells,); NaN where one has failed."""
        with np.errstate(invalid="ignore", over="ignore"):
            return np.asarray(self.kernel.model.energy(*self.kernel.unpack(self.images))[2])

    def take(self, rows: Array, images: Array | None = None) -> Cells:
        """Some of these cells, with their own images, or with others."""
        columns = {name: values[rows] for name, values in self.columns.items()}
        return replace(
            self, cells=self.cells[rows], columns=columns, step=self.step[rows], step_rule=self.step_rule[rows],
            stable=self.stable[:, rows], images=self.images[rows] if images is None else images,
        )  # fmt: skip

    def start(self, step: Array | None = None, t_end: float | Array | None = None) -> Array:
        """Images of these cells at t = 0, with their own steps and time limit, or with others."""
        if not len(self.cells):
            return np.empty((0, len(self.kernel.layout.names)))
        wanted, until = (self.step if step is None else step), (self.rules.t_end if t_end is None else t_end)
        with np.errstate(invalid="ignore"):  # a cell may fail within the start-up of a method
            return self.kernel.images(self.columns, wanted, until, self.stable)
