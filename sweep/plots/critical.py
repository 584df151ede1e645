"""Critical spins of a dataset of `sweep critical`."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.lines import Line2D

from sweep.axis import Axis
from sweep.plots import labels, theory
from sweep.plots.description import along
from sweep.plots.figure import Sheet, framed, set_scale, write_words, zero_line
from sweep.plots.panels import MAX_PANELS, check, indices

_COLOURS = {"n_c1": "C0", "n_c2": "C1"}

_SOURCES: dict[str, tuple[str, dict[str, Any]]] = {
    "": ("formula", {"linestyle": "--"}),
    "_linear": ("eigenvalues", {"linestyle": "-"}),
    "_simulated": ("simulation", {"linestyle": "none", "marker": "x", "markersize": 4}),
}
"""Sources of a critical spin, by the suffix of its variable: their words and styles."""


def draw(dataset: xr.Dataset) -> Sheet:
    """Draw critical spins by formula, eigenvalues and simulation, over the longest axis."""
    dims = sorted((str(d) for d in dataset["n_c_reason"].dims if d != "sign"), key=lambda d: -dataset.sizes[d])
    check(dataset, dims)
    x = dims[0] if dims else ""
    panels = indices(dataset, dims[1:])
    figure, frames = framed(dataset, panels[:MAX_PANELS], x)
    styles = {
        f"{name}{suffix}": {"color": colour, "linewidth": 1, **style}
        for (name, colour), (suffix, (_, style)) in product(_COLOURS.items(), _SOURCES.items())
    }
    shown = _found(dataset, styles)
    for axes, chosen in frames:
        chosen = chosen.sortby(x) if x else chosen
        at = along(chosen, x)
        set_scale(axes, "x", at)
        for variable in filter(chosen.__contains__, styles):
            alone = len(at) == 1 and "marker" not in styles[variable]
            places = Axis(x, at).edges if alone else at  # a line of one point would be invisible
            for _, spins in theory.by_sign(chosen[variable]):
                axes.plot(places, np.broadcast_to(spins.values, places.shape), gid=variable, **styles[variable])
        zero_line(axes)
        axes.tick_params(bottom=bool(x), labelbottom=bool(x) and axes.xaxis.get_tick_params()["labelbottom"])
        if not _found(chosen, styles):
            write_words(axes, _why_none(chosen))
        axes.set_ylabel(labels.with_unit("spin n", labels.unit(dataset, min(shown)) if shown else ""))
    names = {f"{theory.WORDS[name]} beyond {name}": colour for name, colour in _COLOURS.items()
             if any(variable.startswith(name) for variable in shown)}  # fmt: skip
    sources = [drawn for suffix, drawn in _SOURCES.items() if shown & {f"{name}{suffix}" for name in _COLOURS}]
    figure.explain([
        *(Line2D([], [], color=colour, linewidth=4, label=words) for words, colour in names.items()),
        *(Line2D([], [], color="0.3", linewidth=1, label=words, **style) for words, style in sources),
    ], len(panels))  # fmt: skip
    return figure


def _found(dataset: xr.Dataset, names: Iterable[str]) -> set[str]:
    """Return the names of critical spins that at least one body has."""
    return {name for name in names if name in dataset and np.isfinite(dataset[name]).any()}


def _why_none(dataset: xr.Dataset) -> str:
    """List the reasons why there is no critical spin, with the number of spins for each."""
    if not (meanings := labels.flag_words(dataset, "n_c_reason")):
        return "no critical spin"
    codes, counts = np.unique(dataset["n_c_reason"], return_counts=True)
    reasons = [f"{meanings.get(code, code)} ({n})" for code, n in zip(codes.tolist(), counts.tolist(), strict=True)]
    return f"no critical spin: {', '.join(reasons)}"
