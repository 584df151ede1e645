"""How much to measure, and the times of works that take turns."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from sweep.bench.section import Spread
from sweep.engine.executor import execute, nominal_seconds
from sweep.grid import Array
from sweep.kernels.kernel import Kernel
from sweep.kernels.layout import LANES
from sweep.kernels.methods import METHODS
from sweep.models.model import Columns

Key = TypeVar("Key")

T_END = 400.0
"""The time for which `tolerance` bounds the error in spin, in sqrt(c/g)."""

LONGEST = 30_000.0
"""Time limit of runs to the end, in sqrt(c/g)."""

STEEPEST = 1e4
"""Largest friction at which a method is run whose stability limits the step: its time is proportional to μ."""


def runs_at(method: str, mu: float) -> bool:
    """Tell whether a method takes a bearable time at this friction."""
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
    return {name: Spread(np.array(values)) for name, values in times.items()}


@dataclass(frozen=True)
class Work:
    """Trajectories run from their parameters to `t_end`, start-up included."""

    kernel: Kernel
    columns: Columns
    step: Array
    t_end: float = T_END

    def __call__(self) -> Array:
        images = self.kernel.images(self.columns, self.step, self.t_end)
        execute(self.kernel, images, stop_when_settled=False)
        return images

    def __len__(self) -> int:
        return len(self.step)

    def affordable(self, effort: Effort) -> Work:
        """The first of the trajectories, as many as should run in a third of the patience."""
        count, seconds = len(self), nominal_seconds(self.t_end / self.step)
        while count > 2 * LANES and seconds > effort.patience / 3:
            count, seconds = count // 2, seconds / 2
        return Work(self.kernel, {n: v[:count] for n, v in self.columns.items()}, self.step[:count], self.t_end)


def spread_out(columns: Columns, count: int) -> dict[str, Array]:
    """`count` trajectories that repeat the bodies of `columns`, with spins up to a thousandth apart."""
    many = {name: np.resize(values, count) for name, values in columns.items()}
    return many | {"n0": many["n0"] * (1 + 1e-3 * np.arange(count) / count)}
