"""Time of whole runs against error in spin."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from matplotlib.axes import Axes

from sweep.bench.reference import Spins, comparisons, spin_errors, whole_steps
from sweep.bench.section import PALETTE, BenchSection, Spread, curve, marker
from sweep.bench.timing import Effort, Work, in_turn, spread_out
from sweep.kernels import methods
from sweep.models import MODELS
from sweep.report.direct import make_kernel
from sweep.report.rows import Table

LOOSEST = 1e-3
"""The longest step tried is the automatic step for this tolerance."""

FLOOR = 1e-11
"""An error below this is round-off: a shorter step gains nothing."""

BOUND = 1e-6
"""Error at which the methods are compared."""


@dataclass(frozen=True)
class Point:
    """A step of a method: its error, and the runs that measure its cost."""

    model: str
    method: str
    case: str
    step: float
    error: float
    work: Work


def work_precision(effort: Effort) -> BenchSection:
    """Time of whole runs against the largest error, for every method of every model."""
    section = BenchSection("Work and precision", name="precision")
    points = [point for group in _groups() for point in _ladder(*group, effort)]
    times = in_turn({i: point.work for i, point in enumerate(points)}, effort)
    cost = [Spread(1e3 / len(point.work) * times[i].values) for i, point in enumerate(points)]
    lines = [["model", "case", "method", "step", "largest error in spin", "ms per trajectory", "trajectories"]]
    for point, spread in zip(points, cost, strict=True):
        shown = (f"{point.step:.4g}", f"{point.error:.1e}", f"{spread:.3g}", str(len(point.work)))
        lines.append([point.model, point.case, point.method, *shown])
        where = (point.model, point.method, point.case, "step", point.step)
        section.add(*where, spin_error=point.error, ms_per_trajectory=spread)
    caption = (
        "Whole runs to t = 400, start-up included, compilation excluded, with no measurement but the spin; median "
        f"(smallest … largest) of up to {effort.repeats} runs, in turn. The error is the largest over "
        "t = 25, 50, … 400. Steps at which a trajectory fails are left out."
    )
    section.tables += [(caption, lines), at_equal_error(points, [spread.median for spread in cost])]
    section.panels += [partial(_draw, points=points, cost=cost, slip=slip) for slip in (True, False)]
    return section


def _groups() -> Iterator[tuple[str, str, str, Spins]]:
    """Model, method, name and bodies: one group for each friction of the slip model, one for each other model."""
    for model, method, reference in comparisons():
        if model != "slip":
            yield model, method, f"{len(reference.spins)} bodies", reference
            continue
        for body, mu in enumerate(reference.columns["mu"]):
            if mu >= 60 and reference.name(body) == f"μ = {mu:g}":
                yield model, method, reference.name(body), reference.select(np.array([body]))


def _ladder(model: str, method: str, case: str, reference: Spins, effort: Effort) -> Iterator[Point]:
    """Shorter and shorter steps, until the error no longer falls."""
    kernel = make_kernel(method, MODELS[model], ())
    longest, _ = methods.automatic_step(method, MODELS[model], reference.columns, LOOSEST)
    many = spread_out(reference.columns, effort.trajectories)
    best = np.inf
    for rung in range(effort.rungs):
        step = whole_steps(reference, longest / 2 ** (rung / 2))
        error = float(spin_errors(kernel, reference, step)[0].max())
        if error < best:
            work = Work(kernel, many, np.resize(step, effort.trajectories)).affordable(effort)
            yield Point(model, method, case, float(np.median(step)), error, work)
        if error < FLOOR or error > 0.7 * best:
            return
        best = error


def at_equal_error(points: list[Point], cost: list[float]) -> Table:
    """The cheapest step of each method with an error up to `BOUND`, side by side."""
    best: dict[str, dict[str, float]] = {}
    for point, milliseconds in zip(points, cost, strict=True):
        if point.model == "slip" and point.error <= BOUND:
            cheapest = best.setdefault(point.case, dict.fromkeys(methods.METHODS, np.inf))
            cheapest[point.method] = min(cheapest[point.method], milliseconds)
    faster = [method for method in methods.METHODS if method != methods.PLAIN]
    head = (f"{method}, ms per trajectory" for method in methods.METHODS)
    lines = [["slip", *head, *(f"{method}: times faster" for method in faster)]]
    for case, found in best.items():
        ratios = (found[methods.PLAIN] / found[method] for method in faster)
        lines.append([case, *(f"{x:.3g}" if np.isfinite(x) else "—" for x in (*found.values(), *ratios))])
    return f"The slip model at equal error: the cheapest step with an error up to {BOUND:g}", lines


def _draw(axes: Axes, points: list[Point], cost: list[Spread], slip: bool) -> None:
    """A curve for each method (a marker), and each friction of the slip model or each other model (a colour)."""
    curves: dict[tuple[str, str], list[tuple[float, Spread]]] = {}
    for point, spread in zip(points, cost, strict=True):
        if (point.model == "slip") == slip:
            curves.setdefault((point.case if slip else point.model, point.method), []).append((point.error, spread))
    cases = list(dict.fromkeys(case for case, _ in curves))
    for (case, method), found in curves.items():
        colour = PALETTE[cases.index(case) % len(PALETTE)]
        face = "white" if method == methods.PLAIN else colour
        curve(axes, *zip(*found, strict=True), fmt=f"{marker(method)}-", color=colour, markerfacecolor=face,
              label=f"{case}, {method}")  # fmt: skip
    axes.set(xlabel="largest error in spin", ylabel="ms per trajectory")
    axes.set_title(f"Work and precision, {'slip' if slip else 'reduced models'}")
