"""Mark the kinds of cell on a map: hatches over results, plain colours for missing results, and dots."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path

from sweep.grid import Array

GROUNDS: dict[str, dict[str, Any]] = {
    "failed": {"facecolor": "0.15", "edgecolor": "0.8", "hatch": "xxxx"},
    "not_run": {"facecolor": "white", "edgecolor": "0.6", "hatch": "++"},
    "impossible": {"facecolor": "0.92", "edgecolor": "0.6", "hatch": "----"},
    "no_value": {"facecolor": "0.8", "edgecolor": "none"},
}
"""Colours of the kinds of cell without a result, which no scale uses."""

HATCHES = {"time_limit": "////", "round_off": "||||"}

_DOT: dict[str, Any] = {"linestyle": "none", "marker": "o", "color": "white", "markeredgecolor": "black"}

_DOT_SIZE = 2.4
"""Size of a dot in points, which may exceed its cell: smaller ones cannot be seen in print."""

_LIGHT, _DARK = (1.0, 1.0, 1.0, 0.7), (0.0, 0.0, 0.0, 0.55)
"""Hatches on dark and on light cells."""


def draw(axes: Axes, kinds: dict[str, Array], across: tuple[Array, Array], dark: Array) -> None:
    """Mark the kinds of cells on a map.

    Parameters
    ----------
    kinds : the kinds to mark, and which cells are of them, shape (rows, columns)
    across : edges of the rows and of the columns
    dark : cells of dark colours
    """
    for kind in filter(kinds.__contains__, GROUNDS):
        _region(axes, kinds[kind], across, kind, **GROUNDS[kind])
    for kind in filter(kinds.__contains__, HATCHES):
        _region(axes, kinds[kind] & dark, across, kind, fill=False, edgecolor=_LIGHT, hatch=HATCHES[kind])
        _region(axes, kinds[kind] & ~dark, across, kind, fill=False, edgecolor=_DARK, hatch=HATCHES[kind])
    if "uncertain" in kinds and kinds["uncertain"].any():
        rows, columns = np.nonzero(kinds["uncertain"])
        y, x = ((edges[1:] + edges[:-1]) / 2 for edges in across)
        axes.plot(x[columns], y[rows], markersize=_DOT_SIZE, markeredgewidth=0.5, gid="uncertain", **_DOT)


def handle(kind: str, words: str) -> Artist:
    """The entry of a legend for a kind of cell."""
    if kind == "uncertain":
        return Line2D([], [], markersize=4, markeredgewidth=0.6, label=words, **_DOT)
    if kind in GROUNDS:
        return Patch(label=words, **GROUNDS[kind])
    return Patch(facecolor="0.92", edgecolor="black", linewidth=0.5, hatch=HATCHES[kind], label=words)


def _region(axes: Axes, where: Array, across: tuple[Array, Array], kind: str, **style: Any) -> None:
    """Draw all cells of a kind as one patch, so that its hatch continues from cell to cell."""
    if where.any():
        with mpl.rc_context({"hatch.linewidth": 0.7}):
            patch = PathPatch(outline(where, *across), linewidth=0, gid=kind, **style)
        # `add_patch` would go through every corner in Python to adapt the limits: a minute for 10⁶ cells.
        axes.add_artist(patch).set_in_layout(False)


def outline(where: Array, rows: Array, columns: Array) -> Path:
    """A path of rectangles, one for each run of cells in a row; `rows` and `columns` are the edges of the cells."""
    change = np.diff(np.pad(where, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, first = np.nonzero(change == 1)
    last = np.nonzero(change == -1)[1]
    left, right, low, high = columns[first], columns[last], rows[row], rows[row + 1]
    x = np.stack([left, right, right, left, left], axis=1)
    y = np.stack([low, low, high, high, low], axis=1)
    codes = np.tile([Path.MOVETO, Path.LINETO, Path.LINETO, Path.LINETO, Path.CLOSEPOLY], len(row))
    return Path(np.stack([x.ravel(), y.ravel()], axis=1), codes)
