"""Runs that are interrupted, and whether two came to the same numbers."""

from __future__ import annotations

import xarray as xr

from sweep.engine.reporter import Progress, Reporter


class Stop(Reporter):
    """Interrupts after some chunks, as Ctrl-C does."""

    def __init__(self, chunks: int) -> None:
        self.left, self.notes, self.seen = chunks, list[str](), list[Progress]()

    def chunk(self, progress: Progress) -> None:
        self.seen.append(progress)
        self.left -= 1
        if self.left < 0:
            raise KeyboardInterrupt

    def note(self, message: str) -> None:
        self.notes.append(message)


def same_numbers(one: xr.Dataset, other: xr.Dataset) -> None:
    """All but the attributes, where the time that it took is told."""
    xr.testing.assert_identical(one.drop_attrs(deep=False), other.drop_attrs(deep=False))
