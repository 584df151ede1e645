"""A section of the report: what was measured, its tables, and how its panels are drawn."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from sweep.grid import Array
from sweep.kernels.methods import METHODS
from sweep.report.rows import Section

PALETTE = ("#4477aa", "#ee6677", "#228833", "#aa3377", "#ccbb44", "#66ccee", "#bbbbbb")


@dataclass(frozen=True)
class Spread:
    """Repeated measurements of one quantity."""

    values: Array

    @property
    def median(self) -> float:
        return float(np.median(self.values))

    def __format__(self, form: str) -> str:
        return f"{self.median:{form}} ({self.values.min():{form}} … {self.values.max():{form}})"


LINE = ("section", "model", "method", "case", "setting", "at", "quantity", "median", "smallest", "largest", "repeats")
"""The columns of bench.csv; `setting` was varied, to the value `at`."""


@dataclass(kw_only=True)
class BenchSection(Section):
    """A section of the report with its raw figures, and functions that draw its panels."""

    name: str
    """As in bench.csv."""
    readings: list[tuple[str | int, ...]] = field(default_factory=list)
    """Lines of bench.csv, as `LINE` has it."""
    panels: list[Callable[[Axes], None]] = field(default_factory=list)

    def add(self, model: str, method: str, case: str, setting: str, at: float, **quantities: Spread | float) -> None:
        """Note quantities that were found with the `setting` at this value; those that are NaN are left out."""
        for quantity, value in quantities.items():
            values = value.values if isinstance(value, Spread) else np.array([value], float)
            if not np.isnan(values).any():
                figures = [f"{figure:.6g}" for figure in (np.median(values), values.min(), values.max())]
                where = (self.name, model, method, case, setting, f"{at:.8g}", quantity)
                self.readings.append((*where, *figures, len(values)))


def colour(method: str) -> str:
    return PALETTE[list(METHODS).index(method) % len(PALETTE)]


def marker(method: str) -> str:
    return "so^vDP*X"[list(METHODS).index(method) % 8]


def curve(axes: Axes, x: Sequence[float], y: Sequence[Spread], **style: Any) -> None:
    """Draw medians against x, on logarithmic axes, with bars from the smallest to the largest value."""
    medians = np.array([spread.median for spread in y])
    ends = np.array([(spread.values.min(), spread.values.max()) for spread in y]).T
    axes.errorbar(x, medians, abs(ends - medians), linewidth=1, elinewidth=0.6, markersize=4, **style)
    axes.set(xscale="log", yscale="log")
