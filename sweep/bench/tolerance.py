"""Whether `tolerance` is kept, and whether `energy_error` predicts the error."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from sweep.bench.precision import FLOOR, PALETTE
from sweep.bench.reference import Spins, read_spins, spin_errors, whole_steps
from sweep.bench.timing import MARKERS, Effort, Measurement, Part, Spread, runs_at
from sweep.grid import Array
from sweep.kernels import measures, methods
from sweep.models import MODELS
from sweep.report.direct import MEASURE, make_kernel
from sweep.report.rows import Section


@dataclass(frozen=True)
class Kept:
    """Errors at the automatic steps of one method, all of shape (bodies, tolerances)."""

    model: str
    method: str
    reference: Spins
    error: Array
    violation: Array
    """NaN where the model does not measure it."""


def tolerance(effort: Effort) -> Part:
    """Whether the automatic step keeps the error below the tolerance, and whether the energy error predicts it."""
    part = Part(Section("Is the tolerance kept, and does the energy error predict the error?"))
    asked = effort.tolerances
    lines = [["model", "method", "body", *(f"{t:g}" for t in asked)]]
    kept = [_errors(model, method, spins, asked) for model, method, spins in _all_bodies(read_spins())]
    for one in kept:
        for body, (errors, violations) in enumerate(zip(one.error, one.violation, strict=True)):
            name = one.reference.name(body)
            marked = [f"{e:.1e}{' !' if e > t else ''}" for e, t in zip(errors, asked, strict=True)]
            lines.append([one.model, one.method, name, *marked])
            for t, e, v in zip(asked, errors, violations, strict=True):
                where = ("tolerance", one.model, one.method, name, "tolerance", t)
                part.measurements.append(Measurement(*where, "spin_error", Spread((float(e),))))
                if not np.isnan(v):
                    part.measurements.append(Measurement(*where, "energy_error", Spread((float(v),))))
    share = ", ".join(f"{one.model} {one.method} {(one.error <= asked).mean():.0%}" for one in kept)
    caption = (
        "Largest error in spin, t <= 400, at the automatic step for each tolerance; ! marks errors above it. "
        f"Tolerance kept: {share}"
    )
    part.section.tables += [(caption, lines), _predictor(kept)]
    part.panels += [lambda axes: _draw_kept(axes, kept, asked), lambda axes: _draw_predictor(axes, kept)]
    return part


def _all_bodies(spins: dict[str, Spins]) -> Iterator[tuple[str, str, Spins]]:
    for model, reference in spins.items():
        for method in methods.allowed(MODELS[model]):
            bodies = reference
            if "mu" in reference.columns:
                bodies = reference.select(np.array([runs_at(method, mu) for mu in reference.columns["mu"]]))
            yield model, method, bodies


def _errors(model: str, method: str, reference: Spins, asked: tuple[float, ...]) -> Kept:
    """All tolerances in one run.  Equal steps, which occur where stability decides, are run once."""
    steps = [methods.automatic_step(method, MODELS[model], reference.columns, t)[0] for t in asked]
    bodies = np.tile(np.arange(len(reference.spins)), len(asked))
    runs, place = np.unique(
        np.stack([bodies, whole_steps(reference, np.concatenate(steps))]), axis=1, return_inverse=True
    )
    kernel = make_kernel(method, MODELS[model], tuple(m for m in MEASURE if m in measures.possible(MODELS[model])))
    found = spin_errors(kernel, reference.select(runs[0].astype(int)), runs[1])
    error, violation = (values[place.ravel()].reshape(len(asked), -1).T for values in found)
    return Kept(model, method, reference, error, violation)


def _predictor(kept: list[Kept]) -> tuple[str, list[list[str]]]:
    head = ["model", "method", "runs", "spin error / energy_error: median", "quartiles", "correlation of logarithms"]
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
    return f"The error in spin beside energy_error, for runs with errors above {FLOOR:g}", lines


def _above_floor(one: Kept) -> tuple[Array, Array]:
    """Distinct pairs of spin error and energy error that exceed round-off."""
    pairs = np.unique(np.stack([one.error.ravel(), one.violation.ravel()]), axis=1)
    told = np.isfinite(pairs).all(axis=0) & (pairs[0] > FLOOR) & (pairs[1] > 0)
    return pairs[0, told], pairs[1, told]


def _draw_kept(axes: Axes, kept: list[Kept], asked: tuple[float, ...]) -> None:
    for i, one in enumerate(kept):
        for j, errors in enumerate(one.error):
            label = f"{one.model}, {one.method}" if not j else None
            axes.loglog(asked, errors, MARKERS[one.method], linestyle="-", linewidth=0.6, markersize=3,
                        color=PALETTE[i], label=label)  # fmt: skip
    axes.loglog(asked, asked, "k--", label="error = tolerance")
    axes.set(title="Is the tolerance kept? One line per body", xlabel="tolerance", ylabel="largest error in spin")
    axes.legend(fontsize=7)


def _draw_predictor(axes: Axes, kept: list[Kept]) -> None:
    for i, one in enumerate(kept):
        error, violation = _above_floor(one)
        if len(error):
            axes.loglog(violation, error, MARKERS[one.method], linestyle="", markersize=4, color=PALETTE[i],
                        label=f"{one.model}, {one.method}")  # fmt: skip
    axes.set(title="Does the energy error predict the error?", xlabel="energy_error", ylabel="largest error in spin")
    if axes.lines:  # with a small effort every error may be round-off
        axes.legend(fontsize=7)
