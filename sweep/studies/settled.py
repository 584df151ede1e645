"""How far the search for critical spins has come, in bodies."""

from __future__ import annotations

import time

import numpy as np

from sweep.engine.reporter import Progress, Reporter
from sweep.grid import Array

# Of the time that a body takes, the share of its n_c1.
_FIRST = 0.05

# Of what is left of a search, the share that a round of simulations brings, as a guess while the round goes on.
_ROUND = 0.5


class Settled:
    """Adds up the bodies that are settled, with parts of those that are being searched, for a reporter."""

    def __init__(self, reporter: Reporter, bodies: int, searched: int) -> None:
        """Count `bodies`, all but `searched` of which are settled from the start."""
        self.reporter, self.bodies, self.began = reporter, bodies, time.perf_counter()
        self._finished: float = bodies - searched
        self._group = self._left = self._told = 0.0
        self._before: float | None = None

    def first(self, share: Array) -> None:
        """The shares of the searches for n_c1 of a group that are done, of both signs."""
        self._searches(_FIRST * share, _FIRST * (1 - share))

    def second(self, share: Array) -> None:
        """The same for n_c2."""
        self._searches(_FIRST + (1 - _FIRST) * share, (1 - _FIRST) * (1 - share))

    def group(self, bodies: int) -> None:
        """A group of so many bodies is finished."""
        self._finished += bodies
        self._group = self._left = 0.0
        self._report(0.0)

    def advanced(self, share: float) -> None:
        """Such a share of a round of simulations is done."""
        self._report(_ROUND * self._left * share)

    def _searches(self, done: Array, left: Array) -> None:
        self._group, self._left = float(done.sum()) / 2, float(left.sum()) / 2
        self._report(0.0)

    def _report(self, more: float) -> None:
        # A round may bring less than was guessed.
        self._told = max(self._told, self._finished + self._group + more)
        if self._before is None:
            self._before = self._told
        seconds = max(time.perf_counter() - self.began, np.finfo(float).tiny)
        self.reporter.chunk(Progress(self.bodies, self._told, 0, self._before, seconds))
