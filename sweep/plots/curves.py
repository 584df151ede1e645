"""Curves over one axis of a dataset, and the probabilities of counts as curves or bars."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import matplotlib as mpl
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
from sweep.plots.marks import BLANK, legend
from sweep.plots.panels import Panels, title
from sweep.plots.quantities import COMPARISONS
from sweep.plots.scales import AUTO, Limits, ends
from sweep.results.probabilities import interval, sound

_STYLES: dict[str, dict[str, Any]] = {
    **{predicted: {"marker": "s", "fillstyle": "none", "color": "C1"} for _, predicted in COMPARISONS.values()},
    "failed": {"marker": "v", "color": "crimson"},
    "not_run": {"marker": "v", "color": "0.6", "fillstyle": "none"},
    "impossible": {"marker": "_", "color": "0.6"},
    "no_value": {"marker": "|", "color": "0.6"},
    "time_limit": {"marker": "^", "color": "C0", "fillstyle": "none", "markersize": 8},
    "round_off": {"marker": "D", "color": "0.3", "fillstyle": "none", "markersize": 9, "markeredgewidth": 0.6},
    "uncertain": {"marker": "o", "color": "black", "markersize": 2},
}
"""Markers of variables, and of the kinds of cell, drawn around those of the first variable."""

_ROOM = 6.0
"""Points of the axis per mark of full size."""

_BELOW = 0.03
"""Room below zero, relative to that above."""

_COLOURS = 0.85
"""Part of the colour map used for probabilities: its last colours are too light for lines."""


def draw(panels: Panels, frames: Frames, limits: Limits = AUTO) -> list[Artist]:
    """Draw the variables over one axis, in a panel for each value of the others; returns legend entries."""
    if panels.names == ["probability"]:
        return _probabilities(panels, frames, limits)
    dataset, x = panels.dataset, panels.across[0] if panels.across else ""
    names = panels.names[:1] + [name for name in panels.names[1:] if dataset[name].notnull().any()]
    kinds = legend(dataset, names[0])
    entries: dict[str, Artist] = {}
    for axes, chosen in frames:
        entries |= _panel(axes, chosen, names, x, kinds)
        axes.set_ylabel(labels.common(dataset, names[0]))
        if limits != AUTO:
            axes.set_ylim(ends(limits, *axes.get_ylim()))
    return list(entries.values())


def _panel(axes: Axes, chosen: xr.Dataset, names: list[str], x: str, kinds: dict[str, str]) -> dict[str, Artist]:
    """Draw one panel, with the words for the kinds of its cells; returns the entries for the legend."""
    entries: dict[str, Artist] = {}
    described = [describe(chosen, name, x) for name in names]
    first = described[0]
    at = first.x.values
    if len(at) == 1:
        _values(axes, chosen, described, kinds)
        return {}
    set_scale(axes, "x", at)
    size = float(np.clip(72 * axes.bbox.width / axes.figure.dpi / len(at) / _ROOM, 0.4, 1))
    for shown in described:
        height = np.where(shown.blank, np.nan, shown.values)[0]
        words = labels.words(chosen, shown.name)
        style = {"marker": "x", "color": "C0"} | _STYLES.get(shown.name, {})
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
    if first.name in theory.REVERSALS:
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


def _probabilities(panels: Panels, frames: Frames, limits: Limits) -> list[Artist]:
    """Draw the probabilities of counts over the one long axis, or as bars over counts; returns legend entries."""
    for axes, chosen in frames:
        if panels.across in ([], ["count"]):
            _bars(axes, chosen, lowest=len(frames) == 1 or bool(axes.get_xlabel()))
        else:
            _probability_curves(axes, chosen, panels.across[0])
        if chosen["probability"].isnull().all():
            write_words(axes, "all samples failed" if "status" in chosen else "no probability is known")
        axes.set_ylim(ends(limits, 0, 1.02))
        axes.grid(alpha=0.3)
    shown = [axes for axes, chosen in frames if chosen["probability"].notnull().any()]
    return shown[0].get_legend_handles_labels()[0] if shown else []


def _probability_curves(axes: Axes, chosen: xr.Dataset, x: str) -> None:
    """Draw the probability of each count or more, or of a chosen one, with its interval as a band."""
    each = chosen if "count" in chosen.dims else chosen.expand_dims("count")
    counts = each.sizes["count"]
    colours = mpl.colormaps["viridis"](_COLOURS * np.arange(counts) / max(counts - 1, 3))
    at = chosen[x].values
    set_scale(axes, "x", at)
    axes.update_datalim([(value, 0.0) for value in at])  # also where all samples failed
    known = {"probability_low", "probability_high"} <= each.data_vars.keys()
    for i, colour in enumerate(colours):
        one = each.isel(count=i)
        axes.plot(at, one["probability"], ".-", color=colour, linewidth=1.2, label=title(each, {"count": i}))
        if known:
            ends = one["probability_low"], one["probability_high"]
            axes.fill_between(at, *ends, color=colour, alpha=0.25, linewidth=0)
            axes.vlines(at, *ends, color=colour, linewidth=0.6)  # a point between failures has no band
    axes.set_ylabel("probability, with its interval of 95 %" if known else "probability")


def _bars(axes: Axes, chosen: xr.Dataset, *, lowest: bool) -> None:
    """Draw the probability of each count, or of at least a chosen count and of fewer, with its interval."""
    at_least = np.concatenate([[1.0], np.atleast_1d(chosen["probability"]), [0.0]])
    share: Array = np.array([more - still for more, still in pairwise(at_least)])
    axes.bar(np.arange(len(share)), share, color="C0", label="share of the samples", zorder=2)
    axes.set_xlim(-0.6, len(share) - 0.4)
    if "status" in chosen and labels.is_code(chosen["status"]):  # otherwise the number of samples is unknown
        low, high = interval(share, np.asarray(sound(chosen).sum()))
        axes.errorbar(
            np.arange(len(share)), share, yerr=[share - low, high - share],
            fmt="none", ecolor="black", elinewidth=1, capsize=3, label="interval of 95 %", zorder=3,
        )  # fmt: skip
    if "count" in chosen.dims:
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_xlabel("spin reversals" if lowest else "")
    else:
        axes.set_xticks([0, 1], labels=["fewer", labels.measured(chosen, "count", float(chosen["count"]))])
    axes.set_ylabel("probability")
