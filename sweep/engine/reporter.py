"""Carries what a run tells its user while it goes on."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from sweep.grid import Array
from sweep.kernels.status import FAILURES


@dataclass(frozen=True)
class Progress:
    """How far a run has come."""

    cells: float
    """To be simulated in all, as far as known: a refined run adds more with each pass."""
    done: float
    """A fraction where parts of a cell count, as in a search."""
    failed: int
    done_before: float
    """Of `done`, those finished by an earlier run."""
    seconds: float
    """Since this run began."""
    unit: str = "cells"
    """What is counted."""


class Reporter:
    """Receives what a run has to tell.  This one stays silent; override what should be shown."""

    def chunk(self, progress: Progress) -> None:
        """Another chunk is done."""

    def note(self, message: str) -> None:
        """Something worth a line."""


class Count:
    """Adds up finished tiles and the finished cells of running ones for a reporter."""

    def __init__(self, reporter: Reporter) -> None:
        self.reporter, self.began = reporter, time.perf_counter()
        self.cells = self.before = self.done = self.failed = 0
        self._farthest = 0.0

    def expect(self, cells: int, todo: int) -> None:
        """Of `cells` in all, `todo` are still to do; the others not counted so far are an earlier run's."""
        there = cells - todo - self.done
        self.cells, self.before, self.done = cells, self.before + there, self.done + there

    def chunk(self, done: float, failed: int) -> None:
        """Report how many of the cells being computed are done, and how many have failed."""
        self._farthest = max(self._farthest, self.done + done)  # a guess of what is left may grow
        self._report(self._farthest, self.failed + failed)

    def tile(self, status: Array) -> None:
        """Count a finished tile by the statuses of its cells, and report."""
        self.done += len(status)
        self.failed += int(np.isin(status, FAILURES).sum())
        self._report(self.done, self.failed)

    def _report(self, done: float, failed: int) -> None:
        seconds = time.perf_counter() - self.began
        self.reporter.chunk(Progress(self.cells, done, failed, self.before, seconds))
