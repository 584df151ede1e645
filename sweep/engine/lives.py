"""Keeps what the cells of a batch go through: one table of images for each method, each image with its stage.

A cell has one image that runs, or waits for a lane.  Beside it stand the image of the run before it, while a failure is
looked at again, and an image that is put aside, while another stands in its place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sweep.engine.cells import Cells
from sweep.grid import Array
from sweep.kernels.layout import Layout, Table
from sweep.kernels.status import QUIET, RUNNING

RUN, APPROACH, COMPANION, DONE = range(4)
"""Stages of a cell: it runs to its end; it runs to a few steps ahead of a failure, which is put aside; its companion
runs, and the run is put aside; all is known of it."""

MET = ("met.kind", "met.time", "met.spin", "met.doubt")
"""What the last run met (`sweep.engine.failures.Met`)."""

ERRORS = (
    "error.spin", "error.rattle", "error.least", "error.reversals", "error.apart", "error.overshoot",
    "error.nearest_approach",
)  # fmt: skip
"""What the last companion told (`sweep.engine.errors.Errors`)."""

NOTES = Layout(
    (
        "stage", "leg", "wary", "most", "step", "step_rule", "halvings", "brief", "step_before", *MET,
        "repeats", "most_error", *ERRORS,
    )
)  # fmt: skip
"""What is noted of each cell.  `leg`, `wary` and `most` are of `sweep.engine.ending`; `halvings`, `brief`,
`step_before` and what was met are of `sweep.engine.failures`; the others are of `sweep.engine.errors`."""


class Lives:
    """The cells of one method, and how far each has come.

    Attributes
    ----------
    cells : their images are those that run
    notes : what is noted of each cell, a `Table` with the layout `NOTES`
    before : images of the runs before those that run, shape (cells, rows)
    aside : images that others stand in for, shape (cells, rows)
    """

    def __init__(self, cells: Cells) -> None:
        self.notes = Table(np.zeros((len(cells.cells), len(NOTES.names))), NOTES)
        self.notes["step"], self.notes["step_rule"], self.notes["most"] = cells.step, cells.step_rule, np.inf
        self.notes["most_error"] = np.inf
        self.notes.set_columns(ERRORS, np.nan)
        self.cells = replace(cells, step=self.notes["step"], step_rule=self.notes["step_rule"])
        # Pages that are never written take no memory.
        self.before, self.aside = np.zeros_like(cells.images), np.zeros_like(cells.images)

    @property
    def stage(self) -> Array:
        return self.notes["stage"]

    @property
    def running(self) -> Array:
        """Indices of the cells that wait for steps."""
        return np.flatnonzero((self.stage != DONE) & (self.cells.status == RUNNING))

    @property
    def quiet(self) -> Array:
        """Indices of the cells that wait to be carried on without steps."""
        return np.flatnonzero((self.stage != DONE) & (self.cells.status == QUIET))

    @property
    def ended(self) -> Array:
        """Indices of the cells whose stage has ended."""
        return np.flatnonzero((self.stage != DONE) & ~np.isin(self.cells.status, (RUNNING, QUIET)))

    def table(self, rows: Array) -> Table:
        """A copy of some images, to be written back."""
        return self.cells.kernel.table(self.cells.images[rows])

    def take(self, rows: Array) -> Cells:
        """Some cells, with a copy of their images."""
        return self.cells.take(rows)

    def note(self, rows: Array, names: Sequence[str], values: Array | float) -> None:
        """Note `values`, of shape (rows, names) or the same for all, of the cells `rows`."""
        self.notes.images[rows[:, None], np.array([NOTES.index(name) for name in names])] = values

    def enter(
        self, rows: Array, stage: int, images: Array, *, settles: bool = False, goal: Array | float = np.inf
    ) -> None:
        """Let `images` stand for the cells `rows`, in a stage: they run to their ends, or for `goal` steps."""
        table = self.cells.kernel.table(images)
        table["settles"], table["goal"] = settles, np.minimum(table["steps"], goal)
        self.cells.images[rows], self.notes["stage"][rows] = images, stage

    def saved(self) -> dict[str, Array]:
        """All that an interrupted batch needs to go on, by name."""
        tables = {"images": self.cells.images, "notes": self.notes.images}
        tables |= {"before": self.before} if self.notes["halvings"].any() else {}
        tables |= {"aside": self.aside} if np.isin(self.stage, (APPROACH, COMPANION)).any() else {}
        return {f"{self.cells.method} {name}": table for name, table in tables.items()}

    def resume(self, saved: dict[str, Array]) -> None:
        """Go on from what `saved` gave, if it is of these cells."""
        own = {"images": self.cells.images, "notes": self.notes.images, "before": self.before, "aside": self.aside}
        found = {name: saved[key] for name in own if (key := f"{self.cells.method} {name}") in saved}
        if all(name in found and found[name].shape == own[name].shape for name in ("images", "notes")):
            for name, table in found.items():
                own[name][:] = table
