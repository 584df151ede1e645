"""Measures the time of whole runs against the error in spin."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.bench.reference import Spins, comparisons, spin_errors, whole_steps
from sweep.engine.executor import execute, nominal_seconds
from sweep.grid import Array
from sweep.kernels import methods
from sweep.kernels.kernel import Kernel
from sweep.kernels.layout import LANES
from sweep.models import MODELS
from sweep.models.model import Columns
from sweep.report.direct import make_kernel
from sweep.report.rows import Section, Table

T_END = 400.0
"""The time for which `tolerance` bounds the error in spin, in sqrt(c/g)."""

LOOSEST = 1e-3
"""The longest step tried is the automatic step for this tolerance."""

FLOOR = 1e-11
"""An error below this is round-off: a shorter step gains nothing."""

BOUND = 1e-6
"""Error at which the methods are compared."""

PALETTE = ("#4477aa", "#ee6677", "#228833", "#aa3377", "#ccbb44", "#66ccee", "#bbbbbb")
MARKERS = "so^vDP*X"


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


@dataclass(frozen=True)
class Point:
    """A step of a method: its error, and the run of many trajectories that measures its cost."""

    model: str
    method: str
    case: str
    step: float
    error: float
    trajectories: int
    run: Callable[[], Any]


@dataclass(frozen=True)
class Measured:
    """Return a point, and the time of its runs in ms per trajectory."""

    point: Point
    cost: Spread

    @property
    def nanoseconds(self) -> float:
        """Return the time of a step of one trajectory."""
        return 1e6 * self.cost.median * self.point.step / T_END


def measure(effort: Effort) -> list[Measured]:
    """Measure time against error for steps of every method of every model."""
    points = [point for group in _groups() for point in _ladder(*group, effort)]
    times = in_turn([point.run for point in points], effort)
    return [Measured(p, Spread(1e3 / p.trajectories * each.values)) for p, each in zip(points, times, strict=True)]


def _groups() -> Iterator[tuple[str, str, str, Spins]]:
    """Return model, method, name and bodies: one group for each friction of the slip model and each other model."""
    for model, method, reference in comparisons():
        if model != "slip":
            yield model, method, f"{len(reference.spins)} bodies", reference
            continue
        for body, mu in enumerate(reference.columns["mu"]):
            if mu >= 60 and reference.is_standard(body):
                yield model, method, f"μ = {mu:g}", reference.select(np.array([body]))


def _ladder(model: str, method: str, case: str, reference: Spins, effort: Effort) -> Iterator[Point]:
    """Yield shorter and shorter steps, until the error stops falling."""
    kernel = make_kernel(method, MODELS[model], ())
    longest, _ = methods.automatic_step(method, MODELS[model], reference.columns, LOOSEST)
    best = np.inf
    for rung in range(effort.rungs):
        step = whole_steps(reference, longest / 2 ** (rung / 2))
        error = float(spin_errors(kernel, reference, step).max())
        if error < best:
            count = _affordable(step, effort)
            run = partial(_run, kernel, _spread_out(reference.columns, count), np.resize(step, count))
            yield Point(model, method, case, float(np.median(step)), error, count, run)
        if error < FLOOR or error > 0.7 * best:
            return
        best = error


def _affordable(step: Array, effort: Effort) -> int:
    """Return how many trajectories should run in a third of the patience."""
    count = effort.trajectories
    seconds = nominal_seconds(T_END / np.resize(step, count))
    while count > 2 * LANES and seconds > effort.patience / 3:
        count, seconds = count // 2, seconds / 2
    return count


def _run(kernel: Kernel, columns: Columns, step: Array) -> None:
    """Run trajectories from their parameters to `T_END`, start-up included."""
    execute(kernel, kernel.start(columns, step, T_END))


def _spread_out(columns: Columns, count: int) -> dict[str, Array]:
    """Repeat the bodies of `columns` in `count` trajectories, whose spins differ by up to a thousandth."""
    many = {name: np.resize(values, count) for name, values in columns.items()}
    return many | {"n0": many["n0"] * (1 + 1e-3 * np.arange(count) / count)}


def in_turn(works: Sequence[Callable[[], Any]], effort: Effort) -> list[Spread]:
    """Time each task, in seconds. They run in turn, so that changes in the machine's speed affect all alike."""
    times: list[list[float]] = [[] for _ in works]
    for _ in range(effort.repeats):
        for work, seconds in zip(works, times, strict=True):
            if len(seconds) >= 3 and sum(seconds) > effort.patience:
                continue
            began = time.perf_counter()
            work()
            seconds.append(time.perf_counter() - began)
    return [Spread(np.array(seconds)) for seconds in times]


