"""Keeps what is known of each cell of a batch, and lets cells enter their next stages.

A cell has one state row that runs, or waits for a lane. In addition it may have the row of the run before, while a
failure is being examined, and a row that is set aside while another one runs in its place.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from sweep.engine import over
from sweep.engine.cells import Cells
from sweep.engine.errors import Errors
from sweep.engine.failures import AHEAD, Met
from sweep.grid import Array
from sweep.kernels.layout import Table
from sweep.kernels.method import REPEAT
from sweep.kernels.status import QUIET, RUNNING
from sweep.models.slow.estimate import Ending

RUN, APPROACH, SECOND, DONE = range(4)
"""Stages of a cell: it runs to its end; it runs to a few steps ahead of a failure, which is set aside; it runs a second
time, and the first run is set aside; everything is known."""

FIRST, LATER = range(2)
"""Legs of a run: to `Rules.first_leg`, and to `t_end`."""

NOTES = np.dtype([
    ("stage", float), ("leg", float), ("step", float), ("step_rule", float), ("tolerance", float),
    ("halvings", float), ("step_before", float), ("met", [(name, float) for name in Met._fields]),
    ("repeats", float), ("count", float), ("lowest", float), ("highest", float), ("most_excess", float),
    ("doubts", int), ("error", [(name, float) for name in Errors._fields]),
    ("left", [(name, float) for name in Ending._fields]),
])  # fmt: skip
"""What is noted of each cell: its stage and leg; its step, what determined it (`STEP_RULES`), and its tolerance;
how often the step was halved because of a failure, the step before, and what the last run met; how often the cell was
repeated because of its error, what the last run counted before if it was not coarse, the lowest and the highest spin
at the ends of its runs, and the largest excess of the error with which another repeat is of use; the doubts and the
error that its second run gives; and what was left to come of its spin when the run stopped."""


class Resume(NamedTuple):
    """Run on to the end of the same leg, without settling on the way."""


class NextLeg(NamedTuple):
    """Run on to t_end, and settle on the way if possible."""


class Approach(NamedTuple):
    """Run again, from the start to a few steps ahead of the failure."""


class Second(NamedTuple):
    """Run a second time, from the start, to estimate the error of the run."""

    step: Array
    t_end: Array
    settles: Array
    """Whether it may settle before t_end."""


class Repeat(NamedTuple):
    """Begin anew with another step, and perhaps another tolerance."""

    step: Array
    tolerance: Array


class Done(NamedTuple):
    """Stay as it is."""


Next = Resume | NextLeg | Approach | Second | Repeat | Done


def note(notes: Array, name: str, which: Array, record: Met | Errors | Ending) -> None:
    """Set a nested record of the notes of the cells `which` to the arrays of `record`."""
    for field, values in zip(record._fields, record, strict=True):
        notes[name][field][which] = values


class Lives:
    """The cells of one method, and the progress of each.

    Attributes
    ----------
    cells : as they began
    rows : the state rows that run, shape (cells, quantities)
    notes : of the type `NOTES`, shape (cells,)
    before : state rows of the previous runs, shape (cells, quantities)
    aside : state rows that are set aside, shape (cells, quantities)
    """

    def __init__(self, cells: Cells) -> None:
        self.cells, self.rows, self.notes = cells, np.empty_like(cells.rows), np.zeros(len(cells.cells), NOTES)
        for name in ("step", "step_rule", "tolerance"):
            self.notes[name] = getattr(cells, name)
        every = np.arange(len(self.notes))
        note(self.notes, "error", every, Errors(*np.full((len(Errors._fields), len(every)), np.nan)))
        self.notes["most_excess"], self.notes["count"] = np.inf, np.nan
        self.notes["lowest"], self.notes["highest"] = np.inf, -np.inf
        # Pages that are never written take no memory.
        self.before, self.aside = np.zeros_like(self.rows), np.zeros_like(self.rows)
        self._begin(every, cells.start())

    @property
    def stage(self) -> Array:
        return self.notes["stage"]

    @property
    def table(self) -> Table:
        """Return the state rows that run, accessed by the names of their quantities."""
        return self.cells.kernel.table(self.rows)

    @property
    def running(self) -> Array:
        """Return the indices of cells that wait for steps."""
        return np.flatnonzero((self.stage != DONE) & (self.table["status"] == RUNNING))

    @property
    def quiet(self) -> Array:
        """Return the indices of cells that wait to continue without steps."""
        return np.flatnonzero((self.stage != DONE) & (self.table["status"] == QUIET))

    @property
    def ended(self) -> Array:
        """Return the indices of cells whose stage has ended."""
        return np.flatnonzero((self.stage != DONE) & ~np.isin(self.table["status"], (RUNNING, QUIET)))

    def take(self, which: Array | slice = slice(None), rows: Array | None = None) -> Cells:
        """Return some cells with their present steps, and with copies of their state rows or of other `rows`."""
        which = np.arange(len(self.notes))[which]
        rows = (self.rows if rows is None else rows)[which]
        step, rule, tolerance = (self.notes[name][which] for name in ("step", "step_rule", "tolerance"))
        return replace(self.cells.take(which, rows), step=step, step_rule=rule, tolerance=tolerance)

    def started(self, which: Array | slice = slice(None), *how: Array) -> Array:
        """Return state rows of some cells at t = 0, with their present steps, or with others (`Cells.start`)."""
        return self.take(which, self.cells.rows).start(*how)

    def left(self, which: Array | slice = slice(None)) -> Ending:
        """Return what was left to come of the spins of some cells when their runs stopped."""
        return Ending(*(self.notes["left"][name][which] for name in Ending._fields))

    def enter(self, which: Array, to: Next) -> None:
        """Let the cells `which` enter their next stage."""
        if not len(which):
            return
        match to:
            case Resume() | NextLeg():
                table, further = self.take(which).table, isinstance(to, NextLeg)
                table["status"], table["settles"] = RUNNING, further
                if further:
                    table["goal"], self.notes["leg"][which] = table["steps"], LATER
                self.rows[which] = table.rows
            case Approach():
                # A failure with fewer steps before it is examined from the start (`failures.met`).
                goal = np.maximum(self.table["done"][which] - AHEAD, 1)
                self._run_again(which, APPROACH, self.started(which), goal=goal)
            case Second(step, t_end, settles):
                self._run_again(which, SECOND, self.started(which, step, t_end), settles=settles)
            case Repeat(step, tolerance):
                self.notes["step"][which], self.notes["tolerance"][which] = step, tolerance
                self.notes["error"][which] = np.nan
                if not self.cells.rules.fixed:
                    self.notes["step_rule"][which] = REPEAT
                self._begin(which, self.started(which))
            case Done():
                self.notes["stage"][which] = DONE

    def _begin(self, which: Array, rows: Array) -> None:
        """Let state rows at t = 0 run as first runs of the cells `which`."""
        goal = over.first_goal(self.cells.take(which, rows))
        self.notes["leg"][which] = FIRST
        self._put(which, RUN, rows, self.cells.rules.settles, goal)

    def _run_again(
        self, which: Array, stage: int, rows: Array, *, settles: Array | bool = False, goal: Array | float = np.inf
    ) -> None:
        """Let state rows at t = 0 run in the place of others, which are set aside."""
        self.aside[which] = self.rows[which]
        self._put(which, stage, rows, settles, goal)

    def _put(self, which: Array, stage: int, rows: Array, settles: Array | bool, goal: Array | float) -> None:
        """Set state rows that run to their ends, or for `goal` steps."""
        table = self.cells.kernel.table(rows)
        table["settles"], table["goal"] = settles, np.minimum(table["steps"], goal)
        self.rows[which], self.notes["stage"][which] = rows, stage

    def saved(self) -> dict[str, Array]:
        """Return everything that an interrupted batch needs to resume, by name."""
        tables = {"rows": self.rows, "notes": self.notes}
        tables |= {"before": self.before} if self.notes["halvings"].any() else {}
        tables |= {"aside": self.aside} if np.isin(self.stage, (APPROACH, SECOND)).any() else {}
        return {f"{self.cells.method} {name}": table for name, table in tables.items()}

    def resume(self, saved: dict[str, Array]) -> None:
        """Resume from what `saved` returned, if it is of these cells."""
        own = {"rows": self.rows, "notes": self.notes, "before": self.before, "aside": self.aside}
        found = {name: saved[key] for name in own if (key := f"{self.cells.method} {name}") in saved}
        if all(name in found and found[name].shape == own[name].shape for name in ("rows", "notes")):
            for name, table in found.items():
                own[name][:] = table
