"""How much to measure, and times with their spread."""

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
from sweep.kernels.kernel import Kernel
from sweep.kernels.layout import LANES
from sweep.kernels.methods import METHODS
from sweep.models.model import Columns
from sweep.report.rows import Section

Key = TypeVar("Key")

MARKERS = dict(zip(METHODS, "so^vD", strict=False))
COLOURS = dict(zip(METHODS, ("#4477aa", "#ee6677", "#228833", "#ccbb44", "#aa3377"), strict=False))

T_END = 400.0
"""The time for which `tolerance` bounds the error in spin, in sqrt(c/g)."""

STEEPEST = 1e4
"""Largest friction at which a method is run whose stability limits the step: its time is proportional to μ."""


def runs_at(method: str, mu: float) -> bool:
    """Whether a method takes a bearable time at this friction."""
    return METHODS[method].stable_step is None or mu <= STEEPEST


@dataclass(frozen=True)
class Effort:
    """How much to measure; the defaults take about four minutes on two cores."""

    trajectories: int = 512
    repeats: int = 5
    patience: float = 3.0
    """Seconds after which a work that has run three times is not repeated again."""
    tolerances: tuple[float, ...] = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
    rungs: int = 8
    """Number of steps to try, each shorter than the last by sqrt(2)."""
    sizes: tuple[int, ...] = (16, 64, 256, 1024, 4096)
    ends: tuple[float, ...] = (50, 100, 200, 400, 800, 1600, 3200)
    frictions: tuple[float, ...] = (1, 10, 100, 1e3, 1e4, 1e5)
    whole_sizes: tuple[int, ...] = (16, 256, 1024, 4096, 16384)
    """Numbers of cells in whole runs, all squares."""
    settled_sizes: tuple[int, ...] = (16, 256)
    """The same in whole runs to the end."""
    reference_frictions: int = 8
    """Number of frictions of the reference sweep, of 132 cells each, in the run whose time is divided."""


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
        """The rates at which `amount` is done in these times."""
        return Spread(tuple(amount / value for value in self.values))

    @property
    def reach(self) -> tuple[float, float]:
        """Distances of the smallest and the largest from the median, for error bars."""
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
    """What was varied, to the value `at`."""
    at: float
    quantity: str
    spread: Spread


@dataclass
class Part:
    """A section of the report, its raw figures, and functions that draw its panels."""

    section: Section
    measurements: list[Measurement] = field(default_factory=list)
    panels: list[Callable[[Axes], None]] = field(default_factory=list)


def in_turn(works: Mapping[Key, Callable[[], Any]], effort: Effort) -> dict[Key, Spread]:
    """Seconds that each work takes.  They run in turn, so that a change in the machine's speed affects all alike."""
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
    """Trajectories run from their parameters to `t_end`, start-up included."""

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
        """The first of the trajectories, as many as should run in a third of the patience."""
        count = len(self)
        seconds = nominal_seconds(self.t_end / self.step)
        while count > 2 * LANES and seconds > effort.patience / 3:
            count, seconds = count // 2, seconds / 2
        return Work(self.kernel, {n: v[:count] for n, v in self.columns.items()}, self.step[:count], self.t_end)

    def _images(self) -> Array:
        return self.kernel.images(self.columns, self.step, self.t_end)


def spread_out(columns: Columns, count: int) -> dict[str, Array]:
    """`count` trajectories that repeat the bodies of `columns`, with spins up to a thousandth apart."""
    many = {name: np.resize(values, count) for name, values in columns.items()}
    return many | {"n0": many["n0"] * (1 + 1e-3 * np.arange(count) / count)}
