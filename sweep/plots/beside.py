"""Maps of one variable of several datasets side by side, with one scale."""

from __future__ import annotations

from itertools import chain

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from sweep.plots import cells, labels, legends
from sweep.plots.figure import Picture
from sweep.plots.maps import arrangement, draw_bar, draw_map, label_axes, shared_scale, thinned
from sweep.plots.marks import WORDS, marks, meaning
from sweep.plots.panels import MAX_PANELS, Panels, in_lines, title
from sweep.plots.scales import Limits

_WIDTH, _RATIO, _SIDE = 4.4, 0.78, 1.2
"""Inches of a map across, its height relative to that, and inches for the bar."""


def draw(each: list[Panels], limits: Limits | None = None, cmap: str | None = None) -> Figure:
    """A map of the first variable for each panel of each dataset, on axes of its own.

    Raises
    ------
    ValueError
        if a dataset has no two axes, or there would be too many maps.
    """
    name = each[0].names[0]
    shown = [(panels, panel) for panels in each for panel in panels.each]
    if len(shown) > MAX_PANELS:
        raise ValueError(f"{len(shown)} maps side by side; allowed: {MAX_PANELS}, select one value of an axis")
    if short := [_name(panels.dataset) for panels in each if len(panels.across) < 2]:
        raise ValueError(f"{', '.join(short)} has no two axes; allowed: maps side by side")
    rows, columns = arrangement(len(shown), 1)
    figure = Picture((_WIDTH * columns + _SIDE, 1.8 + _WIDTH * _RATIO * rows), dpi=110, layout="constrained")
    common = in_lines(_constants([panels.dataset for panels in each]), figure.get_figwidth())
    figure.suptitle(f"{labels.words(each[0].dataset, name)}\n{common}".strip(), fontsize=10)
    scale = shared_scale(each, limits, cmap)
    meanings = dict(chain.from_iterable(labels.flag_words(panels.dataset, name).items() for panels in each))
    bar = [] if meanings else [0.05]
    grid = figure.add_gridspec(rows, columns + len(bar), width_ratios=[*[1] * columns, *bar])
    lines: dict[str, Artist] = {}
    for k, (panels, panel) in enumerate(shown):
        axes = figure.add_subplot(grid[divmod(k, columns)])
        lines |= draw_map(axes, thinned(panels).isel(panel), name, panels.across, scale, small=True)
        axes.set_title(", ".join(filter(None, [_name(panels.dataset), title(panels.dataset, panel)])), fontsize=9)
        label_axes(axes, panels)
    if bar:
        draw_bar(figure.add_subplot(grid[:, -1]), each[0].dataset, name, scale)
    flags = [
        Patch(facecolor=scale.colours(scale.norm(value)), edgecolor="0.3", label=words)
        for value, words in meanings.items()
        if any((panels.dataset[name] == value).any() for panels in each)
    ]
    legends.below(figure, [*flags, *_kinds(each, name), *lines.values()])
    return figure


def _kinds(each: list[Panels], name: str) -> list[Artist]:
    """The entries of the kinds of cells, with their numbers in one dataset after the other."""
    found = [marks(panels.dataset, name) for panels in each]
    handles = []
    for kind in WORDS:
        counts = [int(kinds[kind].sum()) for kinds in found]
        if any(counts):
            first = next(panels.dataset for panels, count in zip(each, counts, strict=True) if count)
            numbers = " and ".join(f"{n} of {kinds[kind].size}" for n, kinds in zip(counts, found, strict=True))
            handles.append(cells.handle(kind, f"{meaning(first, name, kind)} ({numbers})"))
    return handles


def _name(dataset: xr.Dataset) -> str:
    """What the dataset is called."""
    return str(dataset.attrs.get("title", "")).partition(":")[0]


def _constants(datasets: list[xr.Dataset]) -> str:
    """The parameters that are the same in all datasets."""
    first, *others = datasets

    def shared(name: str) -> bool:
        return all(name in other.coords and np.array_equal(other[name], first[name]) for other in others)

    own = [name for name in map(str, first.coords) if not shared(name)]
    return labels.constants(first.drop_vars(own))
