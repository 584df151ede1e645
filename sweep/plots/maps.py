"""Maps over two axes of a dataset."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, Colormap, ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from sweep.grid import Array
from sweep.plots.panels import Panels, best_shape, failed, heading, panel_title, symbol, words

_MAX_COLOURS = 40


def draw(panels: Panels) -> Figure:
    """A map of each variable over the two long axes, in a row for each value of the others."""
    dataset, names = panels.dataset, panels.names
    down, right = panels.across
    figure = Figure(figsize=(1.5 + 4.6 * len(names), 1.2 + 3.6 * len(panels.each)), dpi=110, layout="constrained")
    figure.suptitle(heading(dataset), fontsize=10)
    grid = figure.subplots(len(panels.each), len(names), squeeze=False, sharex=True, sharey=True)
    for row, panel in zip(grid, panels.each, strict=True):
        colours, norm = _colours(dataset.isel(panel), names)
        for axes, name in zip(row, names, strict=True):
            chosen = dataset.isel(panel)
            values = chosen[name].transpose(down, right).values
            empty = np.isnan(values.astype(float)) | failed(chosen, name).transpose(down, right).values
            # Cells without a result are dark and hatched, never in a colour of the scale.
            axes.set_facecolor("0.25")
            axes.patch.set(hatch="xxx", edgecolor="0.6")
            mesh = axes.pcolormesh(
                dataset[right], dataset[down], np.ma.masked_where(empty, values),
                cmap=colours, norm=norm, shading="nearest",
            )  # fmt: skip
            axes.set_title(f"{words(name)}\n{panel_title(dataset, panel)}", fontsize=9)
            _mark_best_shape(axes, dataset, right)
            handles = _mark_uncertain(axes, chosen, name, (down, right))
            if empty.any():
                label = f"no result: {empty.sum()} of {empty.size}"
                handles.append(Patch(facecolor="0.25", hatch="xxx", edgecolor="0.6", label=label))
            if handles:
                axes.legend(handles=handles, fontsize=7, loc="upper left")
        row[0].set_ylabel(symbol(down))
        bar = figure.colorbar(mesh, ax=list(row), label=words(names[0]) if len(names) == 1 else "reversals")
        _label_bar(bar, dataset, names[0], norm)
    for axes in grid[-1]:
        axes.set_xlabel(symbol(right))
    return figure


def _mark_uncertain(axes: Axes, chosen: xr.Dataset, name: str, across: tuple[str, str]) -> list[Artist]:
    """Dots on the cells whose number of reversals cannot be known; returns their entry for the legend."""
    if name != "reversals":
        return []
    uncertain = xr.zeros_like(chosen[name], dtype=bool)
    for flag in ("sensitive", "window_dependent"):
        if flag in chosen:
            uncertain |= (chosen[flag] != 0) & ~failed(chosen, name)
    rows, columns = np.nonzero(uncertain.transpose(*across).values)
    if not len(rows):
        return []
    down, right = across
    label = f"count not certain: {len(rows)} of {uncertain.size}"
    return list(axes.plot(chosen[right].values[columns], chosen[down].values[rows], "o", color="white", markersize=2.5,
                          markeredgecolor="black", markeredgewidth=0.4, label=label))  # fmt: skip


def _mark_best_shape(axes: Axes, dataset: xr.Dataset, right: str) -> None:
    b = best_shape(dataset)
    if right == "b" and b and dataset["b"].min() <= b <= dataset["b"].max():
        axes.axvline(b, color="white", linestyle="--", linewidth=1.2)
        axes.annotate(f"max L(f)\nb = {b:.2f}", (b, 0.99), xycoords=("data", "axes fraction"), color="white",
                      fontsize=7, va="top", xytext=(3, 0), textcoords="offset points")  # fmt: skip


def _colours(dataset: xr.Dataset, names: list[str]) -> tuple[Colormap, Normalize]:
    values = np.concatenate([np.ravel(dataset[name].values) for name in names])
    if "flag_values" in dataset[names[0]].attrs:
        n = len(dataset[names[0]].attrs["flag_values"])
        return ListedColormap(mpl.colormaps["tab10"].colors[:n]), BoundaryNorm(np.arange(n + 1) - 0.5, n)  # type: ignore[attr-defined]
    if values.dtype.kind == "i":
        return _count_colours(values)
    finite = values[np.isfinite(values)]
    low, high = (finite.min(), finite.max()) if len(finite) else (0.0, 1.0)
    if low > 0 and high > 100 * low:
        return mpl.colormaps["viridis"], LogNorm(low, high)
    return mpl.colormaps["viridis"], Normalize(low, high)


def _count_colours(values: Array) -> tuple[Colormap, BoundaryNorm]:
    """A colour for each integer; the rare few of the highest counts share the last one."""
    top = max(int(np.quantile(values, 0.995)), 1)
    unit = -(-(top + 1) // _MAX_COLOURS)
    edges = np.arange(-0.5, top + unit + 0.5, unit)
    over = values.max() > edges[-1]
    norm = BoundaryNorm(edges, len(edges) - 1 + over, extend="max" if over else "neither")
    return mpl.colormaps["viridis"].resampled(len(edges) - 1 + over), norm


def _label_bar(bar: Any, dataset: xr.Dataset, name: str, norm: Normalize) -> None:
    if isinstance(norm, BoundaryNorm):
        edges = np.asarray(norm.boundaries)
        unit = int(edges[1] - edges[0])
        first = (edges[:-1] + 0.5).astype(int)
        sparse = -(-len(first) // 12)
        labels = [("" if k % sparse else str(i)) if unit == 1 else f"{i}–{i + unit - 1}" for k, i in enumerate(first)]
        if meanings := dataset[name].attrs.get("flag_meanings"):
            labels = meanings.split()
        bar.set_ticks((edges[:-1] + edges[1:]) / 2, labels=labels, fontsize=7)
        bar.ax.tick_params(which="minor", length=0)
