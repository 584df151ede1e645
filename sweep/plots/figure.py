"""A figure of matplotlib: how it is shown and laid out, its axes, and its legend below."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from math import log
from typing import Literal

import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from sweep.axis import Axis
from sweep.grid import Array
from sweep.plots import labels
from sweep.plots.panels import Panel, in_lines, title

PAGE = 14.0
"""Inches of a page across."""

RATIO = 0.78
"""Height of a map relative to its width."""

_LETTER, _HANDLE = 0.062, 0.75
"""Inches that a letter, and the rest of an entry, take in a legend."""


class Picture(Figure):
    """A figure that is shown as the value of a notebook's cell, also where pyplot has drawn nothing yet.

    Before that, IPython has no way to show a figure of matplotlib, and prints its name.
    """

    def __init__(self, width: float, height: float) -> None:
        super().__init__((width, height), dpi=110, layout="constrained")
        self._constants = ""

    def _repr_png_(self) -> bytes:
        stream = BytesIO()
        self.savefig(stream, format="png")
        return stream.getvalue()

    def head(self, title: str, constants: str) -> None:
        """A title, and the constant parameters, which stand over the legend."""
        self._constants = in_lines(constants, self.get_figwidth())
        if title:
            self.suptitle(title, fontsize=10)

    def explain(self, handles: Sequence[Artist]) -> None:
        """A legend below the figure, never over its data, in as many columns as fit; over it the constants."""
        if not handles and not self._constants:
            return
        longest = max((len(str(handle.get_label())) for handle in handles), default=0)
        columns = max(1, int(self.get_figwidth() / (longest * _LETTER + _HANDLE)))
        self.legend(
            handles=list(handles), loc="outside lower center", fontsize=8, frameon=False, handlelength=3,
            ncols=min(columns, max(len(handles), 1)), title=self._constants or None, title_fontsize=8,
        )  # fmt: skip


def framed(
    dataset: xr.Dataset, panels: list[Panel], x: str, width: float, above: float, height: float
) -> tuple[Picture, list[tuple[Axes, xr.Dataset]]]:
    """A figure with axes over `x` for each panel of a dataset, and the part of the dataset to draw there.

    Parameters
    ----------
    width, height : of one panel, in inches
    above : inches for what stands around the panels
    """
    rows, columns = arrangement(len(panels), 2)
    figure = Picture(min(width * columns, PAGE), above + height * rows)
    figure.head(dataset.attrs.get("title", ""), labels.constants(dataset))
    grid = figure.subplots(rows, columns, squeeze=False, sharex=True).ravel()
    for k, (axes, panel) in enumerate(zip(grid, panels, strict=False)):
        lowest = k + columns >= len(panels)
        axes.set_title(title(dataset, panel), fontsize=9)
        axes.tick_params(labelsize=8, labelbottom=lowest)
        if lowest and x:
            axes.set_xlabel(labels.label(dataset, x), fontsize=9)
    for axes in grid[len(panels) :]:
        axes.remove()
    return figure, [(axes, dataset.isel(panel)) for axes, panel in zip(grid, panels, strict=False)]


def arrangement(panels: int, maps: int) -> tuple[int, int]:
    """Rows of the page, and panels side by side in each, for so many panels of so many maps: shaped as a screen."""

    def misshapen(groups: int) -> float:
        return abs(log(groups * maps / (-(-panels // groups) * RATIO) / 2))

    groups = min(range(1, panels + 1), key=misshapen)
    return -(-panels // groups), groups


def set_scale(axes: Axes, which: Literal["x", "y"], values: Array) -> None:
    """Make an axis logarithmic if its values, in increasing order, have equal ratios; plain numbers at the ticks."""
    if Axis("", values).spacing != "log" or values[-1] <= 1.5 * values[0]:
        return
    axes.set(**{f"{which}scale": "log"})
    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_major_locator(LogLocator(subs=(1, 2, 5) if values[-1] < 1000 * values[0] else (1,)))
    axis.set_major_formatter(lambda at, _: labels.number(at))
    axis.set_minor_formatter(NullFormatter())
