"""Cuts through a map along the row and the column of the cell under the pointer, drawn by the browser."""

from __future__ import annotations

from typing import Any

from bokeh.models import ColumnDataSource, Row
from bokeh.plotting import figure

from sweep.explorer import axes
from sweep.explorer.slices import PlacedAxis, Source
from sweep.plots import labels

_HEIGHT = 150
"""Of a cut, in pixels."""


class Cuts:
    """A figure for each axis of a map, which follows its zoom."""

    def __init__(self, source: Source, ranges: list[tuple[PlacedAxis, Any]]) -> None:
        self.models = [_cut(source, axis, span) for axis, span in ranges if axis.name]
        self.root = Row(*(cut["plot"] for cut in self.models), name="cuts", sizing_mode="stretch_width",
                        styles={"flex-basis": "100%", "flex-wrap": "wrap"})  # fmt: skip

    def spell(self, words: dict[float, str]) -> None:
        """Write the values of another map in words, if they stand for some."""
        for cut in self.models:
            cut["plot"].yaxis.major_label_overrides = words


def _cut(source: Source, axis: PlacedAxis, span: Any) -> dict[str, Any]:
    """A figure, and what `cut` of page.js has to know to fill it."""
    plot = figure(
        height=_HEIGHT, min_width=220, sizing_mode="stretch_width", tools="", toolbar_location=None, x_range=span,
        x_axis_type=axes.kind(axis), x_axis_label=source.label(axis.name), name=f"cut along {axis.name}", title=" ",
        outline_line_color=None,
    )  # fmt: skip
    data = ColumnDataSource({"at": [], "value": [], "here": []}, syncable=False)
    plot.step("at", "value", source=data, mode="center", color="#0072b2", line_width=1.5)
    plot.scatter("at", "here", source=data, color="#d55e00", size=8)
    axes.style(plot, axis)
    plot.title.update(text_font_size="12px", text_font_style="normal")
    plot.grid.grid_line_color = axes.GRID
    return {
        "plot": plot, "at": axis.place(axis.values), "values": axis.values, "symbol": labels.symbol(axis.name),
    }  # fmt: skip
