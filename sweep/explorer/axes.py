"""The axes of all figures of the explorer: their style, and what stands at their ticks."""

from __future__ import annotations

from typing import Any

from bokeh.models import CustomJSTickFormatter, FixedTicker

from sweep.explorer.slices import PlacedAxis

_TICKS = 12
"""On an axis whose values are listed one by one, at most."""

SOFT = "#77828d"
"""A grey that can be read on a light page and on a dark one."""

GRID = f"{SOFT}40"
"""The colour of lines across a figure."""

_STYLE = {
    "axis_line_color": SOFT, "major_tick_line_color": SOFT, "minor_tick_line_color": None,
    "axis_label_text_font_style": "normal", "axis_label_text_font_size": "12px", "major_label_text_font_size": "12px",
}  # fmt: skip


def style(plot: Any, *shown: PlacedAxis) -> None:
    """Give the axes of a figure their style; of those that are `shown`, uneven values are listed one by one."""
    for drawn in plot.axis:
        drawn.update(formatter=numbers(), **_STYLE)
    for axis, drawn in zip(shown, (plot.xaxis[0], plot.yaxis[0]), strict=False):
        if axis.spacing == "uneven":
            ticks = [float(t) for t in range(0, len(axis.values), -(-len(axis.values) // _TICKS))]
            drawn.ticker = FixedTicker(ticks=ticks, minor_ticks=[])
            code = "return sweep.number(values[tick])"
            drawn.formatter = CustomJSTickFormatter(args={"values": axis.values}, code=code)


def numbers() -> CustomJSTickFormatter:
    """Write the numbers on an axis as pictures do."""
    return CustomJSTickFormatter(code="return sweep.number(tick)")


def kind(axis: PlacedAxis) -> Any:
    """What Bokeh calls an axis of such values."""
    return "log" if axis.spacing == "log" else "linear"
