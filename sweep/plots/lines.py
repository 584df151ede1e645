"""How matplotlib draws the lines of theory, and those on which counts change."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.lines import Line2D
from matplotlib.patheffects import AbstractPathEffect, withStroke
from matplotlib.ticker import LogLocator

from sweep.axis import Axis
from sweep.grid import Array
from sweep.plots import labels, places
from sweep.plots.description import Map
from sweep.plots.figure import RATIO, extent
from sweep.plots.scales import Scale
from sweep.plots.theory import STYLES, Line

_DASHES = {"dotted": (0, (1.5, 1.5)), "solid": "-", "dashed": (0, (6, 3))}
_STYLES: dict[str, dict[str, Any]] = {
    name: {"linestyle": _DASHES[dash], "linewidth": width} for name, (dash, width) in STYLES.items()
}

_LAID_OUT = 0.9
"""The least size of a map, relative to that which it has before the figure is laid out; its height is then told by
its width."""


def draw(axes: Axes, shown: Map, *, labelled: bool) -> dict[str, Line2D]:
    """Draw the lines of a map; returns their entries for the legend, by their words.

    Parameters
    ----------
    labelled : whether there is room for symbols at the lines
    """
    box = axes.axis()
    for line in shown.lines:
        style = _STYLES[line.name]
        for part in line.parts:
            axes.plot(*part, color="black", path_effects=_halo(2 * style["linewidth"]), gid=line.name, **style)
    axes.axis(box)
    if labelled:
        _symbols(axes, shown, number(axes, shown.lines, shown.x, shown.y))
    return {line.words: entry(line.name, line.words) for line in shown.lines}


def number(axes: Axes, drawn: list[Line], x: Axis, y: Axis) -> list[places.Number]:
    """Write the counts that begin on boundaries into the lines themselves; returns where."""
    written = list(places.numbers(drawn, x, y))
    for at_x, at_y, count in written:
        axes.annotate(count, (at_x, at_y), size="small", color="black", ha="center", va="center", path_effects=_halo(2))
    return written


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
            style: Any = {"linestyle": _STYLES[line.name]["linestyle"], "color": mpl.rcParams["text.color"]}
            axes.axvline(at, linewidth=0.8, gid=line.name, **style)
    return {line.name: entry(line.name, line.words) for line in lines}


def entry(name: str, words: str) -> Line2D:
    """The entry of a legend for a line."""
    return Line2D([], [], color=mpl.rcParams["text.color"], label=words, **_STYLES[name])


def _halo(width: float) -> list[AbstractPathEffect]:
    return [withStroke(linewidth=width, foreground="white")]


def _symbols(axes: Axes, shown: Map, written: list[places.Number]) -> None:
    """Write the symbols of critical spins beside their lines, where there is room."""
    words = {line.symbol: labels.in_maths(line.symbol) for line in shown.lines if line.name != "boundary"}
    size = _LAID_OUT * axes.bbox.width * np.array([1, RATIO])
    halves: dict[str, Array] = {}
    for symbol, of in words.items():
        text = axes.text(0, 0, of)
        halves[symbol] = extent(text) / size / 2
        text.remove()
    in_points = size * 72 / axes.get_figure(root=True).dpi  # type: ignore[union-attr]
    for symbol, at, middle in places.symbols(shown.lines, shown.x, shown.y, written, halves):
        axes.annotate(words[symbol], tuple(at), xycoords="axes fraction", xytext=tuple((middle - at) * in_points),
                      textcoords="offset points", color="black", ha="center", va="center",
                      path_effects=_halo(2))  # fmt: skip
