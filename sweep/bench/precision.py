"""Error in spin against time, and how well `tolerance` is kept and `energy_error` tells the error."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import compress

import numpy as np
from matplotlib.axes import Axes

from sweep.bench.reference import Spins, read_spins, spin_errors, whole_steps
from sweep.bench.timing import MARKERS, STEEPEST, Effort, Measurement, Part, Spread, Work, in_turn, spread_out
from sweep.grid import Array
from sweep.kernels import methods
from sweep.kernels.lanes import Kernel
from sweep.models import MODELS
from sweep.parameters import PARAMETERS
from sweep.report.cells import MEASURE, make_kernel
from sweep.report.rows import Section

LOOSEST = 1e-3
"""The longest step tried is the automatic one of this tolerance."""

FLOOR = 1e-11
"""An error below it is round-off; nothing is gained by a shorter step."""

BOUND = 1e-6
"""Error at which the methods are put beside each other."""

PALETTE = ("#4477aa", "#ee6677", "#228833", "#aa3377", "#ccbb44", "#66ccee", "#bbbbbb")


@dataclass(frozen=True)
class Point:
    """A step of a method: its error, and runs that tell its cost."""

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
    lines = [["model", "case", "method", "step", "largest error in spin", "ms a trajectory", "runs of"]]
    for point, milliseconds in zip(points, cost, strict=True):
        error = f"{point.error:.1e}"
        where = [point.model, point.case, point.method, f"{point.step:.4g}", error, f"{milliseconds:.3g}"]
        lines.append([*where, str(len(point.work))])
        for quantity, spread in (("spin_error", Spread((point.error,))), ("ms_a_trajectory", milliseconds)):
            measured = ("precision", point.model, point.method, point.case, "step", point.step, quantity, spread)
            part.measurements.append(Measurement(*measured))
    caption = (
        "Whole runs to t = 400, start-up included, compilation apart, nothing measured but the spin; median "
        f"(smallest … largest) of up to {effort.repeats} runs, in turn. Error: the largest over t = 25, 50, … 400."
    )
    medians = [spread.median for spread in cost]
    part.section.tables += [(caption, lines), _at_equal_error(points, medians)]
    slip = [point.model == "slip" for point in points]
    for chosen, title in ((slip, "slip"), ([not is_slip for is_slip in slip], "reduced models")):
        curves: dict[tuple[str, str], list[tuple[float, Spread]]] = {}
        for point, milliseconds in compress(zip(points, cost, strict=True), chosen):
            case = point.case if point.model == "slip" else point.model
            curves.setdefault((case, point.method), []).append((point.error, milliseconds))
        part.panels.append(partial(_draw_precision, curves=curves, title=f"Work and precision, {title}"))
    return part


def _groups(spins: dict[str, Spins]) -> Iterator[tuple[str, str, str, Spins]]:
    """Model, method, name and bodies: the slip model friction by friction, the others all bodies at once."""
    for model, reference in spins.items():
        for method in methods.allowed(MODELS[model]):
            if model != "slip":
                yield model, method, f"{len(reference.spins)} bodies", reference
                continue
            for body in np.flatnonzero(_standard_but_mu(reference)):
                mu = reference.columns["mu"][body]
                if mu >= 60 and (mu <= STEEPEST or method != "dopri5"):
                    yield model, method, f"μ = {mu:g}", reference.select(np.array([body]))


def _standard_but_mu(reference: Spins) -> Array:
    others = [name for name in reference.columns if name != "mu"]
    alike = [reference.columns[name] == PARAMETERS[name].default for name in others]
    return np.asarray(np.all(alike, axis=0))


def _ladder(model: str, method: str, case: str, reference: Spins, effort: Effort) -> Iterator[Point]:
    """Ever shorter steps, until the error falls no more."""
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
    """The cheapest setting of each method under `BOUND`, side by side."""
    lines = [["μ", "dopri5, ms a trajectory", "adams, ms a trajectory", "times faster"]]
    for case in dict.fromkeys(point.case for point in points if point.model == "slip"):
        best = {
            method: min(
                (
                    ms
                    for p, ms in zip(points, cost, strict=True)
                    if (p.case, p.method) == (case, method) and p.error <= BOUND
                ),
                default=np.nan,
            )
            for method in methods.METHODS
        }
        ratio = best["dopri5"] / best["adams"]
        shown = [f"{value:.3g}" if np.isfinite(value) else "—" for value in (*best.values(), ratio)]
        lines.append([case.removeprefix("μ = "), *shown])
    return f"The slip model at equal error: the fastest step with an error up to {BOUND:g}", lines


def _draw_precision(axes: Axes, curves: dict[tuple[str, str], list[tuple[float, Spread]]], title: str) -> None:
    """A curve for each case (a colour) and method (a marker)."""
    cases = list(dict.fromkeys(case for case, _ in curves))
    for (case, method), points in curves.items():
        errors, spreads = zip(*points, strict=True)
        colour = PALETTE[cases.index(case) % len(PALETTE)]
        axes.errorbar(
            errors, [s.median for s in spreads], np.transpose([s.reach for s in spreads]), fmt=f"{MARKERS[method]}-",
            color=colour, markerfacecolor=colour if method == "adams" else "white", label=f"{case}, {method}",
            linewidth=1, elinewidth=0.6, markersize=4,
        )  # fmt: skip
    axes.set(xscale="log", yscale="log", title=title, xlabel="largest error in spin", ylabel="ms a trajectory")
    axes.legend(fontsize=7)


@dataclass(frozen=True)
class Kept:
    """Errors at the automatic steps of one method: all of shape (bodies, tolerances)."""

    model: str
    method: str
    reference: Spins
    error: Array
    violation: Array


def tolerance(effort: Effort) -> Part:
    """Whether the error at the automatic step is what was asked for, and whether the energy tells it."""
    part = Part(Section("Is the tolerance kept, and does the energy tell the error?"))
    asked = effort.tolerances
    lines = [["model", "method", "body", *(f"{t:g}" for t in asked)]]
    kept = [_errors(model, method, spins, asked) for model, method, spins in _all_bodies(read_spins())]
    for one in kept:
        for body, (errors, violations) in enumerate(zip(one.error, one.violation, strict=True)):
            name = one.reference.name(body)
            marked = [f"{e:.1e}{' !' if e > t else ''}" for e, t in zip(errors, asked, strict=True)]
            lines.append([one.model, one.method, name, *marked])
            for t, e, v in zip(asked, errors, violations, strict=True):
                for quantity, value in (("spin_error", e), ("energy_error", v)):
                    where = ("tolerance", one.model, one.method, name, "tolerance", t, quantity)
                    part.measurements.append(Measurement(*where, Spread((float(value),))))
    share = ", ".join(f"{one.model} {one.method} {(one.error <= asked).mean():.0%}" for one in kept)
    caption = f"Largest error in spin, t <= 400, at the automatic step of each tolerance; ! is above it. Kept: {share}"
    part.section.tables += [(caption, lines), _predictor(kept)]
    part.panels += [lambda axes: _draw_kept(axes, kept, asked), lambda axes: _draw_predictor(axes, kept)]
    return part


def _all_bodies(spins: dict[str, Spins]) -> Iterator[tuple[str, str, Spins]]:
    for model, reference in spins.items():
        for method in methods.allowed(MODELS[model]):
            bodies = reference
            if method == "dopri5" and "mu" in reference.columns:
                bodies = reference.select(reference.columns["mu"] <= STEEPEST)
            yield model, method, bodies


def _errors(model: str, method: str, reference: Spins, asked: tuple[float, ...]) -> Kept:
    """All tolerances in one run; equal steps, where stability decides, are run once."""
    steps = [methods.automatic_step(method, MODELS[model], reference.columns, t)[0] for t in asked]
    bodies = np.tile(np.arange(len(reference.spins)), len(asked))
    runs, place = np.unique(
        np.stack([bodies, whole_steps(reference, np.concatenate(steps))]), axis=1, return_inverse=True
    )
    kernel: Kernel = make_kernel(method, MODELS[model], tuple(m for m in MEASURE if m in MODELS[model].measures))
    found = spin_errors(kernel, reference.select(runs[0].astype(int)), runs[1])
    error, violation = (values[place.ravel()].reshape(len(asked), -1).T for values in found)
    return Kept(model, method, reference, error, violation)


def _predictor(kept: list[Kept]) -> tuple[str, list[list[str]]]:
    head = [
        "model",
        "method",
        "runs",
        "spin error / energy_error: median",
        "quartiles",
        "correlation of the logarithms",
    ]
    lines = [head]
    for one in kept:
        error, violation = _above_floor(one)
        if len(error) < 3:
            continue
        ratio = error / violation
        low, middle, high = np.quantile(ratio, (0.25, 0.5, 0.75))
        likeness = np.corrcoef(np.log(error), np.log(violation))[0, 1]
        where = [one.model, one.method, str(len(error))]
        lines.append([*where, f"{middle:.2g}", f"{low:.2g} … {high:.2g}", f"{likeness:.2f}"])
    return f"How energy_error tells the error in spin, over runs with errors above {FLOOR:g}", lines


def _above_floor(one: Kept) -> tuple[Array, Array]:
    """Distinct pairs of spin error and energy error that are more than round-off."""
    pairs = np.unique(np.stack([one.error.ravel(), one.violation.ravel()]), axis=1)
    told = np.isfinite(pairs).all(axis=0) & (pairs[0] > FLOOR) & (pairs[1] > 0)
    return pairs[0, told], pairs[1, told]


def _draw_kept(axes: Axes, kept: list[Kept], asked: tuple[float, ...]) -> None:
    for i, one in enumerate(kept):
        for j, errors in enumerate(one.error):
            label = f"{one.model}, {one.method}" if not j else None
            axes.loglog(asked, errors, MARKERS[one.method], linestyle="-", linewidth=0.6, markersize=3,
                        color=PALETTE[i], label=label)  # fmt: skip
    axes.loglog(asked, asked, "k--", label="as asked")
    axes.set(title="Tolerance kept, a line a body", xlabel="tolerance", ylabel="largest error in spin")
    axes.legend(fontsize=7)


def _draw_predictor(axes: Axes, kept: list[Kept]) -> None:
    for i, one in enumerate(kept):
        error, violation = _above_floor(one)
        if len(error):
            axes.loglog(violation, error, MARKERS[one.method], linestyle="", markersize=4, color=PALETTE[i],
                        label=f"{one.model}, {one.method}")  # fmt: skip
    axes.set(title="Does the energy tell the error?", xlabel="energy_error", ylabel="largest error in spin")
    axes.legend(fontsize=7)
