"""Time of whole runs against error in spin."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from matplotlib.axes import Axes

from sweep.bench.reference import Spins, read_spins, spin_errors, whole_steps
from sweep.bench.timing import MARKERS, Effort, Measurement, Part, Spread, Work, in_turn, runs_at, spread_out
from sweep.grid import Array
from sweep.kernels import methods
from sweep.models import MODELS
from sweep.parameters import PARAMETERS
from sweep.report.direct import make_kernel
from sweep.report.rows import Section

LOOSEST = 1e-3
"""The longest step tried is the automatic step for this tolerance."""

FLOOR = 1e-11
"""An error below this is round-off: a shorter step gains nothing."""

BOUND = 1e-6
"""Error at which the methods are compared."""

PALETTE = ("#4477aa", "#ee6677", "#228833", "#aa3377", "#ccbb44", "#66ccee", "#bbbbbb")


@dataclass(frozen=True)
class Point:
    """A step of a method: its error, and the runs that measure its cost."""

    model: str
    method: str
    case: str
    step: float
    error: float
    work: Work


def work_precision(effort: Effort) -> Part:
    """Time of whole runs against the largest error, for every method of every model."""
    points = [point for group in _groups(read_spins()) for point in _ladder(*group, effort)]
    times = in_turn({i: point.work for i, point in enumerate(points)}, effort)
    cost = [times[i].times(1e3 / len(point.work)) for i, point in enumerate(points)]
    part = Part(Section("Work and precision"))
    lines = [["model", "case", "method", "step", "largest error in spin", "ms per trajectory", "trajectories"]]
    for point, milliseconds in zip(points, cost, strict=True):
        error = f"{point.error:.1e}"
        where = [point.model, point.case, point.method, f"{point.step:.4g}", error, f"{milliseconds:.3g}"]
        lines.append([*where, str(len(point.work))])
        for quantity, spread in (("spin_error", Spread((point.error,))), ("ms_per_trajectory", milliseconds)):
            measured = ("precision", point.model, point.method, point.case, "step", point.step, quantity, spread)
            part.measurements.append(Measurement(*measured))
    caption = (
        "Whole runs to t = 400, start-up included, compilation excluded, with no measurement but the spin; median "
        f"(smallest … largest) of up to {effort.repeats} runs, in turn. The error is the largest over "
        "t = 25, 50, … 400. Steps at which a trajectory fails are left out."
    )
    medians = [spread.median for spread in cost]
    part.section.tables += [(caption, lines), _at_equal_error(points, medians)]
    part.panels = [_panel(points, cost, slip) for slip in (True, False)]
    return part


def _groups(spins: dict[str, Spins]) -> Iterator[tuple[str, str, str, Spins]]:
    """Model, method, name and bodies: one group for each friction of the slip model, one for each other model."""
    for model, reference in spins.items():
        for method in methods.allowed(MODELS[model]):
            if model != "slip":
                yield model, method, f"{len(reference.spins)} bodies", reference
                continue
            for body in np.flatnonzero(_standard_but_mu(reference)):
                mu = reference.columns["mu"][body]
                if mu >= 60 and runs_at(method, mu):
                    yield model, method, f"μ = {mu:g}", reference.select(np.array([body]))


def _standard_but_mu(reference: Spins) -> Array:
    others = [name for name in reference.columns if name != "mu"]
    alike = [reference.columns[name] == PARAMETERS[name].default for name in others]
    return np.asarray(np.all(alike, axis=0))


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


def _at_equal_error(points: list[Point], cost: list[float]) -> tuple[str, list[list[str]]]:
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


def _panel(points: list[Point], cost: list[Spread], slip: bool) -> Callable[[Axes], None]:
    """Draws a curve for each method, and each friction of the slip model or each other model."""
    curves: dict[tuple[str, str], list[tuple[float, Spread]]] = {}
    for point, milliseconds in zip(points, cost, strict=True):
        if (point.model == "slip") == slip:
            case = point.case if slip else point.model
            curves.setdefault((case, point.method), []).append((point.error, milliseconds))
    return partial(_draw, curves=curves, title=f"Work and precision, {'slip' if slip else 'reduced models'}")


def _draw(axes: Axes, curves: dict[tuple[str, str], list[tuple[float, Spread]]], title: str) -> None:
    """A curve for each case (a colour) and method (a marker)."""
    cases = list(dict.fromkeys(case for case, _ in curves))
    for (case, method), points in curves.items():
        errors, spreads = zip(*points, strict=True)
        colour = PALETTE[cases.index(case) % len(PALETTE)]
        axes.errorbar(
            errors, [s.median for s in spreads], np.transpose([s.reach for s in spreads]), fmt=f"{MARKERS[method]}-",
            color=colour, markerfacecolor="white" if method == methods.PLAIN else colour, label=f"{case}, {method}",
            linewidth=1, elinewidth=0.6, markersize=4,
        )  # fmt: skip
    axes.set(xscale="log", yscale="log", title=title, xlabel="largest error in spin", ylabel="ms per trajectory")
    axes.legend(fontsize=7)
