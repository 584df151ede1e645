"""Maps by matplotlib."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.patches import Patch

from sweep.plots import hatches, labels, lines
from sweep.plots.description import Map, common_scale, describe
from sweep.plots.figure import RATIO, Picture, arrangement, fits, panel_width, set_scale
from sweep.plots.marks import legend, with_results
from sweep.plots.panels import Panel, Panels, title
from sweep.plots.scales import Limits, Scale

_WIDEST = 4.4
"""Inches of a map across, at most."""

_SMALL = 2.5
"""Inches of a map across below which it is too small for symbols at lines."""

_AROUND = 1.2
"""Inches across of what stands around maps."""

_OF_DIFFERENCES = ("failed", "not_run", "impossible", "no_value", "time_limit")
"""Kinds of cell marked on maps of differences and ratios too; the map of the simulated counts beside it has all."""


def draw(panels: Panels, limits: Limits | None = None, cmap: str | None = None) -> Picture:
    """A map of each variable over two axes, side by side, and such a row for each value of the other axes."""
    dataset, names = panels.dataset, panels.names + panels.compared
    maps = _maps(panels, names)
    together = len(names) if fits(len(names)) else 1
    # Maps side by side share the bar of their scale, beside the last of them; flags are told in the legend.
    shared = [[name] for name in names] if together == 1 else [*filter(None, [panels.names, panels.compared])]
    count = len(names) * len(maps)
    rows, across = arrangement(count // together, together)
    columns = across * together
    width = panel_width(columns, _WIDEST, _AROUND)
    figure = Picture(width * columns + _AROUND, 1.6 + width * RATIO * rows)
    figure.head(dataset.attrs.get("title", ""), labels.constants(dataset))
    frames = figure.panels(rows, columns, count, sharex=True, sharey=True)
    scales = [_scales(maps, k, panels.names, limits, cmap) for k in range(len(maps))]
    entries: dict[str, Artist] = {}
    for k, shown in enumerate(maps):
        axes = dict(zip(names, frames[k * len(names) :], strict=False))
        for i, (name, one) in enumerate(axes.items(), k * len(names)):
            compared = name in panels.compared
            entries |= _map(one, shown[name], scales[k][name], labelled=width >= _SMALL, compared=compared)
            one.set_title(_title(panels, name, panels.each[k]))
            _label_axes(one, dataset, shown[name], left=i % together == 0, lowest=i + columns >= count)
        for group in shared if not shown[names[0]].flags else ():
            _bar([axes[name] for name in group], dataset, group[-1], scales[k][group[-1]])
    figure.explain([*_meanings(panels, maps, scales[0][names[0]]), *entries.values()])
    return figure


def draw_in(axes: Axes, panels: Panels, limits: Limits | None, cmap: str | None) -> None:
    """Draw the map of the first variable into these axes, with its bar beside them."""
    name = panels.names[0]
    shown = _maps(panels, [name])[0][name]
    scale = common_scale([shown], limits, cmap)
    _map(axes, shown, scale, labelled=True)
    _label_axes(axes, panels.dataset, shown)
    _bar([axes], panels.dataset, name, scale)


Maps = list[dict[str, Map]]
"""For each panel of a dataset, the maps of its variables."""


def _maps(panels: Panels, names: list[str]) -> Maps:
    down, right = panels.across
    return [{name: describe(panels.dataset.isel(panel), name, right, down) for name in names} for panel in panels.each]


def _scales(maps: Maps, k: int, together: list[str], limits: Limits | None, cmap: str | None) -> dict[str, Scale]:
    """The scales of a panel: what is simulated and predicted share theirs, and flags theirs with the other panels."""
    shown = maps[k]
    panels = maps if shown[together[0]].flags else [shown]
    common = common_scale([panel[name] for panel in panels for name in together], limits, cmap)
    return {name: common if name in together else common_scale([each]) for name, each in shown.items()}


def _map(axes: Axes, shown: Map, scale: Scale, *, labelled: bool, compared: bool = False) -> dict[str, Artist]:
    """Draw one map, perhaps of how two others compare; returns the entries that its lines need in the legend."""
    set_scale(axes, "x", shown.x.values)
    set_scale(axes, "y", shown.y.values)
    values = np.ma.masked_where(shown.blank, shown.values)
    axes.pcolormesh(
        shown.x.edges, shown.y.edges, values, cmap=scale.colours, norm=scale.norm, rasterized=values.size > 5000,
        gid=shown.name,
    )  # fmt: skip
    axes.set(xlim=shown.x.edges[[0, -1]], ylim=shown.y.edges[[0, -1]])
    dark = ~shown.blank & (scale.lightness(values.filled(values.data.flat[0])) < 0.5)
    hatches.draw(axes, {kind: w for kind, w in shown.marks.items() if not compared or kind in _OF_DIFFERENCES},
                 (shown.y.edges, shown.x.edges), dark)  # fmt: skip
    return dict(lines.draw(axes, shown, labelled=labelled))


def _title(panels: Panels, name: str, panel: Panel) -> str:
    """Name what a map shows."""
    words, compared = labels.words(panels.dataset, name), name in panels.compared
    if panels.compared:  # what they have in common stands at the bar
        words = words.rpartition(", ")[2] if compared else labels.short(name).partition(", ")[2] or "simulated"
    elif panel and not labels.flag_words(panels.dataset, name):
        words = ""  # it stands at the bar
    return ", ".join(filter(None, [words, title(panels.dataset, panel)]))


def _label_axes(axes: Axes, dataset: xr.Dataset, shown: Map, *, left: bool = True, lowest: bool = True) -> None:
    """Write what the axes of a map show, on the left and below."""
    axes.tick_params(labelleft=left, labelbottom=lowest)
    if left:
        axes.set_ylabel(labels.label(dataset, shown.y.name))
    if lowest:
        axes.set_xlabel(labels.label(dataset, shown.x.name))


def _bar(beside: list[Axes], dataset: xr.Dataset, name: str, scale: Scale) -> None:
    """Draw the bar of a scale beside the maps that share it, with what it shows."""
    figure = beside[0].figure
    bar = figure.colorbar(ScalarMappable(scale.norm, scale.colours), ax=beside, extend=scale.arrows, pad=0.02)
    bar.set_label(labels.common(dataset, name))
    if scale.ticks:
        bar.set_ticks(list(scale.ticks), labels=list(scale.ticks.values()))
        bar.ax.minorticks_off()


def _meanings(panels: Panels, maps: Maps, scale: Scale) -> list[Artist]:
    """Say what the colours of flags and the marks of cells mean, and how many cells have them."""
    handles: list[Artist] = []
    name, whole = panels.names[0], panels.whole
    if maps[0][name].flags:
        found, size = with_results(whole, name)
        for value, words in (scale.ticks or {}).items():
            if count := int((found == value).sum()):
                colour = scale.rgba(np.array(value)).tolist()
                handles.append(Patch(facecolor=colour, edgecolor="0.3", label=f"{words} ({count} of {size})"))
    kinds = legend(whole, name)
    if "no_value" in (compared := legend(whole, [*panels.names, *panels.compared][-1])):
        kinds["no_value"] = compared["no_value"]
    return [*handles, *(hatches.handle(kind, words) for kind, words in kinds.items())]
