"""Defines cells with everything needed to run them, and tracks those of a batch: one table of state rows per method.

A cell has one state row that runs, or waits for a lane. In addition it may have the row of the run before, while a
failure is being examined, and a row that is set aside while another one runs in its place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sweep.grid import Array
from sweep.kernels.kernel import Kernel
from sweep.kernels.layout import Layout, Table
from sweep.kernels.status import FAILURES, QUIET, RUNNING
from sweep.models.model import Columns, Model

RUN, APPROACH, COMPANION, DONE = range(4)
"""Stages of a cell: it runs to its end; it runs to a few steps ahead of a failure, which is set aside; its companion
runs, and the run is set aside; everything is known."""

MET = ("met.kind", "met.time", "met.spin", "met.doubt")
"""What the last run met (`sweep.engine.failures.Met`)."""

ERRORS = (
    "error.spin", "error.rattle", "error.least", "error.reversals", "error.overshoot", "error.nearest_approach",
    "error.apart",
)  # fmt: skip
"""What the last companion showed (`sweep.engine.errors.Errors`)."""

NOTES = Layout((
    "stage", "leg", "wary", "step", "step_rule", "halvings", "step_before", *MET, "repeats", "most_error", "missed",
    *ERRORS,
))  # fmt: skip
"""The notes on each cell. `leg` and `wary` belong to `sweep.engine.ending`; `halvings`, `step_before` and what was met
belong to `sweep.engine.failures`; the others belong to `sweep.engine.errors`."""


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
    """Ranges of spin in which the rattle decays, as `Kernel.start` takes them, shape (7, cells)."""
    rows: Array
    """Shape (cells, quantities)."""

    @property
    def method(self) -> str:
        return self.kernel.method

    def recorded(self, name: str) -> Array:
        """Return a quantity of the state rows, shape (cells,); NaN if the kernel does not record it."""
        table = self.kernel.table(self.rows)
        return table[name] if name in table.layout else np.full(len(self.rows), np.nan)

    @property
    def status(self) -> Array:
        return np.asarray(self.kernel.table(self.rows)["status"])

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
        columns = {name: values[which] for name, values in self.columns.items()}
        return replace(
            self, cells=self.cells[which], columns=columns, step=self.step[which], step_rule=self.step_rule[which],
            stable=self.stable[:, which], rows=self.rows[which] if rows is None else rows,
        )  # fmt: skip

    def start(self, step: Array | None = None, t_end: float | Array | None = None) -> Array:
        """Return state rows of these cells at t = 0, with their own steps and time limit, or with others."""
        if not len(self.cells):
            return np.empty((0, len(self.kernel.layout.names)))
        wanted, until = (self.step if step is None else step), (self.rules.t_end if t_end is None else t_end)
        with np.errstate(invalid="ignore"):  # a cell may fail during the start-up of a method
            return self.kernel.start(self.columns, wanted, until, self.stable)


class Lives:
    """The cells of one method, and the progress of each.

    Attributes
    ----------
    cells : with the state rows that run
    notes : a `Table` with the layout `NOTES`
    before : state rows of the previous runs, shape (cells, quantities)
    aside : state rows that are set aside, shape (cells, quantities)
    """

    def __init__(self, cells: Cells) -> None:
        self.notes = Table(np.zeros((len(cells.cells), len(NOTES.names))), NOTES)
        self.notes["step"], self.notes["step_rule"] = cells.step, cells.step_rule
        self.notes["most_error"] = np.inf
        self.notes.set_columns(ERRORS, np.nan)
        self.cells = replace(cells, step=self.notes["step"], step_rule=self.notes["step_rule"])
        # Pages that are never written take no memory.
        self.before, self.aside = np.zeros_like(cells.rows), np.zeros_like(cells.rows)

    @property
    def stage(self) -> Array:
        return self.notes["stage"]

    @property
    def running(self) -> Array:
        """Return the indices of cells that wait for steps."""
        return np.flatnonzero((self.stage != DONE) & (self.cells.status == RUNNING))

    @property
    def quiet(self) -> Array:
        """Return the indices of cells that wait to continue without steps."""
        return np.flatnonzero((self.stage != DONE) & (self.cells.status == QUIET))

    @property
    def ended(self) -> Array:
        """Return the indices of cells whose stage has ended."""
        return np.flatnonzero((self.stage != DONE) & ~np.isin(self.cells.status, (RUNNING, QUIET)))

    def table(self, which: Array) -> Table:
        """Return a copy of some state rows, to be written back."""
        return self.cells.kernel.table(self.cells.rows[which])

    def take(self, which: Array) -> Cells:
        """Return some cells, with a copy of their state rows."""
        return self.cells.take(which)

    def note(self, which: Array, names: Sequence[str], values: Array | float) -> None:
        """Note `values`, of shape (which, names) or the same for all, for the cells `which`."""
        self.notes.rows[which[:, None], np.array([NOTES.index(name) for name in names])] = values

    def enter(
        self, which: Array, stage: int, rows: Array, *, settles: Array | bool = False, goal: Array | float = np.inf
    ) -> None:
        """Set the state rows of the cells `which` in a stage: they run to their ends, or for `goal` steps."""
        table = self.cells.kernel.table(rows)
        table["settles"], table["goal"] = settles, np.minimum(table["steps"], goal)
        self.cells.rows[which], self.notes["stage"][which] = rows, stage

    def saved(self) -> dict[str, Array]:
        """Return everything that an interrupted batch needs to resume, by name."""
        tables = {"rows": self.cells.rows, "notes": self.notes.rows}
        tables |= {"before": self.before} if self.notes["halvings"].any() else {}
        tables |= {"aside": self.aside} if np.isin(self.stage, (APPROACH, COMPANION)).any() else {}
        return {f"{self.cells.method} {name}": table for name, table in tables.items()}

    def resume(self, saved: dict[str, Array]) -> None:
        """Resume from what `saved` returned, if it is of these cells."""
        own = {"rows": self.cells.rows, "notes": self.notes.rows, "before": self.before, "aside": self.aside}
        found = {name: saved[key] for name in own if (key := f"{self.cells.method} {name}") in saved}
        if all(name in found and found[name].shape == own[name].shape for name in ("rows", "notes")):
            for name, table in found.items():
                own[name][:] = table
