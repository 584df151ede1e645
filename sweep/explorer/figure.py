"""The map of a slice as a Bokeh figure: one image, patterns that the browser draws over it, and tooltips by index.

Below it are cuts along the row and the column of the cell under the pointer, which the browser draws too.

An image and a table of bits are sent as binary arrays, without a glyph per cell, so that a million cells can be shown
smoothly.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import nullcontext
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr
from bokeh import models
from bokeh.models import ColumnDataSource
from bokeh.plotting import figure

from sweep.explorer import style
from sweep.explorer.slices import PlacedAxis, Source, plain
from sweep.explorer.state import State
from sweep.explorer.style import TILES
from sweep.kernels.measures.reversals import Reversals
from sweep.plots import description, labels, marks, places, theory
from sweep.plots.description import Map, describe
from sweep.plots.scales import Scale
from sweep.plots.theory import Line

HEIGHT = 480
"""Height of the map in pixels."""

_CUT_HEIGHT = 150
"""Height of a cut in pixels."""

STALE = "grey dots: lines of the dataset's body"

LINES = {name: (dash, round(1.25 * width, 2)) for name, (dash, width) in theory.STYLES.items()}
"""Dashes of the lines over a map, and their widths in pixels."""


class MapFigure:
    """The map over two axes, which shows one slice after another.

    The models stay the same from slice to slice, because a browser keeps models that are replaced.

    Parameters
    ----------
    x, y : the axes
    first : index along each axis of the cell that the cuts go through until another one is pointed at or chosen; by
        default the middle one
    """

    _look: tuple[Any, ...] = ()
    """Everything that bar, cuts and tooltips were last labelled for."""

    def __init__(self, source: Source, x: str, y: str, first: Mapping[str, int] | None = None) -> None:
        self._source, self.axes = source, (x, y)
        self._x, self._y = (source.axes.get(axis, PlacedAxis("", np.zeros(1))) for axis in (x, y))
        self.placed = self._x, self._y
        ex, ey = self._x.drawn_edges, self._y.drawn_edges
        place = {"x": ex[0], "y": ey[0], "dw": ex[-1] - ex[0], "dh": ey[-1] - ey[0]}
        self.figure = plot = _frame(source, self._x, self._y)
        self._cells = ColumnDataSource({"image": [np.zeros((1, 1), "uint8")], "kinds": [np.zeros((1, 1), "uint8")]})
        # Two images, because an image keeps its first colour mapper.
        self._images = [
            plot.image(image="image", source=self._cells, color_mapper=mapper, **place)
            for mapper in (
                models.LinearColorMapper(palette=["black"], low=0, high=1),
                models.LogColorMapper(palette=["black"], low=1, high=10),
            )
        ]
        over = {"image": [np.zeros((2, 2), "uint32")]} | {name: [at] for name, at in place.items()}
        overlay = ColumnDataSource(over, syncable=False)
        plot.image_rgba(image="image", x="x", y="y", dw="dw", dh="dh", source=overlay)
        self._lines = {name: _line(plot, f"line {name}", *style) for name, style in LINES.items()}
        self._stale = ColumnDataSource({"xs": [], "ys": []}, name="stale")
        plot.multi_line("xs", "ys", source=self._stale, color="#c8ccd0", width=1.5, dash=[2, 6])
        self._numbers = _counts(plot)
        self._uncertain = plot.scatter([], [], color="white", line_color="black", line_width=0.7)
        # The browser writes the cell under the pointer to the first, and the cell to run to the second.
        self.probe = ColumnDataSource({"i": [-1], "j": [-1]}, name="probe")
        self.request = ColumnDataSource({"i": [-1], "j": [-1], "add": [False], "count": [0]}, name="request")
        cursor, self.pins = _cursor(plot), _pins(plot)
        self._hover = models.HoverTool(renderers=self._images, point_policy="follow_mouse")
        plot.add_tools(self._hover)
        ranges = zip(self.placed, (plot.x_range, plot.y_range), strict=True)
        self._cuts = [_cut(source, axis, span) for axis, span in ranges if axis.name]
        self.cuts = models.Row(*(cut["plot"] for cut in self._cuts), name="cuts", sizing_mode="stretch_width",
                               styles={"flex-wrap": "wrap"})  # fmt: skip
        _connect(plot, self._cells, {"figure": plot, "overlay": overlay,
                 "tiles": [{"side": len(tile), "colours": tile.ravel()} for tile in TILES.values()],
                 "ex": ex, "ey": ey, "cursor": cursor, "probe": self.probe, "request": self.request,
                 "cells": self._cells, "cuts": self._cuts,
                 "first": [(first or {}).get(name, (len(edges) - 1) // 2) for name, edges in ((x, ex), (y, ey))],
                 "blank": sum(1 << list(TILES).index(kind) for kind in marks.BLANK)})  # fmt: skip

    def show(self, state: State, other: xr.Dataset | None = None) -> tuple[Map, Scale]:
        """Show the variable of a state, or the first variable of `other`; return its map and its colour scale."""
        if other is None:
            part, known = self._source.map(state.show, *self.axes, state.at), self._source.cell
            scale = style.scale_of(part, state, self._source.extremes(state.show))
        else:
            part, known = describe(other, next(iter(map(str, other.data_vars))), *self.axes), other
            counted = Reversals.name in self._source.variables
            scale = style.scale_of(part, state, self._source.extremes(Reversals.name) if counted else part.shown[:0])
        logarithmic = style.is_logarithmic(scale)
        for image in self._images:
            image.visible = (image is self._images[1]) == logarithmic
        mapper = self._images[logarithmic].glyph.color_mapper
        mapper.update(**style.mapping(scale))
        kinds = np.packbits(np.stack(list(part.marks.values()), axis=-1), axis=-1, bitorder="little")
        self._cells.data = {"image": [plain(part.values)], "kinds": [kinds[..., 0]]}
        stale = list[Line]()
        if other is not None:
            of_dataset = self._source.map(state.show, *self.axes, state.at).lines
            kept = {line.name for line in of_dataset if theory.holds(line.name, state.changed)}
            part.lines[:] = [line for line in of_dataset if line.name in kept]
            stale = [line for line in of_dataset if line.name not in kept]
        for name, source in self._lines.items():
            source.data = self._placed(line for line in part.lines if line.name == name)
        self._stale.data = self._placed(stale)
        boundaries = [line for line in part.lines if line.name == "boundary"]
        numbers = list(places.words(boundaries, part.x, part.y))
        self._numbers.data = {
            "x": [self._x.place(x) for x, _, _ in numbers],
            "y": [self._y.place(y) for _, y, _ in numbers],
            "count": [count for *_, count in numbers],
        }
        up, across = np.nonzero(part.marks["uncertain"])
        at = {"x": self._x.place(part.x.values[across]), "y": self._y.place(part.y.values[up])}
        self._uncertain.data_source.data = at
        self._uncertain.glyph.size = float(np.clip(120 / max(part.values.shape), 2.0, 6.0))
        unit = labels.unit(known, part.name) if part.name in known else ""
        self.figure.title.text = labels.with_unit(labels.words(known, part.name), unit)
        look = (part.name, unit, part.flags, scale.ticks, style.mapping(scale))
        if look != self._look:
            self._look = look
            document = self.figure.document
            # Bokeh looks through all models, in a third of a second, for each new one; frozen, it does so once.
            with document.models.freeze() if document else nullcontext():
                self._explain(part, scale, unit, mapper)
        return replace(part, notes=(*part.notes, STALE)) if stale else part, scale

    def _placed(self, lines: Iterable[Line]) -> dict[str, list[Any]]:
        """Return the parts of lines as columns for Bokeh."""
        parts = [points for line in lines for points in line.parts]
        return {"xs": [self._x.place(x) for x, _ in parts], "ys": [self._y.place(y) for _, y in parts]}

    def _explain(self, part: Map, scale: Scale, unit: str, mapper: Any) -> None:
        """Label the bar, the cuts and the tooltips for a scale."""
        for cut in self._cuts:
            words = (scale.ticks or {}) if part.flags else {}
            whole = 1 if part.values.dtype.kind in "iu" else 0
            ticker = models.BasicTicker(min_interval=whole, desired_num_ticks=4)
            if words:
                ticker = models.FixedTicker(ticks=list(words), minor_ticks=[])
            cut["plot"].yaxis.update(ticker=ticker, major_label_overrides=words)
        # A new bar, because an old one omits ticks beyond its first scale.
        self.figure.right = [_bar(unit, scale, mapper)]
        flags = {str(k): words for k, words in part.flags.items()}
        code = "return `${name}: ${words[value] ?? (Number.isFinite(value) ? sweep.number(value) : 'none')}`"
        # Words are part of the value, because Bokeh writes labels in a blue that is hard to read.
        self._hover.tooltips = [("", "@image{custom}")]
        known = {"words": flags, "name": self._source.words(part.name)}
        self._hover.formatters = {"@image": models.CustomJSHover(args=known, code=code)}


def _bar(unit: str, scale: Scale, mapper: Any) -> models.ColorBar:
    chosen_by_bokeh: Any = "auto" if style.is_logarithmic(scale) else models.BasicTicker()
    ticks = scale.ticks or {}
    return models.ColorBar(
        color_mapper=mapper,
        ticker=models.FixedTicker(ticks=list(ticks), minor_ticks=[]) if ticks else chosen_by_bokeh,
        title=unit or None, formatter=style.numbers(), major_label_overrides=ticks,
    )  # fmt: skip


def _line(plot: Any, name: str, dash: str, width: float) -> ColumnDataSource:
    """Add a line that is visible on every colour."""
    source = ColumnDataSource({"xs": [], "ys": []}, name=name)
    plot.multi_line("xs", "ys", source=source, color="white", width=2.5 * width)
    plot.multi_line("xs", "ys", source=source, color="black", width=width, dash=dash)
    return source


def _counts(plot: Any) -> ColumnDataSource:
    """The counts on the boundaries."""
    source = ColumnDataSource({"x": [], "y": [], "count": []}, name="numbers")
    plot.text("x", "y", "count", source=source, text_font_size="11px", text_align="center", text_baseline="middle",
              background_fill_color="white", border_radius=3, padding=2)  # fmt: skip
    return source


def _cursor(plot: Any) -> ColumnDataSource:
    """The outline of the chosen cell."""
    source = ColumnDataSource({key: [] for key in ("left", "right", "bottom", "top", "i", "j")}, name="cursor")
    for colour, width in (("black", 4), ("white", 2)):
        plot.quad(source=source, fill_color=None, line_color=colour, line_width=width)
    return source


def _pins(plot: Any) -> ColumnDataSource:
    """The cells whose trajectories are drawn, each with its number."""
    source = ColumnDataSource({key: [] for key in ("x", "y", "colour", "number", "ink", "alpha")}, name="pins")
    plot.scatter(
        "x", "y", source=source, size=17, fill_color="colour", line_color="white", line_width=1.5, alpha="alpha"
    )
    plot.text("x", "y", "number", source=source, text_color="ink", text_font_size="11px", text_font_style="bold",
              text_align="center", text_baseline="middle", alpha="alpha")  # fmt: skip
    return source


def _frame(source: Source, across: PlacedAxis, up: PlacedAxis) -> Any:
    """The empty figure, with axes that suit the spacing of the values."""
    x, y = (axis.place(description.ends(source.dataset, axis)) for axis in (across, up))
    plot = figure(
        height=HEIGHT if up.name else 240,
        sizing_mode="stretch_width", min_width=240,
        x_range=models.Range1d(*x, bounds=tuple(x)),
        y_range=models.Range1d(*y, bounds=tuple(y)),
        x_axis_type=style.kind(across),
        y_axis_type=style.kind(up),
        x_axis_label=source.label(across.name),
        y_axis_label=source.label(up.name) if up.name else None,
        tools="pan,box_zoom,wheel_zoom,reset,save", active_drag="box_zoom", toolbar_location="above",
        background_fill_color="#e8ebee",
    )  # fmt: skip
    plot.grid.visible = False
    style.style(plot, across, up)
    plot.title.update(text_font_size="14px", text_font_style="bold")
    plot.yaxis.visible = bool(up.name)
    return plot


def _cut(source: Source, axis: PlacedAxis, span: Any) -> dict[str, Any]:
    """Make the figure of a cut along an axis, with the data that `cut` of page.js needs to fill it."""
    plot = figure(
        height=_CUT_HEIGHT, min_width=220, sizing_mode="stretch_width", tools="", toolbar_location=None, x_range=span,
        y_range=models.Range1d(),  # set with the data: Bokeh warns of a range by data if all of them are missing
        x_axis_type=style.kind(axis), x_axis_label=source.label(axis.name), name=f"cut along {axis.name}", title=" ",
        outline_line_color=None,
    )  # fmt: skip
    data = ColumnDataSource({"at": [], "value": [], "here": []}, syncable=False)
    plot.step("at", "value", source=data, mode="center", color="#0072b2", line_width=1.5)
    plot.scatter("at", "here", source=data, color="#d55e00", size=8)
    style.style(plot, axis)
    plot.title.update(text_font_size="12px", text_font_style="normal")
    return {"plot": plot, "at": axis.place(axis.values), "values": axis.values, "symbol": labels.symbol(axis.name)}


def _connect(plot: Any, cells: ColumnDataSource, parts: dict[str, Any]) -> None:
    """Let the browser paint the patterns whenever the view changes, and answer pointer and clicks."""
    repaint = models.CustomJS(args={"map": parts}, code="sweep.use(map)")
    cells.js_on_change("data", repaint)
    for span in (plot.x_range, plot.y_range):
        span.js_on_change("start", repaint)
        span.js_on_change("end", repaint)
    for size in ("inner_width", "inner_height"):
        plot.js_on_change(size, repaint)
    plot.js_on_event("tap", models.CustomJS(code="sweep.tap(cb_obj)"))
    plot.js_on_event("mousemove", models.CustomJS(code="sweep.point(cb_obj)"))
    plot.js_on_event("mouseleave", models.CustomJS(code="sweep.point(null)"))
