"""Says what a run keeps while it goes on: the contract that every store meets.

A run is computed in tiles, which have numbers.  A store keeps the results of finished tiles and,
between two chunks of work, the images of the tiles at work, so that a stopped run can be resumed.

To add a store, write a class with these members in a file of its own, and enter it in `sweep.results.stores`.  Nothing
else knows which store it is given.  `tests/results/test_stores.py` checks the promises made here for each.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import NamedTuple, Protocol

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


class Store(Protocol):
    """Keeps the results of finished tiles, and the images of unfinished ones."""

    lasting: bool
    """Whether what it keeps outlives the process."""

    @property
    def done(self) -> Collection[int]:
        """Numbers of the tiles that are finished: those saved, also by an earlier run."""

    def save(self, tile: int, arrays: Mapping[str, Array]) -> None:
        """Keep the results of a tile; from now on it is `done`."""

    def load(self, tile: int) -> dict[str, Array]:
        """The results of a tile that is `done`, bit for bit; `StoreError` if they are lost."""

    def save_running(self, running: Running) -> None:
        """Keep the tiles at work, in place of those kept before."""

    def load_running(self) -> Running | None:
        """Return what the last `save_running` kept; None if there is nothing, or one of its tiles is `done`.

        A store that is not `lasting` may always return None.
        """
