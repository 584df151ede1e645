"""Curves over one axis of a dataset."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from sweep.grid import Array
from sweep.plots import labels, legends, theory
from sweep.plots.axes import set_scale
from sweep.plots.figure import Picture
from sweep.plots.maps import arrangement
from sweep.plots.marks import blank, legend, marks
from sweep.plots.panels import Panels, heading, title
from sweep.plots.quantities import COMPARISONS, PREDICTIONS
from sweep.plots.scales import Limits

_STYLES: dict[str, dict[str, Any]] = {
    **{predicted: {"marker": "s", "fillstyle": "none", "color": "C1"} for predicted, _ in PREDICTIONS.values()},
    "failed": {"marker": "v", "color": "crimson"},
    "not_run": {"marker": "v", "color": "0.6", "fillstyle": "none"},
    "impossible": {"marker": "_", "color": "0.6"},
    "no_value": {"marker": "|", "color": "0.6"},
    "time_limit": {"marker": "^", "color": "C0", "fillstyle": "none", "markersize": 8},
    "inferred": {"marker": "o", "color": "0.5", "fillstyle": "none", "markersize": 9},
    "noise_limited": {"marker": "D", "color": "0.3", "fillstyle": "none", "markersize": 9, "markeredgewidth": 0.6},
    "uncertain": {"marker": "o", "color": "black", "markersize": 2},
}
"""Markers of variables, and of the kinds of cell, drawn around those of the first variable."""


def draw(panels: Panels, limits: Limits | None = None) -> Figure:
    """The variables over the one long axis, in a panel for each value of the others."""
    dataset, names = panels.dataset, [name for name in panels.names if name not in COMPARISONS] or panels.names
    names = names[:1] + [name for name in names[1:] if dataset[name].notnull().any()]
    rows, columns = arrangement(len(panels.each), 2)
    width = min(7.0, 14 / columns)
    figure = Picture(figsize=(width * columns, 1.9 + 2.6 * rows), dpi=110, layout="constrained")
    figure.suptitle(heading(dataset, figure.get_figwidth()), fontsize=10)
    grid = figure.subplots(rows, columns, squeeze=False, sharex=True)
    x = panels.across[0] if panels.across else None
    entries: dict[str, Artist] = {}
    for k, (axes, panel) in enumerate(zip(grid.flat, panels.each, strict=False)):
        entries |= _panel(axes, dataset.isel(panel), names, x)
        axes.set_title(title(dataset, panel), fontsize=9)
        counts = len(names) > 1 and names[0] == "reversals"
        axes.set_ylabel("spin reversals" if counts else labels.label(dataset, names[0]), fontsize=9)
        if k + columns >= len(panels.each):
            axes.set_xlabel(labels.label(dataset, x) if x else "", fontsize=9)
            axes.tick_params(labelbottom=True)
        if limits:
            axes.set_ylim(*limits)
    for axes in grid.flat[len(panels.each) :]:
        axes.remove()
    words = legend(dataset, names[0])
    for name, entry in entries.items():
        entry.set_label(words.get(name, entry.get_label()))
    legends.below(figure, list(entries.values()))
    return figure


def _panel(axes: Axes, chosen: xr.Dataset, names: list[str], x: str | None) -> dict[str, Artist]:
    """Draw one panel; returns the entries for the legend."""
    entries: dict[str, Artist] = {}
    at = np.atleast_1d(chosen[x].values) if x else np.zeros(1)
    set_scale(axes, "x", at)
    for name in names:
        kinds = marks(chosen, name)
        empty = np.atleast_1d(blank(kinds).values)
        values = np.where(empty, np.nan, np.atleast_1d(chosen[name].values).astype(float))
        style = {"marker": "x", "color": "C0"} | _STYLES.get(name, {})
        entries[name] = _points(axes, at, values, style, labels.words(chosen, name))
        if name != names[0]:
            continue
        for kind, where in kinds.items():
            if (some := np.atleast_1d(where.values)).any():
                height = np.zeros(some.sum()) if empty[some].all() else values[some]
                entries[kind] = _points(axes, at[some], height, _STYLES[kind], kind)
    if chosen[names[0]].dtype.kind == "i":
        axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    if meanings := labels.flag_words(chosen, names[0]):
        present = [int(value) for value in np.unique(chosen[names[0]])]
        axes.set_yticks(present, labels=[meanings.get(value, str(value)) for value in present])
    axes.grid(alpha=0.3)
    axes.tick_params(labelsize=8)
    if names[0] in theory.REVERSALS:
        entries |= theory.draw_at(axes, chosen, x)
        if x == "b" and "form_factor" in chosen:
            entries["form_factor"] = _form_factor(axes, chosen)
    return entries


def _points(axes: Axes, at: Array, values: Array, style: dict[str, Any], label: str) -> Line2D:
    (line,) = axes.plot(at, values, linestyle="none", label=label, **{"markersize": 5, **style})
    return line


def _form_factor(axes: Axes, chosen: xr.Dataset) -> Line2D:
    twin = axes.twinx()
    (line,) = twin.plot(
        chosen["b"], chosen["form_factor"], color="0.5", linewidth=1, label="form factor L(f), right axis"
    )
    twin.set_ylabel("L(f)", color="0.4", fontsize=9)
    twin.tick_params(labelsize=8, colors="0.4")
    twin.set_ylim(bottom=0)
    axes.set_ylim(bottom=0)
    return line
