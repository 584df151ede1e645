"""Errors at the automatic step for each tolerance, and how well `energy_error` predicts them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from matplotlib.axes import Axes

from sweep.bench.precision import FLOOR
from sweep.bench.reference import Spins, at_each, comparisons, spin_errors, whole_steps
from sweep.bench.section import PALETTE, BenchSection, marker
from sweep.bench.timing import Effort
from sweep.grid import Array
from sweep.kernels import methods
from sweep.models import MODELS
from sweep.report.direct import MEASURE, make_kernel
from sweep.report.rows import Table


@dataclass(frozen=True)
class Kept:
    """Errors at the automatic steps of one method, all of shape (bodies, tolerances)."""

    model: str
    method: str
    reference: Spins
    error: Array
    violation: Array
    """NaN where the model does not measure it."""

    def above_floor(self) -> tuple[Array, Array]:
        """Distinct pairs of spin error and energy error that exceed round-off."""
        pairs = np.unique(np.stack([self.error.ravel(), self.violation.ravel()]), axis=1)
        told = np.isfinite(pairs).all(axis=0) & (pairs[0] > FLOOR) & (pairs[1] > 0)
        return pairs[0, told], pairs[1, told]


def tolerance(effort: Effort) -> BenchSection:
    title = "Is the tolerance kept, and does the energy error predict the error?"
    section, asked = BenchSection(title, name="tolerance"), effort.tolerances
    kept = [_errors(model, method, spins, asked) for model, method, spins in comparisons()]
    lines = [["model", "method", "body", *(f"{t:g}" for t in asked)]]
    for one in kept:
        for body, (errors, violations) in enumerate(zip(one.error, one.violation, strict=True)):
            name = one.reference.name(body)
            marked = [f"{e:.1e}{' !' if e > t else ''}" for e, t in zip(errors, asked, strict=True)]
            lines.append([one.model, one.method, name, *marked])
            for t, e, v in zip(asked, errors, violations, strict=True):
                section.add(one.model, one.method, name, "tolerance", t, spin_error=e, energy_error=v)
    share = ", ".join(f"{one.model} {one.method} {(one.error <= asked).mean():.0%}" for one in kept)
    caption = (
        "Largest error in spin, t <= 400, at the automatic step for each tolerance; ! marks errors above it. "
        f"Tolerance kept: {share}"
    )
    section.tables += [(caption, lines), _predictor(kept)]
    section.panels += [partial(_draw_kept, kept=kept, asked=asked), partial(_draw_predictor, kept=kept)]
    return section


def _errors(model: str, method: str, reference: Spins, asked: tuple[float, ...]) -> Kept:
    kernel = make_kernel(method, MODELS[model], MEASURE)
    wanted = [methods.automatic_step(method, MODELS[model], reference.columns, t)[0] for t in asked]
    steps = [whole_steps(reference, step) for step in wanted]
    error, violation = at_each(steps, lambda bodies, step: spin_errors(kernel, reference.select(bodies), step))
    return Kept(model, method, reference, error.T, violation.T)


def _predictor(kept: list[Kept]) -> Table:
    lines = [["model", "method", "runs", "spin error / energy_error: median", "quartiles", "correlation of logarithms"]]
    for one in kept:
        error, violation = one.above_floor()
        if len(error) < 3:
            continue
        low, middle, high = np.quantile(error / violation, (0.25, 0.5, 0.75))
        likeness = np.corrcoef(np.log(error), np.log(violation))[0, 1]
        shown = (f"{middle:.2g}", f"{low:.2g} … {high:.2g}", f"{likeness:.2f}")
        lines.append([one.model, one.method, str(len(error)), *shown])
    return f"The error in spin beside energy_error, for runs with errors above {FLOOR:g}", lines


def _draw_kept(axes: Axes, kept: list[Kept], asked: tuple[float, ...]) -> None:
    for i, one in enumerate(kept):
        lines = axes.loglog(asked, one.error.T, f"{marker(one.method)}-", linewidth=0.6, markersize=3,
                            color=PALETTE[i % len(PALETTE)])  # fmt: skip
        lines[0].set_label(f"{one.model}, {one.method}")
    axes.loglog(asked, asked, "k--", label="error = tolerance")
    axes.set(title="Is the tolerance kept? One line per body", xlabel="tolerance", ylabel="largest error in spin")


def _draw_predictor(axes: Axes, kept: list[Kept]) -> None:
    for i, one in enumerate(kept):
        error, violation = one.above_floor()
        if len(error):
            axes.loglog(violation, error, marker(one.method), markersize=4, color=PALETTE[i % len(PALETTE)],
                        label=f"{one.model}, {one.method}")  # fmt: skip
    axes.set(title="Does the energy error predict the error?", xlabel="energy_error", ylabel="largest error in spin")
