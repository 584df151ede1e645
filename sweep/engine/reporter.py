"""Passes progress and messages from a run to its user."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from sweep.grid import Array
from sweep.kernels.status import FAILURES


@dataclass(frozen=True)
class Progress:
    """The progress of a run."""

    cells: float
    """Cells to simulate in total, as far as known: a search adds more with each round."""
    done: float
    """Finished cells; a fraction where parts of a cell count, as in a search."""
    failed: int
    done_before: float
    """The part of `done` that an earlier run finished."""
    seconds: float
    """Seconds since this run began."""
    unit: str = "cells"
    """What is counted."""


class Reporter:
    """Receives progress and messages of a run. This one stays silent; override what should be shown."""

    def chunk(self, progress: Progress) -> None:
        """Report that another chunk is done."""

    def note(self, message: str) -> None:
        """Report a message."""


class Count:
    """Adds up finished tiles and the finished cells of running tiles for a reporter, or the time that is covered."""

    def __init__(self, reporter: Reporter, unit: str = "cells") -> None:
        self.reporter, self.unit, self.began = reporter, unit, time.perf_counter()
        self.cells = self.before = self.done = self._farthest = 0.0
        self.failed = 0

    def expect(self, cells: float, todo: float) -> None:
        """Begin with `todo` cells to do out of `cells`; the others not counted so far come from an earlier run."""
        there = cells - todo - self.done
        self.cells, self.before, self.done = cells, self.before + there, self.done + there

    def chunk(self, done: float, failed: int) -> None:
        """Report how many of the cells being computed are done, and how many have failed."""
        self._farthest = max(self._farthest, self.done + done)  # an estimate of the remaining work may grow
        self._report(self._farthest, self.failed + failed)

    def tile(self, status: Array) -> None:
        """Count a finished tile by the statuses of its cells, and report."""
        self.done += len(status)
        self.failed += int(np.isin(status, FAILURES).sum())
        self._report(self.done, self.failed)

    def _report(self, done: float, failed: int) -> None:
        seconds = time.perf_counter() - self.began
        self.reporter.chunk(Progress(self.cells, done, failed, self.before, seconds, self.unit))
