"""The store of a run that writes no files."""

from __future__ import annotations

from collections.abc import Mapping

from sweep.grid import Array
from sweep.results.store import Running


class Memory:
    """Keeps finished tiles in memory; nothing outlives the process."""

    lasting = False

    def __init__(self) -> None:
        self._tiles: dict[int, dict[str, Array]] = {}
        self.done = self._tiles.keys()

    def save(self, tile: int, arrays: Mapping[str, Array]) -> None:
        self._tiles[tile] = dict(arrays)

    def load(self, tile: int) -> dict[str, Array]:
        return self._tiles[tile]

    def save_running(self, running: Running) -> None:
        """Nothing to do: no later process could resume from it."""

    def load_running(self) -> Running | None:
        return None
