"""Histograms: which share of the cells of a map or a curve has each value."""

from __future__ import annotations

from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from sweep.axis import Axis
from sweep.grid import Array
from sweep.plots import labels
from sweep.plots.description import Map, common_scale, describe
from sweep.plots.figure import Frames
from sweep.plots.hatches import HATCHES
from sweep.plots.marks import BLANK, legend
from sweep.plots.panels import Panels
from sweep.plots.scales import Limits

_MOST = 60
"""Bars of a histogram, at most."""


def draw(panels: Panels, frames: Frames, limits: Limits | None = None) -> list[Artist]:
    """Draw the shares of the cells, simulated and predicted; returns entries for a legend."""
    dataset, names, across = panels.dataset, panels.names, panels.across[::-1] or [""]
    maps = [[describe(chosen, name, *across) for name in names] for _, chosen in frames]
    edges, kinds = _edges([each for of_one in maps for each in of_one]), legend(dataset, names[0])
    bound = kinds.get("time_limit")
    words = {name: labels.words(dataset, name) for name in names}
    for (axes, _), (first, *others) in zip(frames, maps, strict=True):
        _stairs(axes, first, first.shown, edges, label=words[first.name], color="C0", alpha=0.6, fill=True)
        if bound:
            limited = first.values[first.marks["time_limit"] & ~first.blank]
            style = {"color": "black", "linewidth": 0.5, "hatch": HATCHES["time_limit"]}
            _stairs(axes, first, limited, edges, label=bound, **style)
        for shown in others:
            _stairs(axes, shown, shown.shown, edges, label=words[shown.name], color="C1", linewidth=1.2)
        axes.set_ylabel("share of the cells")
        if axes.get_xlabel():
            axes.set_xlabel(labels.common(dataset, names[0]))
        _scale(axes, first, edges)
        if limits:
            axes.set_xlim(limits)
    left_out = [Line2D([], [], linestyle="none", label=f"left out: {kinds[k]}") for k in BLANK if k in kinds]
    return frames[0][0].get_legend_handles_labels()[0] + left_out


def _scale(axes: Axes, shown: Map, edges: Array) -> None:
    """Write flags in words, and counts as whole numbers; a scale of equal ratios is logarithmic."""
    if shown.flags:
        axes.set_xticks(list(shown.flags), labels=[fill(words, 14) for words in shown.flags.values()])
        axes.set_xlim(edges[0], edges[-1])
    elif shown.values.dtype.kind in "iu":
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    elif Axis("", edges).spacing == "log":
        axes.set_xscale("log")


def _stairs(axes: Axes, shown: Map, values: Array, edges: Array, **style: Any) -> None:
    """Draw the shares that these values have of all that are shown."""
    shares = np.histogram(values, edges)[0] / max(shown.shown.size, 1)
    axes.stairs(shares, edges, gid=shown.name, **style)


def _edges(maps: list[Map]) -> Array:
    """Where the bars begin, and the last one ends: one for each count, unless there are too many."""
    values = np.concatenate([each.shown for each in maps])
    if not values.size:
        return np.array([0.0, 1.0])
    low, high = values.min(), values.max()
    if values.dtype.kind in "iu":
        width = -(-(high - low + 1) // _MOST)
        return np.arange(low, high + width + 1, width) - 0.5
    if low == high:
        return np.asarray(low + np.array([-0.1, 0.1]) * (abs(low) or 1.0))
    number = min(len(np.histogram_bin_edges(values, "auto")), _MOST)
    spaced = np.geomspace if isinstance(common_scale(maps).norm, LogNorm) else np.linspace
    return spaced(low, high, number + 1)
