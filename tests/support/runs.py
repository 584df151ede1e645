"""Runs that are interrupted, and whether two came to the same numbers."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np
import pytest
import xarray as xr

import sweep
from support import STANDARD
from sweep.engine.limits import Limits
from sweep.kernels import methods
from sweep.kernels.status import SETTLED


class Seen(NamedTuple):
    """What a run says of its progress."""

    share: float
    done: float
    cells: float
    unit: str
    failed: int


_DONE = re.compile(r"(\d+) of (\d+) (\S+) done(?:, (\d+) failed)?")


class Heard:
    """A function that keeps the progress and the messages of a run, and does something at each chunk."""

    def __init__(self, act: Callable[[], object] = lambda: None) -> None:
        self.act, self.notes, self.seen = act, list[str](), list[Seen]()

    def __call__(self, share: float, text: str) -> None:
        if said := _DONE.fullmatch(text):
            done, cells, unit, failed = said.groups()
            self.seen.append(Seen(share, float(done), float(cells), unit, int(failed or 0)))
            self.act()
        else:
            self.notes.append(text)


class Stop(Heard):
    """Interrupts after some chunks, as Ctrl-C does."""

    def __init__(self, chunks: int) -> None:
        super().__init__(lambda: interrupt() if len(self.seen) > chunks else None)


def interrupt() -> None:
    raise KeyboardInterrupt


@contextmanager
def limited(**limits: Any) -> Iterator[None]:
    """Divide runs by other `Limits`."""
    with patch("sweep.engine.limits.LIMITS", Limits(**limits)):
        yield


def nothing_drawn() -> Any:
    """Runs without pictures, which take longer to draw than small runs."""
    return patch("sweep.engine.run._draw", lambda *_: None)


def run_cells(bodies: Iterable[Mapping[str, float]], output: Path | None = None, **settings: Any) -> xr.Dataset:
    """A run of the standard case with some parameters replaced in each cell, along the dimension `case`."""
    rows = [STANDARD | dict(body) for body in bodies]
    config = {"name": "cells", "cases": {name: [row[name] for row in rows] for name in STANDARD}}
    return sweep.run(config, output, **settings)


def in_sittings(chunks: int, config: Any, output: Path) -> tuple[xr.Dataset, int, Stop]:
    """A run that is interrupted after `chunks` chunks and resumed, until it ends: how often, and what was said last.

    The last sitting has nothing to say if the one before was interrupted after the last chunk.
    """
    interruptions, last = 0, Stop(chunks)
    while True:
        heard = Stop(chunks)
        try:
            result = sweep.run(config, output, progress=heard)
            return result, interruptions, heard if heard.seen else last
        except KeyboardInterrupt:
            interruptions, last = interruptions + 1, heard


def settled(scene: Any, share: float, **settings: Any) -> tuple[xr.Dataset, xr.Dataset, np.ndarray]:
    """A run, the same one without an early end, and which cells have settled: they have had their last reversal."""
    ended, gone_on = (sweep.run(scene, **settings, stop_early=stops) for stops in (True, False))
    which = ended["status"].values == SETTLED
    assert which.mean() >= share
    np.testing.assert_array_equal(ended["reversals"].values[which], gone_on["reversals"].values[which])
    # Their steps may differ: both runs look for errors of their own.
    np.testing.assert_allclose(ended["t_last_reversal"].values[which], gone_on["t_last_reversal"].values[which], 1e-4)
    return ended, gone_on, which


def lengthen(monkeypatch: pytest.MonkeyPatch, factor: float) -> None:
    """Make the automatic steps of first runs longer than they should be."""
    automatic = methods.automatic_step

    def long_step(*which: Any) -> tuple[np.ndarray, np.ndarray]:
        step, rule = automatic(*which)
        return factor * step, rule

    monkeypatch.setattr(methods, "automatic_step", long_step)


def same_numbers(one: xr.Dataset, other: xr.Dataset) -> None:
    """All but the attributes, which hold the time that it took."""
    xr.testing.assert_identical(one.drop_attrs(deep=False), other.drop_attrs(deep=False))
