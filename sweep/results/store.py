"""Keeps what a run has found while it goes on: the contract of all stores, and the one in memory.

A run is computed in tiles, which have numbers.  A store keeps the results of finished tiles and,
between two chunks of work, the images of the tiles at work, so that a stopped run can be resumed.

To add a store, write a subclass in a file of its own, and take it in `sweep.engine.run` or `sweep.studies.kept`.
Nothing else knows which store it is given.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import NamedTuple

from sweep.faults import Refused
from sweep.grid import Array


class StoreError(Refused):
    """A file of the run cannot be used; the message says which one, why, and what to do."""


class Running(NamedTuple):
    """The tiles at work, as they stand between two chunks."""

    tiles: list[int]
    """Their numbers: at least one, each once."""
    tables: dict[str, Array]
    """By the name of a run: the images of its cells, shape (cells, rows)."""
    seconds: float
    """Time spent on them so far."""


class Store:
    """Keeps the results of finished tiles, and the images of unfinished ones: this one in memory, while it lives.

    Its images are those of the process at work, so that there are none to go on from.
    """

    def __init__(self) -> None:
        self._tiles: dict[int, dict[str, Array]] = {}
        self.done: Collection[int] = self._tiles.keys()
        """Numbers of the tiles that are finished: those saved, also by an earlier run."""

    def save(self, tile: int, arrays: Mapping[str, Array]) -> None:
        """Keep the results of a tile; from now on it is `done`."""
        self._tiles[tile] = dict(arrays)

    def load(self, tile: int) -> dict[str, Array]:
        """The results of a tile that is `done`, bit for bit; `StoreError` if they are lost."""
        return self._tiles[tile]

    def save_running(self, running: Running) -> None:
        """Keep the tiles at work, in place of those kept before."""

    def load_running(self) -> Running | None:
        """Return what the last `save_running` kept; None if there is nothing, or one of its tiles is `done`."""
        return None
