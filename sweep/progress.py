"""Shows the progress of a run in the terminal and in a notebook, with progress bars of rich."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from importlib.util import find_spec

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Column

from sweep import interrupt
from sweep.engine.reporter import Progress as Done
from sweep.engine.reporter import Reporter
from sweep.faults import fault_of, refusal
from sweep.jit import showing

ProgressLike = bool | Callable[[float, str], object]
"""Whether to show a progress bar, or a function to call with the share that is done and a line of text."""


def reporting(progress: ProgressLike | None) -> AbstractContextManager[Reporter]:
    """Choose the reporter of a call: a progress bar, a function or nothing; None for a bar in notebooks only."""
    if callable(progress):
        return nullcontext(Calls(progress))
    if not isinstance(progress, bool | None):
        raise fault_of(refusal(progress, "True, False or a function of a number and a text"), "progress")
    return Terminal() if progress or (progress is None and in_notebook()) else nullcontext(Reporter())


def in_notebook() -> bool:
    """Return whether this process is the kernel of a notebook."""
    ipython = sys.modules.get("IPython")
    return ipython is not None and hasattr(ipython.get_ipython(), "kernel")


class Calls(Reporter):
    """Pass progress and messages to a function."""

    def __init__(self, function: Callable[[float, str], object]) -> None:
        self._function, self._share = function, 0.0

    def chunk(self, progress: Done) -> None:
        self._share = progress.done / progress.cells
        failed = f", {progress.failed} failed" if progress.unit == "cells" else ""
        self.note(f"{progress.done:.0f} of {progress.cells:.0f} {progress.unit} done{failed}")

    def note(self, message: str) -> None:
        self._function(self._share, message)


_COMPILING = "compiling for this model and machine; later runs find it in the cache"


_LOGGED = 60.0
"""Seconds between lines if there is no terminal for a bar, as in the log of a job."""


class _Console(Console):
    def on_broken_pipe(self) -> None:
        """Raise the error, so that the caller handles the closed pipe; rich would end the process with exit code 1."""
        raise BrokenPipeError


class Terminal(Reporter):
    """A progress bar with the remaining time and, when cells are counted, failures and trajectories per second.

    Without a terminal, as in the log of a job, it prints a line once a minute and at the end. In a notebook the bar
    moves if ipywidgets is installed, which rich needs there.
    """

    def __init__(self, quiet: bool = False) -> None:
        widgets = in_notebook() and find_spec("ipywidgets") is not None
        self.console = _Console(stderr=True, quiet=quiet, highlight=False, force_jupyter=widgets)
        self.last: Done | None = None
        self._bar: Progress | None = None
        self._announced = False
        self._logged = time.monotonic()

    def __enter__(self) -> Terminal:
        interrupt.raise_again()
        self._open = ExitStack()
        self._open.enter_context(showing(self._compiling))
        return self

    def __exit__(self, *exception: object) -> None:
        self._open.close()
        if self._bar:
            self._bar.stop()

    @contextmanager
    def _compiling(self) -> Iterator[None]:
        """Show a message while something compiles, with a spinner if the terminal can show one."""
        spins = self._bar is None and self.console.is_terminal
        if not spins and not self._announced:
            self.note(_COMPILING)
            self._announced = True
        with self.console.status(_COMPILING) if spins else nullcontext():
            yield

    def note(self, message: str) -> None:
        self.console.print(message, soft_wrap=True, markup=False)

    def chunk(self, progress: Done) -> None:
        self.last = progress
        rate = (progress.done - progress.done_before) / progress.seconds
        if self._bar is None:
            self._bar = _line(progress.unit, self.console)
            self._bar.add_task("", total=progress.cells, failed=0, rate=0.0)
            self._bar.start()
        (task,) = self._bar.task_ids
        self._bar.update(task, total=progress.cells, completed=progress.done, failed=progress.failed, rate=rate)
        if not self.console.is_terminal and time.monotonic() > self._logged + _LOGGED:
            self.console.print(self._bar.get_renderable())
            self._logged = time.monotonic()


# Width that fits all texts and still leaves room for a bar.
_WIDE = 80


def _line(unit: str, console: Console) -> Progress:
    """Return the progress line: on a narrow terminal the bar, with only as much text as leaves room for it."""
    whole, count = Column(no_wrap=True), "{task.completed:.0f}/{task.total:.0f}"
    left = TimeRemainingColumn(compact=True, table_column=whole)
    if console.width < _WIDE:
        bar = BarColumn(None, table_column=Column(ratio=1, min_width=4))
        return Progress(TextColumn(count, table_column=whole), bar, left, console=console, expand=True)
    cells = TextColumn("{task.fields[failed]} failed · {task.fields[rate]:.3g} trajectories/s ·", table_column=whole)
    parts = [TextColumn(f"{count} {unit}", table_column=whole), BarColumn(), *([cells] if unit == "cells" else [])]
    return Progress(*parts, left, TextColumn("left"), console=console)
