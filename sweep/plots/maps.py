"""Maps over two axes of a dataset."""

from __future__ import annotations

from math import log

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colorbar import Colorbar
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from sweep.grid import Array
from sweep.plots import cells, labels, legends, scales, theory
from sweep.plots.axes import set_scale
from sweep.plots.figure import Picture
from sweep.plots.marks import blank, legend, marks
from sweep.plots.panels import Panels, edges, heading, title
from sweep.plots.quantities import COMPARISONS
from sweep.plots.scales import Limits, Scale

_MAX_VALUES = 1000
"""Values drawn of an axis, taken evenly: more would be less than a pixel each."""

_PAGE, _WIDEST, _RATIO = 14.0, 4.4, 0.78
"""Inches of the page across, inches of a map across, and its height relative to that."""

_BAR = 0.05
"""Width of a bar relative to a map."""

_SMALL = 4
"""Maps beside each other beyond which they are too small for labels at lines."""

_OF_DIFFERENCES = ("failed", "not_run", "impossible", "time_limit")
"""Kinds of cell marked on maps of differences too; the map of the simulated counts beside it has all."""

_TITLES = {
    "reversals": "simulated",
    "reversals_predicted": "predicted (Takano 2011)",
    "t_first_reversal": "simulated",
    "t_first_reversal_predicted": "predicted (Garcia and Hubbard 1988)",
    "ratio": "simulated / predicted",
}
_SMALL_TITLES = dict.fromkeys(("reversals", "t_first_reversal"), "simulated")
_SMALL_TITLES |= dict.fromkeys(("reversals_predicted", "t_first_reversal_predicted"), "predicted")
_SMALL_TITLES |= {name: name for name in COMPARISONS}


def draw(panels: Panels, limits: Limits | None = None, cmap: str | None = None) -> Figure:
    """A map of each variable over two axes, side by side, and such a row for each value of the other axes."""
    rows, groups = arrangement(len(panels.each), len(panels.names))
    columns = groups * len(panels.names)
    width = min(_PAGE / columns, _WIDEST)
    figure = Picture(figsize=(width * columns + 1.2, 1.6 + width * _RATIO * rows), dpi=110, layout="constrained")
    figure.suptitle(heading(panels.dataset, figure.get_figwidth()), fontsize=10)
    kinds = _columns(panels)
    grid = figure.add_gridspec(rows, groups * len(kinds), width_ratios=groups * [_BAR if k == "" else 1 for k in kinds])
    entries: dict[str, Artist] = {}
    first: Axes | None = None
    for k, panel in enumerate(panels.each):
        row, group = divmod(k, groups)
        chosen = thinned(panels).isel(panel)
        for i, name in enumerate(kinds):
            place = grid[row, group * len(kinds) + i]
            scale = _scale(chosen, panels, name or kinds[i - 1], limits, cmap)
            if name == "":
                draw_bar(figure.add_subplot(place), panels.dataset, kinds[i - 1], scale)
                continue
            axes = figure.add_subplot(place, sharex=first, sharey=first)
            first = first or axes
            entries |= draw_map(axes, chosen, name, panels.across, scale, small=columns > _SMALL)
            axes.set_title(_title(panels, name, panel, small=columns > _SMALL), fontsize=9)
            label_axes(axes, panels, left=i == 0, lowest=k + groups >= len(panels.each))
    _legend(figure, panels, entries)
    return figure


def _columns(panels: Panels) -> list[str]:
    """The variables of a panel in their order, and "" for each bar: after the last map that shares its scale."""
    if "flag_values" in panels.dataset[panels.names[0]].attrs:  # told in the legend
        return panels.names
    counted = [name for name in panels.names if name not in COMPARISONS]
    compared = [name for name in panels.names if name in COMPARISONS]
    return [*counted, *([""] if counted else []), *(each for name in compared for each in (name, ""))]


