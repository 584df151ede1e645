"""Draw the curves of a dataset of `sweep boundaries`, or the count along a single axis."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from sweep.axis import Axis
from sweep.grid import Array
from sweep.plots import labels, lines, places, scales
from sweep.plots.figure import RATIO, Sheet, arrangement, panel_width, set_scale
from sweep.plots.panels import MAX_PANELS
from sweep.plots.theory import Line
from sweep.results.margins import WIDE, distinct, smoothed

_WIDE: dict[str, Any] = {"linestyle": "none", "marker": "o", "color": "none", "markeredgecolor": "0.3"}
"""Style of points whose brackets are wide."""


def draw(dataset: xr.Dataset) -> Sheet:
    """Draw the boundaries over two axes or along the only one, and mark points whose brackets are wide."""
    if "y" not in dataset.attrs:
        return _along(dataset, dataset.attrs["x"])
    x, y = dataset.attrs["x"], dataset.attrs["y"]
    unsearched = dataset.attrs.get("pairs_not_searched")
    nothing = "no boundary was searched" if unsearched else "no count changes between the cells"
    nothing = "no boundary was found between the cells" if unsearched is None else nothing
    every = list(_panels(dataset, {x, y})) or [(nothing, dataset)]
    panels = every[:MAX_PANELS]
    rows, columns = arrangement(len(panels), 1)
    width = panel_width(columns, 5.2, 0.6)
    figure = Sheet(dataset, width * columns + 0.6, 1.2 + width * RATIO * rows)
    scale = scales.counts(dataset["level"].values if dataset.sizes["point"] else np.zeros(1, int))
    for axes, (words, part) in zip(figure.panels(rows, columns, len(panels)), panels, strict=True):
        axes.set_title(words)
        set_scale(axes, "x", _axis(dataset, x).values)
        set_scale(axes, "y", _axis(dataset, y).values)
        drawn = list(curves(part, x, y))
        for level, xs, ys in drawn:
            colour, alone = scale.rgba(np.array(level)).tolist(), "." if len(xs) == 1 else None
            axes.plot(xs, ys, marker=alone, color=colour, linewidth=1.4, gid=f"level{level}")
        each = [Line("boundary", "", [(xs, ys)], f"{level}") for level, xs, ys in drawn]
        lines.write(axes, places.words(each, _axis(dataset, x), _axis(dataset, y)))
        wide = part.isel(point=(part["outcome"] == WIDE).values)
        axes.plot(wide[x], wide[y], markersize=3, **_WIDE)
        axes.set(xlabel=labels.label(dataset, x), ylabel=labels.label(dataset, y))
        axes.set(xlim=dataset[x].attrs["actual_range"], ylim=dataset[y].attrs["actual_range"])
    words = _wide(dataset)
    figure.explain([Line2D([], [], markersize=4, label=words, **_WIDE)] if words else [], len(every))
    return figure


def _wide(dataset: xr.Dataset) -> str:
    """Return the legend entry of points whose brackets are wide; "" if there are none."""
    count = int((dataset["outcome"] == WIDE).sum())
    return f"wide bracket: a cell failed or is not certain ({count} of {dataset.sizes['point']})" if count else ""


def _along(dataset: xr.Dataset, x: str) -> Sheet:
    """Draw the count along the only axis: a step at each boundary, and a grey band over each wide bracket."""
    width = panel_width(1, 5.2, 0.6)
    figure = Sheet(dataset, width + 0.6, 1.2 + width * RATIO)
    (axes,) = figure.panels(1, 1, 1)
    set_scale(axes, "x", _axis(dataset, x).values)
    ends = np.stack([dataset["end_fewer"].values, dataset["end_more"].values])
    counts = np.stack([dataset["reversals_fewer"].values, dataset["reversals_more"].values])
    order = np.argsort(ends, axis=0)
    places, counts = (np.take_along_axis(each, order, axis=0).T.ravel() for each in (ends, counts))
    low, high = dataset[x].attrs["actual_range"]
    if counts.size:
        axes.plot([low, *places, high], [counts[0], *counts, counts[-1]], gid="count")
    else:
        axes.set_title("no count changes between the cells")
    for i in np.flatnonzero(dataset["outcome"].values == WIDE):
        axes.axvspan(*np.sort(ends[:, i]), color="0.85", gid="wide")
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(xlim=(low, high), xlabel=labels.label(dataset, x), ylabel="spin reversals")
    words = _wide(dataset)
    figure.explain([Patch(color="0.85", label=words)] if words else [])
    return figure


def curves(dataset: xr.Dataset, x: str, y: str) -> Iterator[tuple[int, Array, Array]]:
    """The level of each curve, and smooth x and y through those of its points that were found."""
    axes = [_axis(dataset, name) for name in (x, y)]
    spans = [float(np.ptp(axis.straight(axis.values))) for axis in axes]
    for number in np.unique(dataset["curve"]):
        part = dataset.isel(point=((dataset["curve"] == number) & (dataset["outcome"] != WIDE)).values)
        if not part.sizes["point"]:
            continue
        places = np.array([axis.straight(part[axis.name].values) / s for axis, s in zip(axes, spans, strict=True)])
        closed = bool((part["closed"] == 1).all()) and len(part.point) == int((dataset["curve"] == number).sum())
        xs, ys = smoothed(*places[:, distinct(*places, closed=closed)], closed=closed)
        yield int(part["level"][0]), axes[0].bent(xs * spans[0]), axes[1].bent(ys * spans[1])


def _axis(dataset: xr.Dataset, name: str) -> Axis:
    """Return an axis with the ends and the spacing of the searched one."""
    ends = np.asarray(dataset[name].attrs["actual_range"], float)
    return Axis(name, np.geomspace(ends[0], ends[1], 3) if dataset[name].attrs["spacing"] == "log" else ends)


def _panels(dataset: xr.Dataset, across: set[str]) -> Iterator[tuple[str, xr.Dataset]]:
    """Yield the values of the other axes in words, and the points that have them."""
    others = [str(n) for n, c in dataset.coords.items() if c.dims == ("point",) and n not in across]
    columns = [dataset[name].values for name in others] or [np.zeros(dataset.sizes["point"])]
    cells = np.stack(columns, axis=1)
    for cell in np.unique(cells, axis=0):
        words = ", ".join(labels.measured(dataset, name, float(v)) for name, v in zip(others, cell, strict=False))
        yield words, dataset.isel(point=(cells == cell).all(axis=1))
