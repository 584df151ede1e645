"""Errors at the automatic step for each tolerance."""

from __future__ import annotations

from functools import partial

import numpy as np
from matplotlib.axes import Axes

from sweep.bench.reference import comparisons, spin_errors, whole_steps
from sweep.bench.section import PALETTE, BenchSection, marker
from sweep.bench.timing import Effort
from sweep.grid import Array
from sweep.kernels import methods
from sweep.models import MODELS
from sweep.report.direct import make_kernel

Key = tuple[str, str]
"""A model and a method."""


def tolerance(effort: Effort) -> BenchSection:
    section, asked = BenchSection("Is the tolerance kept?", name="tolerance"), effort.tolerances
    lines = [["model", "method", "body", *(f"{t:g}" for t in asked)]]
    kept: dict[Key, Array] = {}
    for name, method, reference in comparisons():
        model, kernel = MODELS[name], make_kernel(method, MODELS[name])
        steps = [methods.automatic_step(method, model, reference.columns, t)[0] for t in asked]
        # Of shape (bodies, tolerances).
        found = [spin_errors(kernel, reference, whole_steps(reference, step)) for step in steps]
        error, violation = np.stack(found, axis=2)
        kept[name, method] = error
        for body, (errors, violations) in enumerate(zip(error, violation, strict=True)):
            marked = [f"{e:.1e}{' !' if e > t else ''}" for e, t in zip(errors, asked, strict=True)]
            lines.append([name, method, reference.name(body), *marked])
            for t, e, v in zip(asked, errors, violations, strict=True):
                section.add(name, method, reference.name(body), "tolerance", t, spin_error=e, energy_error=v)
    share = ", ".join(f"{' '.join(key)} {(error <= asked).mean():.0%}" for key, error in kept.items())
    caption = (
        "Largest error in spin, t <= 400, at the automatic step for each tolerance; ! marks errors above it. "
        f"Tolerance kept: {share}"
    )
    section.tables.append((caption, lines))
    section.panels.append(partial(_draw, kept=kept, asked=asked))
    return section


def _draw(axes: Axes, kept: dict[Key, Array], asked: tuple[float, ...]) -> None:
    for i, ((model, method), error) in enumerate(kept.items()):
        colour = PALETTE[i % len(PALETTE)]
        lines = axes.loglog(asked, error.T, f"{marker(method)}-", linewidth=0.6, markersize=3, color=colour)
        lines[0].set_label(f"{model}, {method}")
    axes.loglog(asked, asked, "k--", label="error = tolerance")
    axes.set(title="Is the tolerance kept? One line per body", xlabel="tolerance", ylabel="largest error in spin")
