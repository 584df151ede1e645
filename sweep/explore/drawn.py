"""The cells whose trajectories are drawn: their curves, and the runs that are under way."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial

from sweep.explore.cells import Curve, News, Runner
from sweep.explore.setup import Setup
from sweep.explore.state import MAX_CELLS, Cell


class Drawn:
    """At most `MAX_CELLS` cells in the order in which they were chosen, one of which is active."""

    def __init__(
        self, cells: Iterable[Cell], setup: Setup | None, runner: Runner, tell: Callable[[int, News], None]
    ) -> None:
        """`tell`, (key, news) -> None, is called on the thread of the trajectories; `hear` takes what it was told."""
        self._setup, self._runner, self._tell = setup, runner, tell
        self.cells: list[Cell] = []
        self.curves: list[Curve | None] = []
        self._keys: list[int] = []
        self._next_key = 0
        self._running: dict[int, News] = {}
        for cell in cells:
            self._append(cell)
        self.active = max(len(self.cells) - 1, 0)

    def add(self, cell: Cell, *, beside: bool) -> None:
        """Choose another cell, and run it; it replaces those chosen before unless it goes `beside` them."""
        while self.cells and (not beside or len(self.cells) == MAX_CELLS):
            self._drop(0)
        self._append(cell)
        self.active = len(self.cells) - 1

    def change(self, cell: Cell) -> None:
        """Run the active cell with other parameters; its old curve stays until then."""
        self.cells[self.active] = cell
        self._submit(self._keys[self.active], cell)

    def remove(self, k: int) -> None:
        self._drop(k)
        self.active = max(min(self.active, len(self.cells) - 1), 0)

    def hear(self, key: int, news: News) -> bool:
        """Take news of a run; whether it is of a cell that is still drawn."""
        if key not in self._keys:
            return False
        self._running[key] = news
        if news.curve or news.fault:
            del self._running[key]
        if news.curve:
            self.curves[self._keys.index(key)] = news.curve
        return True

    def running(self) -> Iterator[tuple[int, News]]:
        """The places of the cells that are run, and the latest news of them."""
        return ((self._keys.index(key), news) for key, news in self._running.items())

    def leave(self) -> None:
        """Give up all runs."""
        self._runner.cancel(lambda key: key != "first" and key[0] == id(self))

    def _append(self, cell: Cell) -> None:
        self.cells.append(cell)
        self.curves.append(None)
        self._keys.append(self._next_key)
        self._next_key += 1
        self._submit(self._keys[-1], cell)

    def _drop(self, k: int) -> None:
        key = self._keys.pop(k)
        self._running.pop(key, None)
        self._runner.cancel(lambda other: other == (id(self), key))
        del self.cells[k], self.curves[k]

    def _submit(self, key: int, cell: Cell) -> None:
        if self._setup:
            self._running[key] = News()
            self._runner.submit((id(self), key), self._setup, cell, partial(self._tell, key))
