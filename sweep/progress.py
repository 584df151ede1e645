"""Progress of a run on the terminal."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from sweep.engine.reporter import Progress as Done
from sweep.engine.reporter import Reporter
from sweep.jit import showing

_COMPILING = "compiling for this model and machine; later runs find it in the cache"


class Terminal(Reporter):
    """A bar with what is done and the time left, of cells also failures and trajectories per second."""

    def __init__(self, quiet: bool = False, unit: str = "cells") -> None:
        self.console = Console(stderr=True, quiet=quiet, highlight=False)
        self.last: Done | None = None
        cells = TextColumn("{task.fields[failed]} failed · {task.fields[rate]:.3g} trajectories/s ·")
        self._bar = Progress(
            TextColumn(f"{{task.completed:.0f}}/{{task.total:.0f}} {unit}"),
            BarColumn(),
            *([cells] if unit == "cells" else []),
            TimeRemainingColumn(compact=True),
            TextColumn("left"),
            console=self.console,
        )
        self._task: TaskID | None = None
        self._told = False

    def __enter__(self) -> Terminal:
        self._open = ExitStack()
        self._open.enter_context(showing(self._compiling))
        return self

    def __exit__(self, *exception: object) -> None:
        self._open.close()
        if self._task is not None:
            self._bar.stop()

    @contextmanager
    def _compiling(self) -> Iterator[None]:
        """One line for as long as something compiles: with a spinner, where one can turn."""
        if self._task is None and self.console.is_terminal:
            with self.console.status(_COMPILING):
                yield
        else:
            if not self._told:
                self.note(_COMPILING)
            self._told = True
            yield

    def note(self, message: str) -> None:
        self.console.print(message, soft_wrap=True, markup=False)

    def chunk(self, progress: Done) -> None:
        self.last = progress
        rate = (progress.done - progress.done_before) / progress.seconds
        if self._task is None:
            self._bar.start()
            self._task = self._bar.add_task("", total=progress.cells, failed=0, rate=0.0)
        self._bar.update(self._task, total=progress.cells, completed=progress.done, failed=progress.failed, rate=rate)
