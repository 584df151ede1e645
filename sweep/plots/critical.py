"""Critical spins of a dataset of `sweep critical`."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sweep.plots import labels, legends, theory
from sweep.plots.axes import set_scale
from sweep.plots.figure import Picture
from sweep.plots.maps import arrangement
from sweep.plots.panels import MAX_PANELS, heading, indices, title

_COLOURS = {"n_c1": "C0", "n_c2": "C1"}

_SOURCES: dict[str, tuple[str, dict[str, Any]]] = {
    "": ("formula of Takano (2011)", {"linestyle": "--"}),
    "_linear": ("eigenvalues of the model", {"linestyle": "-"}),
    "_simulated": ("simulation", {"linestyle": "none", "marker": "x", "markersize": 4}),
}
"""Where a critical spin comes from, and how that is drawn."""


def draw(dataset: xr.Dataset) -> Figure:
    """Critical spins by formula, eigenvalues and simulation, over the longest axis."""
    dims = [str(d) for d in dataset["n_c1_plus_simulated"].dims]
    dims.sort(key=lambda d: -dataset.sizes[d])
    x = dims[0] if dims else None
    panels = list(indices(dataset, dims[1:]))[:MAX_PANELS]
    rows, columns = arrangement(len(panels), 2)
    figure = Picture(figsize=(min(8 * columns, 14), 2 + 3.2 * rows), dpi=110, layout="constrained")
    figure.suptitle(heading(dataset, figure.get_figwidth()), fontsize=10)
    grid = figure.subplots(rows, columns, squeeze=False, sharex=True).ravel()
    for k, (axes, panel) in enumerate(zip(grid, panels, strict=False)):
        chosen = dataset.isel(panel)
        at = np.atleast_1d(chosen[x].values) if x else np.zeros(1)
        order = np.argsort(at)
        set_scale(axes, "x", at[order])
        for name, colour in _COLOURS.items():
            for side in ("plus", "minus"):
                for suffix, (_, style) in _SOURCES.items():
                    if (variable := f"{name}_{side}{suffix}") in chosen:
                        values = np.atleast_1d(chosen[variable].values)
                        axes.plot(at[order], values[order], color=colour, linewidth=1, gid=variable, **style)
        axes.axhline(0, color="black", linewidth=0.5)
        axes.set_title(title(dataset, panel), fontsize=9)
        axes.set_ylabel(f"spin n ({labels.unit(dataset, 'n_c1_plus_simulated')})", fontsize=9)
        axes.tick_params(labelsize=8, labelbottom=k + columns >= len(panels))
        if x and k + columns >= len(panels):
            axes.set_xlabel(labels.label(dataset, x), fontsize=9)
    for axes in grid[len(panels) :]:
        axes.remove()
    legends.below(figure, [*_names(), *_sources(dataset)])
    return figure


def _names() -> list[Line2D]:
    words = {name: f"n$_{{{name[2:]}}}$: {theory.WORDS[name]} where |n| is larger" for name in _COLOURS}
    return [Line2D([], [], color=colour, linewidth=4, label=words[name]) for name, colour in _COLOURS.items()]


def _sources(dataset: xr.Dataset) -> list[Line2D]:
    present = [drawn for suffix, drawn in _SOURCES.items() if f"n_c1_plus{suffix}" in dataset]
    return [Line2D([], [], color="0.3", linewidth=1, label=words, **style) for words, style in present]
