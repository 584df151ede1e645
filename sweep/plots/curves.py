"""Curves over one axis of a dataset, or the own drawing of a picture."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from sweep.grid import Array
from sweep.plots import labels, lines, theory
from sweep.plots.description import Map, describe
from sweep.plots.figure import Frames, set_scale, write_words
from sweep.plots.marks import BLANK, WORDS, legend
from sweep.plots.panels import Panels
from sweep.plots.pictures import of
from sweep.plots.scales import AUTO, Limits, ends

_VARIABLES: tuple[dict[str, Any], ...] = (
    {"marker": "x", "color": "C0"},
    {"marker": "s", "fillstyle": "none", "color": "C1"},
)
"""Markers of a variable, and of its prediction."""

_STYLES: dict[str, dict[str, Any]] = {
    "failed": {"marker": "v", "color": "crimson"},
    "not_run": {"marker": "v", "color": "0.6", "fillstyle": "none"},
    "impossible": {"marker": "_", "color": "0.6"},
    "no_value": {"marker": "|", "color": "0.6"},
    "time_limit": {"marker": "^", "color": "C0", "fillstyle": "none", "markersize": 8},
    "round_off": {"marker": "D", "color": "0.3", "fillstyle": "none", "markersize": 9, "markeredgewidth": 0.6},
    "uncertain": {"marker": "o", "color": "black", "markersize": 2},
}
"""Markers of the kinds of cell, drawn around those of the first variable."""

_ROOM = 6.0
"""Points of the axis per mark of full size."""

_BELOW = 0.03
"""Room below zero, relative to that above."""


def draw(panels: Panels, frames: Frames, limits: Limits = AUTO) -> list[Artist]:
    """Draw the variables over one axis, in a panel for each value of the others; returns legend entries."""
    dataset, x = panels.dataset, panels.across[0] if panels.across else ""
    names = panels.names[:1] + [name for name in panels.names[1:] if dataset[name].notnull().any()]
    kinds, own = legend(dataset, names[0]), of(names[0])
    entries: dict[str, Artist] = {}
    for axes, chosen in frames:
        if not own.draw:
            entries |= _panel(axes, chosen, names, x, kinds)
            axes.set_ylabel(labels.common(dataset, names[0]))
        elif chosen[names[0]].isnull().all():
            write_words(axes, own.words.get("no_value", WORDS["no_value"]))
        else:
            if x in chosen.coords:
                set_scale(axes, "x", chosen[x].values)
            own.draw(axes, chosen, x)
            entries |= {str(handle.get_label()): handle for handle in axes.get_legend_handles_labels()[0]}
        if limits != AUTO:
            low, high = axes.get_ylim()
            first, last = ends(limits, low, high)
            if first == last:  # the only limit is the other end of all values
                first, last = (first - (high - low), last) if limits[0] is None else (first, last + (high - low))
            axes.set_ylim(first, last)
    return list(entries.values())


def _panel(axes: Axes, chosen: xr.Dataset, names: list[str], x: str, kinds: dict[str, str]) -> dict[str, Artist]:
    """Draw one panel, with the words for the kinds of its cells; returns the entries for the legend."""
    entries: dict[str, Artist] = {}
    described = [describe(chosen, name, x, shared={}) for name in names]
    first = described[0]
    at = first.x.values
    if len(at) == 1:
        _values(axes, chosen, described, kinds)
        return {}
    set_scale(axes, "x", at)
    size = float(np.clip(72 * axes.bbox.width / axes.figure.dpi / len(at) / _ROOM, 0.4, 1))
    for shown, style in zip(described, _VARIABLES, strict=False):
        height = np.where(shown.blank, np.nan, shown.values)[0]
        words = labels.words(chosen, shown.name)
        entries[shown.name] = _points(axes, at, height, style | {"gid": shown.name}, words, size)
        for kind, (where,) in shown.marks.items() if shown is first else ():
            if where.any():
                place = np.zeros(where.sum()) if kind in BLANK else height[where]
                entries[kind] = _points(axes, at[where], place, _STYLES[kind] | {"gid": kind}, kinds[kind], size)
    if first.values.dtype.kind == "i":
        axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    if first.flags:
        present = [int(value) for value in np.unique(first.values)]
        axes.set_yticks(present, labels=[first.flags.get(value, str(value)) for value in present])
    axes.grid(alpha=0.3)
    if of(first.name).theory:
        entries |= lines.draw_vertical(axes, theory.crossings(chosen, first.x))
        if x == "b" and "form_factor" in chosen and chosen["form_factor"].dims == ("b",):
            entries["form_factor"] = _form_factor(axes, chosen)
    return entries


def _values(axes: Axes, chosen: xr.Dataset, described: list[Map], kinds: dict[str, str]) -> None:
    """Write the values of a single cell, since one point does not make a chart."""
    lines = []
    for shown in described:
        at = shown.values.item()
        value = f"{labels.number(at)} {labels.unit(chosen, shown.name)}".strip()
        if not shown.blank.any():
            lines.append(f"{labels.words(chosen, shown.name)}: {shown.flags.get(at, value)}")
    lines += [kinds[kind].rpartition(" (")[0] for kind, where in described[0].marks.items() if where.any()]
    write_words(axes, "\n".join(lines))
    axes.set_axis_off()


def _points(axes: Axes, at: Array, values: Array, style: dict[str, Any], label: str, size: float) -> Line2D:
    (line,) = axes.plot(at, values, linestyle="none", label=label, **{"markersize": 5, **style})
    line.set_markersize(line.get_markersize() * size)
    return line


def _form_factor(axes: Axes, chosen: xr.Dataset) -> Line2D:
    twin = axes.twinx()
    twin.set_label("form factor")
    (line,) = twin.plot(chosen["b"], chosen["form_factor"], color="0.5", linewidth=1)
    line.set_label("form factor L(f), right axis")
    twin.set_ylabel("L(f)", color="0.4")
    twin.tick_params(colors="0.4")
    for each in (axes, twin):  # the same zero, and marks there are whole
        top = each.get_ylim()[1]
        each.set_ylim(-_BELOW * top, top)
    return line
