"""Defines how much to measure, and times tasks in turn."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from sweep.engine.executor import execute, nominal_seconds
from sweep.grid import Array
from sweep.kernels.kernel import Kernel
from sweep.kernels.layout import LANES
from sweep.models.model import Columns

Key = TypeVar("Key")

T_END = 400.0
"""The time for which `tolerance` bounds the error in spin, in sqrt(c/g)."""


@dataclass(frozen=True)
class Effort:
    """How much to measure; the defaults take about two minutes on two cores."""

    trajectories: int = 512
    repeats: int = 5
    patience: float = 3.0
    """Seconds after which a task that has run three times is not repeated again."""
    rungs: int = 8
    """Number of steps to try, each shorter than the last by sqrt(2)."""


@dataclass(frozen=True)
class Spread:
    """Repeated measurements of one quantity."""

    values: Array

    @property
    def median(self) -> float:
        return float(np.median(self.values))

    @property
    def ends(self) -> tuple[float, float]:
        """The smallest and the largest value."""
        return float(self.values.min()), float(self.values.max())

    def __format__(self, form: str) -> str:
        smallest, largest = self.ends
        return f"{self.median:{form}} ({smallest:{form}} … {largest:{form}})"


def in_turn(works: Mapping[Key, Callable[[], Any]], effort: Effort) -> dict[Key, Spread]:
    """Time each task, in seconds. They run in turn, so that changes in the machine's speed affect all alike."""
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
    """Trajectories run from their parameters to `T_END`, start-up included."""

    kernel: Kernel
    columns: Columns
    step: Array

    def __call__(self) -> None:
        execute(self.kernel, self.kernel.images(self.columns, self.step, T_END))

    def __len__(self) -> int:
        return len(self.step)

    def affordable(self, effort: Effort) -> Work:
        """Return the first trajectories, as many as should run in a third of the patience."""
        count, seconds = len(self), nominal_seconds(T_END / self.step)
        while count > 2 * LANES and seconds > effort.patience / 3:
            count, seconds = count // 2, seconds / 2
        return Work(self.kernel, {n: v[:count] for n, v in self.columns.items()}, self.step[:count])


def spread_out(columns: Columns, count: int) -> dict[str, Array]:
    """Repeat the bodies of `columns` in `count` trajectories, whose spins differ by up to a thousandth."""
    many = {name: np.resize(values, count) for name, values in columns.items()}
    return many | {"n0": many["n0"] * (1 + 1e-3 * np.arange(count) / count)}
