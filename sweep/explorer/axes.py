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


def style(plot: Any) -> None:
    """Give the axes of a figure their style."""
    for axis in plot.axis:
        axis.update(formatter=numbers(), **_STYLE)


def numbers() -> CustomJSTickFormatter:
    """Write the numbers on an axis as pictures do."""
    return CustomJSTickFormatter(code="return sweep.number(tick)")


def kind(axis: PlacedAxis) -> Any:
    """What Bokeh calls an axis of such values."""
    return "log" if axis.spacing == "log" else "linear"


def place_ticks(axis: PlacedAxis, drawn: Any) -> None:
    """List the values of an axis that are not evenly spaced."""
    if axis.spacing == "uneven":
        ticks = [float(t) for t in range(0, len(axis.values), -(-len(axis.values) // _TICKS))]
        drawn.ticker = FixedTicker(ticks=ticks, minor_ticks=[])
        drawn.formatter = CustomJSTickFormatter(args={"values": axis.values}, code="return sweep.number(values[tick])")
