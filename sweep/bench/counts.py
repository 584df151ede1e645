"""Share of wrong reversal counts at each tolerance."""

from __future__ import annotations

from functools import partial

import numpy as np
from matplotlib.axes import Axes

from sweep.bench.reference import Counts, at_each, read_counts
from sweep.bench.section import BenchSection, colour, marker
from sweep.bench.timing import LONGEST, Effort
from sweep.grid import Array
from sweep.kernels.methods import METHODS, automatic_step
from sweep.models import MODELS
from sweep.report.direct import simulate

SPARSE = 5
"""A method whose stability limits the step runs every fifth cell of the reference: dopri5 takes ten times as long."""


def wrong_counts(effort: Effort) -> BenchSection:
    reference, section = read_counts(), BenchSection("Wrong counts", name="counts")
    lines = [["method", "cells", "which", *(f"{t:g}" for t in effort.tolerances)]]
    shares: dict[tuple[str, str], Array] = {}
    for name, method in METHODS.items():
        sample = np.arange(0, len(reference.reversals), 1 if method.stable_step is None else SPARSE)
        wrong = counts(name, reference, sample, effort.tolerances) != reference.reversals[sample]
        for group, chosen in {"all": np.full(len(sample), True), "firm": reference.firm[sample]}.items():
            shares[name, group] = share = wrong[:, chosen].mean(axis=1)
            shown = [f"{s:.1%} ({n})" for s, n in zip(share, wrong[:, chosen].sum(axis=1), strict=True)]
            lines.append([name, f"{chosen.sum()} of {len(reference.reversals)}", group, *shown])
            for tolerance, s in zip(effort.tolerances, share, strict=True):
                section.add("slip", name, group, "tolerance", tolerance, share_wrong=s)
    caption = (
        "Share (and number) of cells whose count differs from the reference, by tolerance. "
        "firm: cells whose reference count depends neither on round-off nor on where the windows begin"
    )
    section.tables.append((caption, lines))
    section.panels.append(partial(_draw, shares=shares, asked=effort.tolerances))
    return section


def counts(method: str, reference: Counts, sample: Array, asked: tuple[float, ...]) -> Array:
    """Reversals at each tolerance, shape (tolerances, sample)."""
    columns = {name: column[sample] for name, column in reference.columns.items()}

    def reversals(cells: Array, steps: Array) -> Array:
        chosen = {name: column[cells] for name, column in columns.items()}
        return simulate(chosen, LONGEST, method=method, step=steps, settle=True)["reversals"]

    return at_each([automatic_step(method, MODELS["slip"], columns, t)[0] for t in asked], reversals)


def _draw(axes: Axes, shares: dict[tuple[str, str], Array], asked: tuple[float, ...]) -> None:
    for (method, group), share in shares.items():
        face, line = ("white", "--") if group == "all" else (colour(method), "-")
        axes.semilogx(asked, share * 100, marker(method), linestyle=line, color=colour(method),
                      markerfacecolor=face, label=f"{method}, {group}")  # fmt: skip
    axes.set(title="Wrong counts", xlabel="tolerance", ylabel="cells with a wrong count, %")
    axes.set_ylim(bottom=0)
