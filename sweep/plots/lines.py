"""Draw the lines of theory and the boundaries of counts with matplotlib."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from sweep.plots import labels, places
from sweep.plots.description import Map
from sweep.plots.theory import STYLES, Line

_DASHES = {"dotted": (0, (1.5, 1.5)), "solid": "-", "dashed": (0, (6, 3))}
_STYLES: dict[str, dict[str, Any]] = {
    name: {"linestyle": _DASHES[dash], "linewidth": width} for name, (dash, width) in STYLES.items()
}

_BOX = {"boxstyle": "round,pad=0.08", "facecolor": "white", "edgecolor": "none"}


def draw(axes: Axes, shown: Map, width: float) -> dict[str, Line2D]:
    """Draw the lines of a map; returns their entries for the legend, by their words.

    Parameters
    ----------
    width : of the map in inches; zero if there is no room for words on the lines, so that boundaries are left out
    """
    box = axes.axis()
    drawn, words = places.legible(shown.lines, shown.x, shown.y, width)
    for line in drawn:
        style = _STYLES[line.name]
        halo = [withStroke(linewidth=2 * style["linewidth"], foreground="white")]
        for part in line.parts:
            axes.plot(*part, color="black", path_effects=halo, gid=line.name, **style)
    axes.axis(box)
    write(axes, words)
    return {line.words: entry(line.name, line.words) for line in drawn}


def write(axes: Axes, words: Iterable[places.Word]) -> None:
    """Write words on lines."""
    for x, y, word in words:
        axes.text(x, y, labels.in_maths(word), size="small", color="black", ha="center", va="center", bbox=_BOX)


def draw_vertical(axes: Axes, lines: list[Line]) -> dict[str, Line2D]:
    """Draw lines over curves; returns their entries for the legend."""
    for line in lines:
        for at in line.parts[0][0]:
            axes.axvline(at, color=mpl.rcParams["text.color"], gid=line.name, **_STYLES[line.name])
    return {line.name: entry(line.name, line.words) for line in lines}


def entry(name: str, words: str) -> Line2D:
    """The entry of a legend for a line."""
    return Line2D([], [], color=mpl.rcParams["text.color"], label=words, **_STYLES[name])