def section(found: list[Measured], effort: Effort) -> Section:
    """Make the section of the report: all points, the methods at equal error, and the picture."""
    heads = ["step", "largest error in spin", "ms per trajectory", "ns per step", "trajectories"]
    lines = [["model", "case", "method", *heads]]
    for each in found:
        point, size = each.point, str(each.point.trajectories)
        shown = (f"{point.step:.4g}", f"{point.error:.1e}", f"{each.cost:.3g}", f"{each.nanoseconds:.3g}", size)
        lines.append([point.model, point.case, point.method, *shown])
    caption = (
        f"Whole runs to t = {T_END:g}, start-up included, compilation excluded, with no measurement but the spin; "
        f"median (smallest … largest) of up to {effort.repeats} runs, in turn. The error is the largest over "
        "t = 25, 50, … 400. Steps at which a trajectory fails are left out."
    )
    figures = [("speed against error", draw(found))]
    return Section("Speed against error", figures=figures, tables=[(caption, lines), at_equal_error(found)])


def at_equal_error(found: list[Measured]) -> Table:
    """Compare the cheapest step of each method whose error is at most `BOUND`."""
    best: dict[str, dict[str, float]] = {}
    for each in found:
        point = each.point
        if point.model == "slip" and point.error <= BOUND:
            cheapest = best.setdefault(point.case, dict.fromkeys(methods.METHODS, np.inf))
            cheapest[point.method] = min(cheapest[point.method], each.cost.median)
    faster = [method for method in methods.METHODS if method != methods.PLAIN]
    head = (f"{method}, ms per trajectory" for method in methods.METHODS)
    lines = [["slip", *head, *(f"{method}: times faster" for method in faster)]]
    for case, costs in best.items():
        ratios = (costs[methods.PLAIN] / costs[method] for method in faster)
        lines.append([case, *(f"{x:.3g}" if 0 < x < np.inf else "—" for x in (*costs.values(), *ratios))])
    return f"The slip model at equal error: the cheapest step with an error up to {BOUND:g}", lines


def draw(found: list[Measured]) -> Figure:
    """Draw time against error: a panel for the slip model, by friction, and one for the others."""
    figure = Figure(figsize=(12, 4.6), dpi=90, layout="constrained")
    for axes, slip in zip(figure.subplots(1, 2), (True, False), strict=True):
        _draw(axes, [each for each in found if (each.point.model == "slip") == slip], slip)
    return figure


def _draw(axes: Axes, found: list[Measured], slip: bool) -> None:
    """Draw a curve for each method (a marker), and each friction of the slip model or each other model (a colour)."""
    curves: dict[tuple[str, str], list[Measured]] = {}
    for each in found:
        curves.setdefault((each.point.case if slip else each.point.model, each.point.method), []).append(each)
    cases = list(dict.fromkeys(case for case, _ in curves))
    for (case, method), points in curves.items():
        colour = PALETTE[cases.index(case) % len(PALETTE)]
        marker = MARKERS[list(methods.METHODS).index(method) % len(MARKERS)]
        medians = np.array([each.cost.median for each in points])
        bars = np.abs(np.array([each.cost.ends for each in points]).T - medians)
        axes.errorbar([each.point.error for each in points], medians, bars, fmt=f"{marker}-", color=colour,
                      markerfacecolor="white" if method == methods.PLAIN else colour, linewidth=1, elinewidth=0.6,
                      markersize=4, label=f"{case}, {method}")  # fmt: skip
    axes.set(xscale="log", yscale="log", xlabel="largest error in spin", ylabel="ms per trajectory")
    axes.set_title(f"Speed against error, {'slip' if slip else 'reduced models'}")
    axes.grid(which="major", alpha=0.3)
    if curves:
        axes.legend(fontsize=7)
