"""Keeps the results of a run while it goes on: the interface of all stores, and the one in memory.

A run is computed in tiles, which are numbered. A store keeps the results of finished tiles and, between two chunks of
work, the state rows of running tiles, so that a stopped run can be resumed.

To add a store, write a subclass in its own file and use it in `sweep.engine.run` or `sweep.studies.study`. No other
code knows which store it uses.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import NamedTuple

from sweep.grid import Array


class Running(NamedTuple):
    """The running tiles, between two chunks."""

    tiles: list[int]
    """Their numbers, each once; at least one."""
    tables: dict[str, Array]
    """State rows of the cells by name of the run, shape (cells, rows)."""
    seconds: float
    """Time spent on them so far."""


class Store:
    """Keeps results of finished tiles and state rows of running ones, in memory.

    Its state rows belong to the running process, so there are none to resume from.
    """

    def __init__(self) -> None:
        self._tiles: dict[int, dict[str, Array]] = {}
        self.done: Collection[int] = self._tiles.keys()
        """Numbers of the finished tiles, including those saved by an earlier run."""

    def save(self, tile: int, arrays: Mapping[str, Array]) -> None:
        """Save the results of a tile, which is then `done`."""
        self._tiles[tile] = dict(arrays)

    def load(self, tile: int) -> dict[str, Array]:
        """Return the results of a tile that is `done`, bit for bit; raise a `FileError` if they are lost."""
        return self._tiles[tile]

    def save_running(self, running: Running) -> None:
        """Save the running tiles, replacing those saved before."""

    def load_running(self) -> Running | None:
        """Return what the last `save_running` saved; None if there is nothing, or one of its tiles is `done`."""
        return None
