"""Rounds of simulations that a search asks for one after the other, each round depending on the answers to the last.

A round is a tile of the store: its answers are kept when it ends, and its images while it runs.  A search that is
started again asks the same questions, is given the answers that the store has, and goes on where it was stopped.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sweep.engine import executor
from sweep.grid import Array
from sweep.kernels.kernel import Kernel
from sweep.kernels.status import RUNNING
from sweep.results.store import Running, Store

_CHUNK_SECONDS = 0.05
"""Length of a chunk.  Trajectories whose answer is known before their end are ended after one."""


def advanced(kernel: Kernel, images: Array) -> Array:
    """The share of the way to its time limit that each trajectory has covered, 1 where it has ended."""
    table = kernel.table(images)
    return np.where(table["status"] == RUNNING, table["done"] / table["goal"], 1.0)


class Simulations(NamedTuple):
    """Trajectories of one method."""

    kernel: Kernel
    images: Array
    """Shape (simulations, rows)."""


Batch = Mapping[str, Simulations]
"""Simulations by method."""


@dataclass
class Rounds:
    """Answers the rounds of a search, from its store or by simulation."""

    store: Store
    advanced: Callable[[float], None] = lambda share: None  # noqa: ARG005
    """Called after each chunk of a round with the share of it that is done."""
    seconds: float = 0.0
    """What all rounds so far took, also in an earlier process."""
    _next: int = 0

    def answer(
        self,
        start: Callable[[], Batch],
        read: Callable[[Batch], Mapping[str, Array]],
        end_early: Callable[[Simulations], None],
    ) -> Mapping[str, Array]:
        """The answers to the next round.

        Parameters
        ----------
        start : makes the simulations
        read : takes the answers from simulations that have ended
        end_early : called after each chunk: ends simulations whose answer is known
        """
        number, self._next = self._next, self._next + 1
        if number not in self.store.done:
            batch, seconds = self._simulate(number, start(), end_early)
            self.store.save(number, {**read(batch), "seconds": np.array(seconds)})
        answers = dict(self.store.load(number))
        self.seconds += float(answers.pop("seconds"))
        return answers

    def _simulate(self, number: int, batch: Batch, end_early: Callable[[Simulations], None]) -> tuple[Batch, float]:
        tables = {method: each.images for method, each in batch.items()}
        began = time.perf_counter()
        left = self.store.load_running()
        if left and left.tiles == [number] and _shapes(left.tables) == _shapes(tables):
            for method, images in left.tables.items():
                tables[method][:] = images
            began -= left.seconds
        saved = time.perf_counter()

        def after_chunk() -> None:
            nonlocal saved
            end_early(each)
            if (now := time.perf_counter()) - saved > executor.CHUNK_SECONDS:
                self.store.save_running(Running([number], tables, now - began))
                saved = now
            self.advanced(float(np.concatenate([advanced(*some) for some in batch.values()]).mean()))

        for each in batch.values():
            seconds = min(_CHUNK_SECONDS, executor.CHUNK_SECONDS)
            executor.execute(*each, stop_when_settled=True, after_chunk=after_chunk, chunk_seconds=seconds)
        return batch, time.perf_counter() - began


def _shapes(tables: Mapping[str, Array]) -> dict[str, tuple[int, ...]]:
    return {method: images.shape for method, images in tables.items()}
