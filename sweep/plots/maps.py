"""Maps by matplotlib."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.patches import Patch

from sweep.parameters import PARAMETERS
from sweep.plots import hatches, labels, lines
from sweep.plots.description import Map, common_scale, describe
from sweep.plots.figure import RATIO, Sheet, arrangement, panel_width, set_scale
from sweep.plots.marks import legend, shared_kinds, with_results
from sweep.plots.panels import Panel, Panels, title
from sweep.plots.scales import AUTO, Limits, Scale, thinned

_WIDEST = 4.4
"""Largest width of a map in inches."""

_SMALL = 2.2
"""Width of a map in inches below which numbers and symbols do not fit on its lines."""

_TICK = 0.2
"""Smallest distance in inches between the ticks of a bar."""

_AROUND = 1.2
"""Width in inches of the labels and bars around maps."""

_OF_DIFFERENCES = ("failed", "not_run", "impossible", "no_value", "time_limit")
"""Kinds of cell that maps of differences and ratios mark too; the map of the simulated counts next to them has all."""


def draw(panels: Panels, limits: Limits = AUTO, cmap: str | None = None) -> Sheet:
    """Draw a map of each variable over two axes, and one such row for each value of the other axes.

    All maps of a variable and of its prediction share a scale and its bar; the legend explains flags.
    """
    dataset, names = panels.dataset, panels.names + panels.compared
    shared = shared_kinds(panels.whole, names[0])
    maps = _maps(panels, names, shared)
    count = len(names) * len(maps)
    rows, groups = arrangement(len(maps), len(names))
    columns = groups * len(names)
    width = panel_width(columns, _WIDEST, _AROUND)
    figure = Sheet(dataset, width * columns + _AROUND, 2.0 + width * RATIO * rows)
    frames = figure.panels(rows, columns, count, sharex=True, sharey=True)
    scales = _scales(panels, maps, limits, cmap)
    entries: dict[str, Artist] = {}
    for i, axes in enumerate(frames):
        k, name = i // len(names), names[i % len(names)]
        shown, compared = maps[k][name], name in panels.compared
        entries |= _map(axes, shown, scales[name], width, compared=compared)
        axes.set_title(_title(panels, name, panels.each[k], topmost=i < columns))
        _label_axes(axes, dataset, shown, left=i % columns == 0, lowest=i + columns >= count, brief=width < _SMALL)
    for group in (panels.names, panels.compared):
        if group and not maps[0][group[0]].flags:
            of_group = [axes for i, axes in enumerate(frames) if names[i % len(names)] in group]
            words = labels.common(dataset, group[-1]) if panels.compared else labels.label(dataset, group[-1])
            inner = group != (panels.compared or panels.names)  # on the right its label would be that of the next map
            _bar(of_group, words, scales[group[-1]], int(width * RATIO * rows / _TICK), left=inner)
    meanings = _meanings(panels, maps, scales[names[0]], shared)
    notes = dict.fromkeys(note for each in maps for shown in each.values() for note in shown.notes)
    figure.explain([*meanings, *entries.values()], notes=notes)
    return figure


def draw_in(axes: Axes, panels: Panels, limits: Limits, cmap: str | None) -> None:
    """Draw the map of the first variable into these axes, with its bar beside them."""
    name = panels.names[0]
    shown = _maps(panels, [name], {})[0][name]
    scale = common_scale([shown], limits, cmap)
    _map(axes, shown, scale, _WIDEST)
    _label_axes(axes, panels.dataset, shown)
    _bar([axes], labels.label(panels.dataset, name), scale)


Maps = list[dict[str, Map]]
"""For each panel of a dataset, the maps of its variables."""


def _maps(panels: Panels, names: list[str], shared: Mapping[str, str]) -> Maps:
    down, right = panels.across
    parts = (panels.dataset.isel(panel) for panel in panels.each)
    return [{name: describe(part, name, right, down, shared) for name in names} for part in parts]


def _scales(panels: Panels, maps: Maps, limits: Limits, cmap: str | None) -> dict[str, Scale]:
    """The scale of each variable, the same in all panels; simulated and predicted values share one."""
    common = common_scale([each[name] for each in maps for name in panels.names], limits, cmap)
    return dict.fromkeys(panels.names, common) | {
        name: common_scale([each[name] for each in maps]) for name in panels.compared
    }


def _map(axes: Axes, shown: Map, scale: Scale, width: float, *, compared: bool = False) -> dict[str, Artist]:
    """Draw one map, `width` inches wide; returns the legend entries of its lines.

    A map that compares two others has fewer marks.
    """
    set_scale(axes, "x", shown.x.values)
    set_scale(axes, "y", shown.y.values)
    values = np.ma.masked_where(shown.blank, shown.values)
    axes.pcolormesh(
        shown.x.edges, shown.y.edges, values, cmap=scale.colours, norm=scale.norm, rasterized=values.size > 5000,
        gid=shown.name,
    )  # fmt: skip
    axes.set(xlim=shown.frame[0], ylim=shown.frame[1])
    dark = ~shown.blank & (scale.lightness(values.filled(values.data.flat[0])) < 0.5)
    hatches.draw(axes, {kind: w for kind, w in shown.marks.items() if not compared or kind in _OF_DIFFERENCES},
                 (shown.y.edges, shown.x.edges), dark)  # fmt: skip
    return dict(lines.draw(axes, shown, width if width >= _SMALL else 0.0))


def _title(panels: Panels, name: str, panel: Panel, *, topmost: bool) -> str:
    """Name the variable of a column of maps, unless their bar does, and below it the values of the other axes."""
    words, compared = labels.words(panels.dataset, name), name in panels.compared
    if panels.compared:
        words = words.rpartition(", ")[2] if compared else labels.origin(panels.dataset, name)
    if not topmost if panels.compared else not labels.flag_words(panels.dataset, name):
        words = ""
    return "\n".join(filter(None, [words, title(panels.dataset, panel)]))


def _label_axes(
    axes: Axes, dataset: xr.Dataset, shown: Map, *, left: bool = True, lowest: bool = True, brief: bool = False
) -> None:
    """Label the axes of a map on the left and below, in `brief` with their symbols."""
    axes.tick_params(labelleft=left, labelbottom=lowest)
    x, y = (
        labels.with_unit(labels.symbol(axis.name), labels.unit(dataset, axis.name))
        if brief and axis.name in PARAMETERS
        else labels.label(dataset, axis.name)
        for axis in (shown.x, shown.y)
    )
    axes.set(xlabel=x if lowest else "", ylabel=y if left else "")


def _bar(beside: list[Axes], words: str, scale: Scale, most: int = 12, *, left: bool = False) -> None:
    """Draw the bar of a scale to the right of the maps that share it, with these words to the right or left of it."""
    figure = beside[0].figure
    bar = figure.colorbar(ScalarMappable(scale.norm, scale.colours), ax=beside, extend=scale.arrows, pad=0.02)
    bar.set_label(words)
    bar.ax.yaxis.set_label_position("left" if left else "right")
    if scale.ticks:
        ticks = thinned(scale.ticks, most)
        bar.set_ticks(list(ticks), labels=list(ticks.values()))
        bar.ax.minorticks_off()


def _meanings(panels: Panels, maps: Maps, scale: Scale, shared: Mapping[str, str]) -> list[Artist]:
    """Explain the colours of flags and the marks of cells, with the number of cells that have them."""
    handles: list[Artist] = []
    name, whole = panels.names[0], panels.whole
    if maps[0][name].flags:
        found = with_results(whole, name)
        for value, words in (scale.ticks or {}).items():
            if count := int((found == value).sum()):
                colour = scale.rgba(np.array(value)).tolist()
                handles.append(Patch(facecolor=colour, edgecolor="0.3", label=f"{words} ({count})"))
    kinds = {kind: words for kind, words in legend(whole, name).items() if kind not in shared}
    if "no_value" in (compared := legend(whole, [*panels.names, *panels.compared][-1])):
        kinds["no_value"] = compared["no_value"]
    return [*handles, *(hatches.handle(kind, words) for kind, words in kinds.items())]
