"""Critical spins of a dataset of `sweep critical`."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.lines import Line2D

from sweep.axis import Axis
from sweep.plots import fine, labels, theory
from sweep.plots.description import along
from sweep.plots.figure import Picture, framed, set_scale, zero_line
from sweep.plots.panels import MAX_PANELS, indices

_COLOURS = {"n_c1": "C0", "n_c2": "C1"}

_SOURCES: dict[str, tuple[str, dict[str, Any]]] = {
    "": ("formula of Takano (2011)", {"linestyle": "--"}),
    "_linear": ("eigenvalues of the model", {"linestyle": "-"}),
    "_simulated": ("simulation", {"linestyle": "none", "marker": "x", "markersize": 4}),
}
"""Where a critical spin comes from, and how that is drawn."""


def draw(dataset: xr.Dataset) -> Picture:
    """Critical spins by formula, eigenvalues and simulation, over the longest axis."""
    dims = sorted(map(str, dataset["critical_reason"].dims), key=lambda d: -dataset.sizes[d])
    x = dims[0] if dims else ""
    figure, frames = framed(dataset, indices(dataset, dims[1:])[:MAX_PANELS], x)
    styles = {
        f"{name}_{side}{suffix}": {"color": colour, "linewidth": 1, **style}
        for (name, colour), side, (suffix, (_, style)) in product(_COLOURS.items(), ("plus", "minus"), _SOURCES.items())
    }
    for axes, chosen in frames:
        chosen = chosen.sortby(x) if x else chosen
        at = along(chosen, x)
        set_scale(axes, "x", at)
        between = fine.critical_spins(chosen, Axis(x, at)) if x else {}
        for variable in filter(chosen.__contains__, styles):
            values = between.get(variable, chosen[variable])
            places = values[x].values if variable in between else at
            axes.plot(places, np.atleast_1d(values.values), gid=variable, **styles[variable])
        zero_line(axes)
        axes.set_ylabel(f"spin n ({labels.unit(dataset, 'n_c2_plus_simulated')})")
    names = {f"{name}: {theory.WORDS[name]} where |n| is larger": colour for name, colour in _COLOURS.items()}
    sources = [drawn for suffix, drawn in _SOURCES.items() if {f"n_c1_plus{suffix}", f"n_c2_plus{suffix}"} & {*dataset}]
    figure.explain([
        *(Line2D([], [], color=colour, linewidth=4, label=words) for words, colour in names.items()),
        *(Line2D([], [], color="0.3", linewidth=1, label=words, **style) for words, style in sources),
    ])  # fmt: skip
    return figure