def arrangement(panels: int, maps: int) -> tuple[int, int]:
    """Rows of the page, and panels side by side in each, for so many panels of so many maps: shaped as a screen."""

    def misshapen(groups: int) -> float:
        return abs(log(groups * maps / (-(-panels // groups) * _RATIO) / 2))

    groups = min(range(1, panels + 1), key=misshapen)
    return -(-panels // groups), groups


def thinned(panels: Panels) -> xr.Dataset:
    """The dataset with as many values of the axes as can be seen."""
    return panels.dataset.isel(
        {d: slice(None, None, -(-panels.dataset.sizes[d] // _MAX_VALUES)) for d in panels.across}
    )


def draw_map(
    axes: Axes, chosen: xr.Dataset, name: str, across: list[str], scale: Scale, *, small: bool
) -> dict[str, Artist]:
    """Draw one map; returns the entries that its lines need in the legend."""
    down, right = across
    field = chosen[name].transpose(down, right)
    kinds = marks(chosen, name)
    empty = blank(kinds).transpose(down, right).values | field.isnull().values
    values = field.values
    around = edges(chosen[down].values), edges(chosen[right].values)
    set_scale(axes, "x", chosen[right].values)
    set_scale(axes, "y", chosen[down].values)
    axes.pcolormesh(
        around[1], around[0], np.ma.masked_where(empty, values),
        cmap=scale.colours, norm=scale.norm, rasterized=values.size > 5000,
    )  # fmt: skip
    axes.set(xlim=around[1][[0, -1]], ylim=around[0][[0, -1]])
    dark = np.where(empty, False, scale.lightness(np.where(empty, values.ravel()[0], values)) < 0.5)
    arrays = {kind: where.transpose(down, right).values for kind, where in kinds.items()}
    if name in COMPARISONS:
        arrays = {kind: where for kind, where in arrays.items() if kind in _OF_DIFFERENCES}
    cells.draw(axes, arrays, around, dark)
    if name not in theory.REVERSALS:
        return {}
    return dict(theory.draw(axes, chosen, (down, right), labelled=not small))


def _scale(chosen: xr.Dataset, panels: Panels, name: str, limits: Limits | None, cmap: str | None) -> Scale:
    """The scale of a map: what is simulated and what is predicted of a panel share theirs."""
    if "flag_values" in chosen[name].attrs:
        return scales.flags(list(_flags_present(panels.dataset, name)), cmap)
    own = (limits, cmap) if panels.names == [name] else (None, None)
    if name in COMPARISONS:
        return _of_numbers(name, _values(chosen, name), *own)
    together = np.concatenate([_values(chosen, other) for other in panels.names if other not in COMPARISONS])
    return _of_numbers(name, together, limits, cmap)


def _of_numbers(name: str, values: Array, limits: Limits | None, cmap: str | None) -> Scale:
    """The scale of a variable without flags."""
    compared = {"difference": scales.differences, "ratio": scales.ratios}
    other = scales.counts if values.dtype.kind == "i" else scales.continuous
    return compared.get(name, other)(values, limits, cmap)


def shared_scale(each: list[Panels], limits: Limits | None, cmap: str | None) -> Scale:
    """The scale of the first variable of several datasets."""
    name = each[0].names[0]
    flagged = [panels.dataset for panels in each if "flag_values" in panels.dataset[name].attrs]
    if flagged:
        return scales.flags(sorted({value for dataset in flagged for value in _flags_present(dataset, name)}), cmap)
    values = np.concatenate([_values(panels.dataset, name) for panels in each])
    return _of_numbers(name, values, limits, cmap)


def _values(chosen: xr.Dataset, name: str) -> Array:
    """The values of the cells that have a result; a zero if none has."""
    values = chosen[name].values[~blank(marks(chosen, name)).values]
    return values if values.size else np.zeros(1, chosen[name].dtype)


def _flags_present(dataset: xr.Dataset, name: str) -> dict[int, int]:
    """In how many cells with a result each value of a variable with flags occurs; if there are none, in all."""
    values, empty = dataset[name].values, blank(marks(dataset, name)).values
    present, counts = np.unique(values if empty.all() else values[~empty], return_counts=True)
    return dict(zip(present.tolist(), counts.tolist(), strict=True))


def _title(panels: Panels, name: str, panel: dict[str, int], *, small: bool) -> str:
    """What a map shows; a small one beside others leaves the values of its panel to the first of them."""
    words = labels.words(panels.dataset, name)
    if len(panels.names) > 1:
        words = _SMALL_TITLES.get(name, words) if small else _TITLES.get(name, words)
    elif panel:
        words = ""  # it stands at the bar or in the legend
    where = title(panels.dataset, panel) if not small or name == panels.names[0] else ""
    return ", ".join(filter(None, [words, where]))


def label_axes(axes: Axes, panels: Panels, *, left: bool = True, lowest: bool = True) -> None:
    """Write what the axes of a map show, on the left and below."""
    down, right = panels.across
    axes.tick_params(labelsize=8, labelleft=left, labelbottom=lowest)
    if left:
        axes.set_ylabel(labels.label(panels.dataset, down), fontsize=9)
    if lowest:
        axes.set_xlabel(labels.label(panels.dataset, right), fontsize=9)


def draw_bar(axes: Axes, dataset: xr.Dataset, name: str, scale: Scale) -> None:
    """Draw the bar of a scale, with what it shows."""
    bar = Colorbar(axes, scale.mappable(), extend=scale.arrows)
    words = "spin reversals" if name.startswith("reversals") else labels.label(dataset, name.removesuffix("_predicted"))
    bar.set_label(f"{words}\n", fontsize=8)  # an empty line, or it would seem to belong to the next map
    axes.tick_params(labelsize=7)
    scale.label(bar)


def _legend(figure: Figure, panels: Panels, lines: dict[str, Artist]) -> None:
    """Below the maps: what the colours of flags, the marks of cells and the lines of theory mean."""
    dataset, name = panels.dataset, panels.names[0]
    handles: list[Artist] = []
    if meanings := labels.flag_words(dataset, name):
        present = _flags_present(dataset, name)
        colours = scales.flags(list(present)).rgba(np.array(list(present)))
        for (value, count), colour in zip(present.items(), colours, strict=True):
            words = f"{meanings.get(value, value)} ({count} of {dataset[name].size})"
            handles.append(Patch(facecolor=colour, edgecolor="0.3", label=words))
    kinds = legend(dataset, name)
    if "no_value" in (compared := legend(dataset, panels.names[-1])):
        kinds["no_value"] = compared["no_value"]
    handles += [cells.handle(kind, words) for kind, words in kinds.items()]
    handles += lines.values()
    legends.below(figure, handles)
