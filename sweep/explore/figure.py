"""The map of a slice as a Bokeh figure: one image, patterns that the browser draws over it, and hover by index.

There is no glyph per cell: an image and a table of bits are sent as binary arrays, so that a million cells stay fluid.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from bokeh.models import (
    BasicTicker,
    ColorBar,
    ColumnDataSource,
    CustomJS,
    CustomJSHover,
    FixedTicker,
    HoverTool,
    Range1d,
)  # fmt: skip
from bokeh.plotting import figure

from sweep.explore.colours import Scale, scale
from sweep.explore.slices import DIFFERENCE, Axis, Slice, Source, plain
from sweep.plots import labels, marks

HEIGHT = 480
"""Of the map, in pixels."""

_SHORT = {"reversals": "simulated", "reversals_predicted": "predicted", DIFFERENCE: "difference", "status": "end"}
"""What these are called under the pointer, where the table must not hide the map."""

_TICKS = 12
"""On an axis whose values are listed one by one, at most."""

_STYLE = {
    "axis_line_color": "#8a949e", "major_tick_line_color": "#8a949e", "minor_tick_line_color": None,
    "axis_label_text_font_style": "normal", "axis_label_text_font_size": "13px", "major_label_text_font_size": "12px",
}  # fmt: skip


@dataclass(frozen=True)
class Map:
    """A map and the parts of it that change without a new figure."""

    figure: Any
    cursor: ColumnDataSource
    """The outline of the chosen cell."""
    pins: ColumnDataSource
    """The cells whose trajectories are drawn."""
    scale: Scale


def draw(
    source: Source, part: Slice, columns: Mapping[str, Any], *,
    probe: ColumnDataSource | None = None, request: ColumnDataSource | None = None,
) -> Map:  # fmt: skip
    """The map of a slice.

    Parameters
    ----------
    columns : what the pointer shows of a cell beside its place: tables of shape (y, x) by their variables
    probe, request : where the browser writes which cell is under the pointer, and which one is to be run; None on a
        page without a server
    """
    colours = scale(part)
    plot = _frame(source, part)
    x, y = part.x.edges, part.y.edges
    place = {"x": [x[0]], "y": [y[0]], "dw": [x[-1] - x[0]], "dh": [y[-1] - y[0]]}
    tables = {name: [plain(table)] for name, table in columns.items()}
    data = ColumnDataSource({"image": [plain(part.values)], **place, **tables}, name="cells")
    image = plot.image(image="image", x="x", y="y", dw="dw", dh="dh", source=data, color_mapper=colours.mapper)
    overlay = ColumnDataSource({"image": [np.zeros((2, 2), "uint32")], **place}, syncable=False)
    plot.image_rgba(image="image", x="x", y="y", dw="dw", dh="dh", source=overlay)
    cursor = ColumnDataSource({key: [] for key in ("left", "right", "bottom", "top", "i", "j")}, name="cursor")
    for colour, width in (("black", 4), ("white", 2)):
        plot.quad(source=cursor, fill_color=None, line_color=colour, line_width=width)
    pins = ColumnDataSource({key: [] for key in ("x", "y", "colour", "number", "alpha")}, name="pins")
    plot.scatter("x", "y", source=pins, size=17, fill_color="colour", line_color="white", line_width=1.5, alpha="alpha")
    plot.text("x", "y", "number", source=pins, text_color="white", text_font_size="11px", text_font_style="bold",
              text_align="center", text_baseline="middle", alpha="alpha")  # fmt: skip
    plot.add_tools(_hover(source, part, image, list(columns)))
    plot.add_layout(_bar(source, part, colours), "right")
    kinds = ColumnDataSource({"kinds": [part.kinds]}, name="kinds")
    _connect(plot, {"figure": plot, "kinds": kinds, "names": list(marks.WORDS), "overlay": overlay, "ex": x, "ey": y,
                    "cursor": cursor, "probe": probe, "request": request})  # fmt: skip
    return Map(plot, cursor, pins, colours)


def _frame(source: Source, part: Slice) -> Any:
    """The empty figure, with axes that suit the spacing of the values."""
    x, y = part.x.edges, part.y.edges
    plot = figure(
        height=HEIGHT if part.y.name else 240,
        sizing_mode="stretch_width", min_width=240,
        x_range=Range1d(x[0], x[-1], bounds=(x[0], x[-1])),
        y_range=Range1d(y[0], y[-1], bounds=(y[0], y[-1])),
        x_axis_type="log" if part.x.spacing == "log" else "linear",
        y_axis_type="log" if part.y.spacing == "log" else "linear",
        x_axis_label=source.label(part.x.name),
        y_axis_label=source.label(part.y.name) if part.y.name else None,
        tools="pan,box_zoom,wheel_zoom,reset,save", active_drag="box_zoom", toolbar_location="above",
        background_fill_color="#e8ebee", name="map figure",
    )  # fmt: skip
    plot.toolbar.logo = None
    plot.grid.visible = False
    for axis in plot.axis:
        axis.update(**_STYLE)
    plot.title.update(text=source.label(part.name), text_font_size="14px", text_font_style="bold")
    plot.yaxis.visible = bool(part.y.name)
    for axis, drawn in ((part.x, plot.xaxis[0]), (part.y, plot.yaxis[0])):
        if axis.spacing == "list":
            _list_ticks(axis, drawn)
    return plot


def _list_ticks(axis: Axis, drawn: Any) -> None:
    ticks = [float(t) for t in range(0, len(axis.values), -(-len(axis.values) // _TICKS))]
    drawn.ticker = FixedTicker(ticks=ticks, minor_ticks=[])
    drawn.major_label_overrides = {t: f"{axis.values[int(t)]:g}" for t in ticks}


def _bar(source: Source, part: Slice, colours: Scale) -> ColorBar:
    bar = ColorBar(
        color_mapper=colours.mapper, ticker=colours.ticker or BasicTicker(), width=14, padding=6,
        border_line_color=None,
        major_label_overrides=colours.words, major_tick_line_color="#1b2733", bar_line_color="#8a949e",
        major_label_text_font_size="12px", background_fill_color=None,
    )  # fmt: skip
    if part.name in part.dataset and (unit := labels.unit(source.dataset, part.name)):
        bar.update(title=unit, title_text_font_style="normal")
    return bar


def _hover(source: Source, part: Slice, image: Any, columns: list[str]) -> HoverTool:
    """A table of the cell under the pointer; the numbers are looked up by its index."""
    rows, formatters = [], dict[str, Any]()
    for axis, variable, index in ((part.x, "$x", "i"), (part.y, "$y", "j")):
        if axis.name:
            rows.append((labels.symbol(axis.name), f"{variable}{{custom}}"))
            code = f"return Number(values[special_vars.image_index.{index}].toPrecision(6)).toString()"
            formatters[variable] = CustomJSHover(args={"values": axis.values}, code=code)
    for name in columns:
        rows.append((_SHORT.get(name) or source.words(name), f"@{{{name}}}{{custom}}"))
        flags = {} if name == DIFFERENCE else labels.flag_words(source.dataset, name)
        code = "return words[value] ?? (Number.isFinite(value) ? Number(value.toPrecision(6)).toString() : 'none')"
        formatters[f"@{{{name}}}"] = CustomJSHover(args={"words": {str(k): w for k, w in flags.items()}}, code=code)
    table = "".join(
        f'<tr><td style="color:#5b6875;padding-right:10px">{_escaped(words)}</td><td><b>{value}</b></td></tr>'
        for words, value in rows
    )
    html = f'<table style="font-size:12px">{table}</table>'
    return HoverTool(renderers=[image], tooltips=html, formatters=formatters, point_policy="follow_mouse")


def _escaped(text: str) -> str:
    """Text for a tooltip: neither markup nor one of Bokeh's placeholders."""
    for character, entity in (("&", "&amp;"), ("<", "&lt;"), ("@", "&#64;"), ("$", "&#36;"), ("{", "&#123;")):
        text = text.replace(character, entity)
    return text


def _connect(plot: Any, models: dict[str, Any]) -> None:
    """Let the browser paint the patterns whenever the view changes, and answer pointer and clicks."""
    repaint = CustomJS(args={"map": models}, code="sweep.use(map)")
    for span in (plot.x_range, plot.y_range):
        span.js_on_change("start", repaint)
        span.js_on_change("end", repaint)
    for size in ("inner_width", "inner_height"):
        plot.js_on_change(size, repaint)
    plot.js_on_event("tap", CustomJS(code="sweep.tap(cb_obj)"))
    plot.js_on_event("mousemove", CustomJS(code="sweep.point(cb_obj)"))
    plot.js_on_event("mouseleave", CustomJS(code="sweep.point(null)"))
