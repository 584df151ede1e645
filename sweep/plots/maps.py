"""Maps by matplotlib: of one dataset's variables, or of one variable of several datasets, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar, make_axes
from matplotlib.patches import Patch

from sweep.plots import hatches, labels, lines
from sweep.plots.description import Map, common_scale, describe
from sweep.plots.figure import BESIDE, RATIO, Picture, arrangement, fits, panel_width, set_scale
from sweep.plots.marks import legend, of_all, with_results
from sweep.plots.panels import MAX_PANELS, Panel, Panels, title
from sweep.plots.scales import Limits, Scale

MAX_VALUES = 1000
"""Values drawn of an axis, taken evenly: more would be less than a pixel each."""

_WIDEST = 4.4
"""Inches of a map across, at most."""

_BAR = 0.05
"""Width of a bar relative to a map."""

_SMALL = 2.5
"""Inches of a map across below which it is too small for symbols at lines."""

_AROUND = 1.2
"""Inches across of what stands around maps."""

_OF_DIFFERENCES = ("failed", "not_run", "impossible", "no_value", "time_limit")
"""Kinds of cell marked on maps of differences and ratios too; the map of the simulated counts beside it has all."""


def draw(panels: Panels, limits: Limits | None = None, cmap: str | None = None, *, contours: bool = False) -> Picture:
    """A map of each variable over two axes, side by side, and such a row for each value of the other axes."""
    dataset, names = panels.dataset, panels.names + panels.compared
    maps = _maps(panels, names)
    together = len(names) if fits(len(names)) else 1
    bar = [] if maps[0][names[0]].flags else [""]  # flags are told in the legend
    groups = [[name, *bar] for name in names] if together == 1 else [[*panels.names, *bar, *panels.compared, *bar]]
    count = len(groups) * len(maps)
    rows, across = arrangement(count, together)
    columns = across * together
    width = panel_width(columns, _WIDEST, _AROUND)
    small = width < _SMALL
    figure = Picture(width * columns + _AROUND, 1.6 + width * RATIO * rows)
    figure.head(dataset.attrs.get("title", ""), labels.constants(dataset))
    each_scales = [_scales(maps, k, panels.names, limits, cmap) for k in range(len(maps))]
    entries: dict[str, Artist] = {}
    first = None
    widths = across * [1 if name else _BAR for name in groups[0]]
    grid = figure.add_gridspec(rows, len(widths), width_ratios=widths)
    for place, (k, kinds) in enumerate(product(range(len(maps)), groups)):
        scales, (row, column) = each_scales[k], divmod(place, across)
        for i, name in enumerate(kinds):
            at = grid[row, column * len(kinds) + i]
            if not name:
                _bar(figure.add_subplot(at, label=BESIDE), dataset, kinds[i - 1], scales[kinds[i - 1]])
                continue
            axes = figure.add_subplot(at, sharex=first, sharey=first)
            first = first or axes
            shown, compared = maps[k][name], name in panels.compared
            entries |= _map(axes, shown, scales[name], labelled=not small, contours=contours, compared=compared)
            axes.set_title(_title(panels, name, panels.each[k], small=small and together > 1))
            _label_axes(axes, dataset, shown, left=i == 0, lowest=place + across >= count)
    figure.explain([*_meanings([panels], [maps], each_scales[0]), *entries.values()])
    return figure


def draw_in(axes: Axes, panels: Panels, limits: Limits | None, cmap: str | None, *, contours: bool) -> None:
    """Draw the map of the first variable into these axes, with its bar beside them."""
    name = panels.names[0]
    shown = _maps(panels, [name])[0][name]
    scale = common_scale([shown], limits, cmap)
    _map(axes, shown, scale, labelled=True, contours=contours)
    _label_axes(axes, panels.dataset, shown)
    _bar(make_axes(axes)[0], panels.dataset, name, scale)


def draw_beside(
    each: list[Panels], limits: Limits | None = None, cmap: str | None = None, *, contours: bool = False
) -> Picture:
    """A map of the first variable for each panel of each dataset, on axes of its own, with one scale.

    Raises
    ------
    ValueError
        if a dataset has no two axes, the units differ, or there would be too many maps.
    """
    name = each[0].names[0]
    count = sum(len(panels.each) for panels in each)
    if count > MAX_PANELS:
        raise ValueError(f"{count} maps side by side are more than {MAX_PANELS}; select one value of an axis")
    if short := [_name(panels.dataset) for panels in each if len(panels.across) < 2]:
        raise ValueError(f"{', '.join(short)} has no two axes; only maps are drawn side by side")
    units = {labels.unit(panels.dataset, name): _name(panels.dataset) for panels in each}
    if len(units) > 1:
        told = " and ".join(f"{unit or 'a plain number'} in {of}" for unit, of in units.items())
        raise ValueError(f"{name} is in different units, {told}; only maps of one unit share a scale")
    rows, columns = arrangement(count, 1)
    width = panel_width(columns, _WIDEST, _AROUND)
    figure = Picture(width * columns + _AROUND, 1.8 + width * RATIO * rows)
    figure.head(labels.words(each[0].dataset, name), _constants([panels.dataset for panels in each]))
    maps = [_maps(panels, [name]) for panels in each]
    scale = common_scale([shown[name] for of_one in maps for shown in of_one], limits, cmap)
    bar = [] if maps[0][0][name].flags else [_BAR]
    grid = figure.add_gridspec(rows, columns + len(bar), width_ratios=[*[1] * columns, *bar])
    places = (divmod(k, columns) for k in range(count))
    entries: dict[str, Artist] = {}
    for panels, of_one in zip(each, maps, strict=True):
        for panel, shown in zip(panels.each, of_one, strict=True):
            axes = figure.add_subplot(grid[next(places)])
            entries |= _map(axes, shown[name], scale, labelled=width >= _SMALL, contours=contours)
            words = [_name(panels.dataset), title(panels.dataset, panel)]
            axes.set_title(", ".join(filter(None, words)))
            _label_axes(axes, panels.dataset, shown[name])
    if bar:
        _bar(figure.add_subplot(grid[:, -1], label=BESIDE), each[0].dataset, name, scale)
    figure.explain([*_meanings(each, maps, {name: scale}), *entries.values()])
    return figure


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


def _map(
    axes: Axes, shown: Map, scale: Scale, *, labelled: bool, contours: bool, compared: bool = False
) -> dict[str, Artist]:
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
    if contours:
        lines.draw_contours(axes, shown, scale)
    return dict(lines.draw(axes, shown, labelled=labelled))


def _title(panels: Panels, name: str, panel: Panel, *, small: bool) -> str:
    """Name what a map shows; a small one beside others leaves the values of its panel to the first of them."""
    words, compared = labels.words(panels.dataset, name), name in panels.compared
    if panels.compared:  # what they have in common stands at the bar
        words = words.rpartition(", ")[2] if compared else labels.short(name).partition(", ")[2] or "simulated"
        words = (name if compared else words.partition(" (")[0]) if small else words
    elif panel and not labels.flag_words(panels.dataset, name):
        words = ""  # it stands at the bar
    where = title(panels.dataset, panel) if not small or name == panels.names[0] else ""
    return ", ".join(filter(None, [words, where]))


def _label_axes(axes: Axes, dataset: xr.Dataset, shown: Map, *, left: bool = True, lowest: bool = True) -> None:
    """Write what the axes of a map show, on the left and below."""
    axes.tick_params(labelleft=left, labelbottom=lowest)
    if left:
        axes.set_ylabel(labels.label(dataset, shown.y.name))
    if lowest:
        axes.set_xlabel(labels.label(dataset, shown.x.name))


def _bar(axes: Axes, dataset: xr.Dataset, name: str, scale: Scale) -> None:
    """Draw the bar of a scale, with what it shows."""
    bar = Colorbar(axes, ScalarMappable(scale.norm, scale.colours), extend=scale.arrows)
    bar.set_label(f"{labels.common(dataset, name)}\n")  # an empty line, or it would seem to belong to the next map
    if scale.ticks:
        bar.set_ticks(list(scale.ticks), labels=list(scale.ticks.values()))
        bar.ax.minorticks_off()


def _meanings(each: list[Panels], maps: list[Maps], scales: dict[str, Scale]) -> list[Artist]:
    """Say what the colours of flags and the marks of cells mean, and how many cells of each dataset have them."""
    handles: list[Artist] = []
    names = list(scales)
    datasets = [panels.whole for panels in each]
    if maps[0][0][names[0]].flags:
        each_found = [with_results(dataset, names[0]) for dataset in datasets]
        for value, words in (scales[names[0]].ticks or {}).items():
            counts = [int((found == value).sum()) for found, _ in each_found]
            if any(counts):
                told = of_all(counts, [size for _, size in each_found])
                colour = scales[names[0]].rgba(np.array(value)).tolist()
                handles.append(Patch(facecolor=colour, edgecolor="0.3", label=f"{words} ({told})"))
    kinds = legend(datasets[0], names[0], *datasets[1:])
    if "no_value" in (compared := legend(datasets[0], names[-1])):
        kinds["no_value"] = compared["no_value"]
    return [*handles, *(hatches.handle(kind, words) for kind, words in kinds.items())]


def _name(dataset: xr.Dataset) -> str:
    """Name the dataset."""
    return str(dataset.attrs.get("title", "")).partition(":")[0]


def _constants(datasets: Sequence[xr.Dataset]) -> str:
    """The parameters that are the same in all datasets."""
    first, *others = datasets
    own = {n for n, v in first.coords.items() for other in others if not np.array_equal(v, other.coords.get(n, []))}
    return labels.constants(first.drop_vars(own))
