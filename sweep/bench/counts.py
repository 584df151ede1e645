"""Share of wrong reversal counts at each tolerance."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from sweep.bench.reference import Counts, read_counts
from sweep.bench.timing import COLOURS, MARKERS, Effort, Measurement, Part, Spread
from sweep.grid import Array
from sweep.kernels import methods
from sweep.kernels.methods import METHODS
from sweep.models import MODELS
from sweep.report.direct import simulate
from sweep.report.rows import Section

T_END = 30_000.0

EVERY = {name: 1 if method.stable_step is None else 5 for name, method in METHODS.items()}
"""Every n-th cell of the reference is run, because dopri5 takes ten times as long as adams."""


def wrong_counts(effort: Effort) -> Part:
    reference = read_counts()
    part = Part(Section("Wrong counts"))
    lines = [["method", "cells", "which", *(f"{t:g}" for t in effort.tolerances)]]
    shares: dict[tuple[str, str], list[float]] = {}
    for method, every in EVERY.items():
        sample = np.arange(0, len(reference.reversals), every)
        wrong = counts(method, reference, sample, effort.tolerances) != reference.reversals[sample]
        groups = {"all": np.full(len(sample), True), "firm": reference.firm[sample]}
        for group, chosen in groups.items():
            shares[method, group] = share = wrong[:, chosen].mean(axis=1).tolist()
            shown = [f"{s:.1%} ({n})" for s, n in zip(share, wrong[:, chosen].sum(axis=1), strict=True)]
            lines.append([method, f"{chosen.sum()} of {len(reference.reversals)}", group, *shown])
            part.measurements += [
                Measurement("counts", "slip", method, group, "tolerance", t, "share_wrong", Spread((s,)))
                for t, s in zip(effort.tolerances, share, strict=True)
            ]
    part.section.tables.append((
        "Share (and number) of cells whose count differs from the reference, by tolerance. "
        "firm: cells whose reference count depends neither on round-off nor on where the windows begin",
        lines,
    ))  # fmt: skip
    part.panels.append(lambda axes: _draw(axes, shares, effort.tolerances))
    return part


def counts(method: str, reference: Counts, sample: Array, asked: tuple[float, ...]) -> Array:
    """Reversals at each tolerance, shape (tolerances, sample).  Cells with equal steps are run once."""
    columns = {name: column[sample] for name, column in reference.columns.items()}
    steps = np.concatenate([methods.automatic_step(method, MODELS["slip"], columns, t)[0] for t in asked])
    cells = np.tile(np.arange(len(sample)), len(asked))
    runs, place = np.unique(np.stack([cells, steps]), axis=1, return_inverse=True)
    chosen = {name: column[runs[0].astype(int)] for name, column in columns.items()}
    ends = simulate(chosen, T_END, method=method, step=runs[1], settle=True)
    return np.asarray(ends["reversals"][place.ravel()].reshape(len(asked), -1))


def _draw(axes: Axes, shares: dict[tuple[str, str], list[float]], asked: tuple[float, ...]) -> None:
    for (method, group), share in shares.items():
        colour = COLOURS[method]
        face, line = ("white", "--") if group == "all" else (colour, "-")
        axes.semilogx(asked, np.array(share) * 100, MARKERS[method], linestyle=line, color=colour,
                      markerfacecolor=face, label=f"{method}, {group}")  # fmt: skip
    axes.set(title="Wrong counts", xlabel="tolerance", ylabel="cells with a wrong count, %")
    axes.set_ylim(bottom=0)
    axes.legend(fontsize=7)
