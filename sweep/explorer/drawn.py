"""The cells whose trajectories are drawn: their curves, and the runs that are under way."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from sweep.explorer.runner import Curve, Job, Runner
from sweep.explorer.state import MAX_CELLS, Cell


class Drawn:
    """At most `MAX_CELLS` cells in the order in which they were chosen, one of which is active."""

    def __init__(self, cells: Iterable[Cell], runner: Runner | None, tell: Callable[[Job], None]) -> None:
        """`tell` is called with each job that has news, on the thread of the runner."""
        self._runner, self._tell = runner, tell
        self._jobs: list[Job] = []
        self.active = 0
        for cell in cells:
            self.add(cell, keep=True)

    @property
    def cells(self) -> list[Cell]:
        return [job.cell for job in self._jobs]

    @property
    def curves(self) -> list[Curve | None]:
        """As far as they have been run."""
        return [job.curve for job in self._jobs]

    def add(self, cell: Cell, *, keep: bool) -> None:
        """Choose another cell, and run it; it replaces those chosen before, unless these are to be kept."""
        while self._jobs and (not keep or len(self._jobs) == MAX_CELLS):
            self.remove(0)
        self._jobs.append(self._begun(cell))
        self.active = len(self._jobs) - 1

    def change(self, cell: Cell) -> None:
        """Run the active cell with other parameters; its old curve stays until then."""
        old = self._jobs[self.active]
        old.dropped = True
        self._jobs[self.active] = self._begun(cell, old.curve)

    def remove(self, k: int) -> None:
        self._jobs.pop(k).dropped = True
        self.active = max(min(self.active, len(self._jobs) - 1), 0)

    def running(self) -> Iterator[tuple[int, Job]]:
        """The places of the cells that are run, and their runs."""
        return ((k, job) for k, job in enumerate(self._jobs) if not job.over)

    def leave(self) -> None:
        """Give up all runs."""
        for job in self._jobs:
            job.dropped = True

    def _begun(self, cell: Cell, curve: Curve | None = None) -> Job:
        assert self._runner
        self._runner.submit(job := Job(cell, self._tell, curve=curve))
        return job
