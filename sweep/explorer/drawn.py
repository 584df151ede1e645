"""The cells whose trajectories are drawn: their curves, and the runs that are under way."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from sweep.explorer.runner import Curve, Job, Runner
from sweep.explorer.state import MAX_CELLS, Cell


class Drawn:
    """At most `MAX_CELLS` cells in the order in which they were chosen, one of which is active."""

    def __init__(self, cells: Iterable[Cell], runner: Runner | None, tell: Callable[[Job], None]) -> None:
        """`tell` is called on the runner's thread; `hear` takes the job that it was called with."""
        self._runner, self._tell = runner, tell
        self._jobs: list[Job] = []
        self.curves: list[Curve | None] = []
        self.active = 0
        for cell in cells:
            self.add(cell, beside=True)

    @property
    def cells(self) -> list[Cell]:
        return [job.cell for job in self._jobs]

    def add(self, cell: Cell, *, beside: bool) -> None:
        """Choose another cell, and run it; it replaces those chosen before unless it goes `beside` them."""
        while self._jobs and (not beside or len(self._jobs) == MAX_CELLS):
            self.remove(0)
        self._jobs.append(self._begun(cell))
        self.curves.append(None)
        self.active = len(self._jobs) - 1

    def change(self, cell: Cell) -> None:
        """Run the active cell with other parameters; its old curve stays until then."""
        self._jobs[self.active].dropped = True
        self._jobs[self.active] = self._begun(cell)

    def remove(self, k: int) -> None:
        self._jobs.pop(k).dropped = True
        del self.curves[k]
        self.active = max(min(self.active, len(self._jobs) - 1), 0)

    def hear(self, job: Job) -> bool:
        """Take the news of a run; true if there is more of its curve to draw."""
        if job not in self._jobs or not job.curve or job.curve is self.curves[k := self._jobs.index(job)]:
            return False
        self.curves[k] = job.curve
        return True

    def running(self) -> Iterator[tuple[int, Job]]:
        """The places of the cells that are run, and their runs."""
        return ((k, job) for k, job in enumerate(self._jobs) if not job.over)

    def leave(self) -> None:
        """Give up all runs."""
        for job in self._jobs:
            job.dropped = True

    def _begun(self, cell: Cell) -> Job:
        assert self._runner
        self._runner.submit(job := Job(cell, self._tell))
        return job
