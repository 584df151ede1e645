"""How matplotlib draws the lines of theory, and those on which counts change."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.lines import Line2D
from matplotlib.patheffects import AbstractPathEffect, withStroke
from matplotlib.ticker import LogLocator

from sweep.axis import Axis
from sweep.plots import labels, levels
from sweep.plots.description import Map
from sweep.plots.scales import Scale
from sweep.plots.theory import Line

_STYLES: dict[str, dict[str, Any]] = {
    "n_c1": {"linestyle": (0, (1.5, 1.5)), "linewidth": 1.2},
    "n_c2": {"linestyle": "-", "linewidth": 1.2},
    "best": {"linestyle": (0, (6, 3)), "linewidth": 1.2},
    "boundary": {"linestyle": "-", "linewidth": 0.6},
}


def draw(axes: Axes, shown: Map, *, labelled: bool) -> dict[str, Line2D]:
    """Draw the lines of a map; returns their entries for the legend.

    Parameters
    ----------
    labelled : whether there is room for symbols at the lines
    """
    box, over_n0 = axes.axis(), "n0" in (shown.x.name, shown.y.name)
    for line in shown.lines:
        style = _STYLES[line.name]
        for part in line.parts:
            axes.plot(*part, color="black", path_effects=_halo(2 * style["linewidth"]), gid=line.name, **style)
    axes.axis(box)
    for line in shown.lines:
        # Over n0 the lines of n_c1 are too close to those of n_c2 for a symbol of their own.
        if labelled and line.symbol and line.name != "boundary" and not (over_n0 and line.name == "n_c1"):
            _label(axes, shown, line)
    if labelled:
        number(axes, shown.lines, shown.x, shown.y)
    return {line.name: entry(line.name, line.words) for line in shown.lines}


def number(axes: Axes, drawn: Iterable[Line], x: Axis, y: Axis) -> None:
    """Write the counts that begin on boundaries into the lines themselves."""
    for at_x, at_y, count in levels.numbers(drawn, x, y):
        axes.annotate(count, (at_x, at_y), size="small", ha="center", va="center", path_effects=_halo(2))


def draw_contours(axes: Axes, shown: Map, scale: Scale) -> None:
    """Lines of equal value, with the values in them, on a map of real numbers; counts have their boundaries instead."""
    if shown.values.dtype.kind == "f" and min(shown.values.shape) > 1:
        values = np.ma.masked_where(shown.blank, shown.values)
        locator = LogLocator(subs=(1, 2, 5)) if isinstance(scale.norm, LogNorm) else None
        levels = list(scale.ticks) if scale.ticks else None
        how: dict[str, Any] = {"norm": scale.norm, "locator": locator, "colors": "black", "linewidths": 0.6}
        found = axes.contour(shown.x.values, shown.y.values, values, levels, **how)
        found.set_path_effects(_halo(1.2))
        for number in axes.clabel(found, fmt=scale.ticks or labels.number, fontsize="small"):
            number.set_path_effects(_halo(2))


def draw_vertical(axes: Axes, lines: list[Line]) -> dict[str, Line2D]:
    """Draw lines over curves; returns their entries for the legend."""
    for line in lines:
        for at in line.parts[0][0]:
            axes.axvline(at, linestyle=_STYLES[line.name]["linestyle"], color="black", linewidth=0.8, gid=line.name)
    return {line.name: entry(line.name, line.words) for line in lines}


def entry(name: str, words: str) -> Line2D:
    """The entry of a legend for a line."""
    return Line2D([], [], color="black", label=words, **_STYLES[name])


def _halo(width: float) -> list[AbstractPathEffect]:
    return [withStroke(linewidth=width, foreground="white")]


def _label(axes: Axes, shown: Map, line: Line) -> None:
    """The symbol of a critical spin beside its line, on the side of the larger spins or on the roomier one."""
    x, y = max(line.parts, key=lambda part: len(part[0]))
    inside = (shown.x.edges[0] <= x) & (x <= shown.x.edges[-1]) & (shown.y.edges[0] <= y) & (y <= shown.y.edges[-1])
    points = np.stack([x, y], axis=1)[inside]
    path = (axes.transData + axes.transAxes.inverted()).transform(points)
    length = np.cumsum(np.hypot(*np.diff(path, axis=0, prepend=path[:1]).T))
    # The lines of n_c1 and n_c2 are farthest apart near the ends that are closer to the middle.
    shares = np.searchsorted(length, length[-1] * np.array([0.125, 0.875] if line.name == "n_c1" else [0.6]))
    k = min(shares, key=lambda share: float(np.hypot(*(path[share] - 0.5))))
    outwards = 1 if "⁺" in line.symbol else -1
    if shown.y.name == "n0":
        place: dict[str, Any] = {"xytext": (0, 4 * outwards), "ha": "center", "va": "bottom" if outwards > 0 else "top"}
    else:
        if shown.x.name != "n0":
            outwards = 1 if (path[k, 0] < 0.5) == (line.name == "n_c2") else -1  # n_c1 beyond n_c2
        place = {"xytext": (4 * outwards, 0), "ha": "left" if outwards > 0 else "right", "va": "center"}
    axes.annotate(labels.in_maths(line.symbol), points[k], textcoords="offset points", path_effects=_halo(2), **place)
