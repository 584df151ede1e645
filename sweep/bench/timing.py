"""How much to measure, and times that come with their spread."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
from matplotlib.axes import Axes

from sweep.engine.executor import execute, nominal_seconds
from sweep.grid import Array
from sweep.kernels.lanes import LANES, Kernel
from sweep.models.coefficients import rattle_period
from sweep.models.model import Columns
from sweep.report.cells import never_stable
from sweep.report.rows import Section

Key = TypeVar("Key")

MARKERS = {"dopri5": "s", "adams": "o"}
COLOURS = {"dopri5": "#4477aa", "adams": "#ee6677"}

T_END = 400.0
"""Time that `tolerance` is meant for, in sqrt(c/g)."""

STEEPEST = 1e4
"""Largest friction that dopri5 is tried at: it takes as long as μ is large."""


@dataclass(frozen=True)
class Effort:
    """How much is measured; by default what takes about three minutes on two cores."""

    trajectories: int = 512
    repeats: int = 5
    patience: float = 3.0
    """Seconds after which a work that has run three times is repeated no more."""
    tolerances: tuple[float, ...] = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
    rungs: int = 8
    """Steps to try, each shorter than the last by sqrt(2)."""
    sizes: tuple[int, ...] = (16, 64, 256, 1024, 4096, 16384)
    ends: tuple[float, ...] = (50, 100, 200, 400, 800, 1600, 3200)
    frictions: tuple[float, ...] = (1, 10, 100, 1e3, 1e4, 1e5)


@dataclass(frozen=True)
class Spread:
    """Repeated measurements of one quantity."""

    values: tuple[float, ...]

    @property
    def median(self) -> float:
        return statistics.median(self.values)

    def times(self, factor: float) -> Spread:
        return Spread(tuple(value * factor for value in self.values))

    def inverse(self, amount: float) -> Spread:
        """Rates at which `amount` is done in these times."""
        return Spread(tuple(amount / value for value in self.values))

    @property
    def reach(self) -> tuple[float, float]:
        """How far the smallest and the largest are from the median, as error bars want it."""
        return self.median - min(self.values), max(self.values) - self.median

    def __format__(self, form: str) -> str:
        return f"{self.median:{form}} ({min(self.values):{form}} … {max(self.values):{form}})"


@dataclass(frozen=True)
class Measurement:
    """One line of bench.csv."""

    section: str
    model: str
    method: str
    case: str
    setting: str
    """What was varied; `at` is its value."""
    at: float
    quantity: str
    spread: Spread


@dataclass
class Part:
    """A section of the report, its raw figures, and what it draws."""

    section: Section
    measurements: list[Measurement] = field(default_factory=list)
    panels: list[Callable[[Axes], None]] = field(default_factory=list)


def in_turn(works: Mapping[Key, Callable[[], Any]], effort: Effort) -> dict[Key, Spread]:
    """Seconds that each work takes, in turn, so that a drift of the machine's speed meets all alike."""
    times: dict[Key, list[float]] = {name: [] for name in works}
    for _ in range(effort.repeats):
        for name, work in works.items():
            if len(times[name]) >= 3 and sum(times[name]) > effort.patience:
                continue
            began = time.perf_counter()
            work()
            times[name].append(time.perf_counter() - began)
    return {name: Spread(tuple(values)) for name, values in times.items()}


@dataclass(frozen=True)
class Work:
    """Trajectories carried from their parameters to `t_end`, start-up included."""

    kernel: Kernel
    columns: Columns
    step: Array
    t_end: float = T_END

    def __call__(self) -> Array:
        images = self._images()
        execute(self.kernel, images, stop_when_settled=False)
        return images

    def __len__(self) -> int:
        return len(self.step)

    def affordable(self, effort: Effort) -> Work:
        """The first of the trajectories, so many that a run should not take longer than a third of the patience."""
        count = len(self)
        seconds = nominal_seconds(self._images(), self.kernel)
        while count > 2 * LANES and seconds > effort.patience / 3:
            count, seconds = count // 2, seconds / 2
        return Work(self.kernel, {n: v[:count] for n, v in self.columns.items()}, self.step[:count], self.t_end)

    def _images(self) -> Array:
        return self.kernel.images(
            self.columns, self.step, self.t_end, never_stable(len(self)), rattle_period(self.columns)
        )


def spread_out(columns: Columns, count: int) -> dict[str, Array]:
    """`count` trajectories: the bodies `columns` again and again, their spins up to a thousandth apart."""
    many = {name: np.resize(values, count) for name, values in columns.items()}
    return many | {"n0": many["n0"] * (1 + 1e-3 * np.arange(count) / count)}
