"""The style of the explorer's figures: axes, colours of maps and curves, and patterns over cells.

Patterns are tiles of pixels, which the browser draws over cells without a plain result.
"""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from bokeh.models import CustomJSTickFormatter, FixedTicker
from matplotlib.colors import BoundaryNorm, LogNorm, to_hex
from matplotlib.image import imsave

from sweep.explorer.slices import PlacedAxis
from sweep.explorer.state import State
from sweep.grid import Array
from sweep.plots import marks, scales
from sweep.plots.description import Map
from sweep.plots.description import scale_of as scale_of_values
from sweep.plots.pictures import of
from sweep.plots.scales import AUTO, Scale

SOFT = "#77828d"
"""A grey for lines on a light page and on a dark one; letters need more contrast."""

GRID = f"{SOFT}40"
"""The colour of lines across a figure."""

CURVES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#8a6d00")
"""Colours of curves, from Okabe and Ito: safe for the colour-blind."""

DARK = ("#0072b2", "#8a6d00")
"""Those on which white letters can be read; on the others, black ones can."""

_TICKS = 12
"""Largest number of ticks of an axis whose values are listed one by one."""

_MOST = 4096
"""Colours of a palette."""

_WHITE, _BLACK, _DARK, _LIGHT = 0xC8FFFFFF, 0x90000000, 0xFF474340, 0xFFA8A39E  # ABGR; 0 is transparent

_EXAMPLE = "#21918c"
"""A colour of a map under a transparent pattern."""


# ---- axes


def style(plot: Any, *shown: PlacedAxis) -> None:
    """Give the axes of a figure their style; uneven values of the axes `shown` are listed one by one."""
    for drawn in plot.axis:
        drawn.formatter = numbers()
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
    """Return Bokeh's name for the type of an axis."""
    return "log" if axis.spacing == "log" else "linear"


# ---- colours


def mapping(scale: Scale) -> dict[str, Any]:
    """The settings of Bokeh's colour mapper for a scale: a colour for each integer of a scale of steps."""
    low, high = float(scale.norm.vmin or 0), float(scale.norm.vmax or 0)
    if isinstance(scale.norm, BoundaryNorm):
        first, last = math.ceil(low), math.floor(high)
        at = np.linspace(first, last, min(last - first + 1, _MOST)).round()
    else:
        at = np.asarray(scale.norm.inverse(np.linspace(0, 1, 256)))
    return {"palette": [to_hex(colour) for colour in scale.rgba(at)], "low": low, "high": high}


def scale_of(part: Map, state: State, known: Array) -> Scale:
    """The scale of a map, with the visitor's choices: of all flags, or of the `known` values unless it is rescaled."""
    palette = state.palette or None
    if part.flags:
        return scales.flags(part.flags, palette)
    values = part.shown if state.scale else np.concatenate([part.shown, known])
    shown = values[np.isfinite(values)].astype(float)
    if not state.limits or not shown.size:
        return scale_of_values(part, values, cmap=palette)
    low, high = state.limits.get("low", shown.min()), state.limits.get("high", shown.max())
    possible = low < high and (low > 0 or of(part.name).scale != "ratios")
    return scale_of_values(part, values, (low, high) if possible else AUTO, palette)


def is_logarithmic(scale: Scale) -> bool:
    return isinstance(scale.norm, LogNorm)


def beyond(part: Map, scale: Scale) -> str:
    """Return a note on values beyond the scale; empty if there are none."""
    ends = {"min": ("down to", np.min), "max": ("up to", np.max)}
    there = (said for end, said in ends.items() if scale.arrows in (end, "both"))
    words = " and ".join(f"{said} {extreme(part.shown):.2g}" for said, extreme in there)
    return f"the last colours also stand for values {words}" if words else ""


# ---- patterns


def _tile(side: int, colour: Callable[[Array, Array], Array]) -> Array:
    """The colours of a tile by x and y; its first row is the lowest, as in the browser."""
    y, x = np.indices((side, side))
    return np.ascontiguousarray(np.broadcast_to(colour(x, y), (side, side)).astype("uint32"))


def _lines(across: Array) -> Array:
    """White lines next to black ones, where the distance from the lines is 0 and 1."""
    return np.select([across == 0, across == 1], [_WHITE, _BLACK], 0)


TILES = {
    "not_run": _tile(1, lambda x, _: 0 * x + _LIGHT),
    "failed": _tile(10, lambda x, y: np.where(((x + y) % 10 == 0) | (x == y), _LIGHT, _DARK)),
    "impossible": _tile(6, lambda _, y: np.where(y == 0, _DARK, _LIGHT)),
    "no_value": _tile(1, lambda x, _: 0 * x + _LIGHT),
    "time_limit": _tile(10, lambda x, y: _lines((x + y) % 10)),
    "round_off": _tile(8, lambda _, y: _lines(y)),
}
assert [*TILES, "uncertain"] == list(marks.WORDS)  # drawn as a dot


def line(dash: str, width: float) -> str:
    """The CSS of a line in a legend, whose dash is that of Bokeh."""
    drawn, period = {"dashed": (6, 12), "dotted": (2, 6)}.get(dash, (1, 1))
    dashes = f"repeating-linear-gradient(90deg,currentColor 0 {drawn}px,transparent {drawn}px {period}px)"
    return f"background:{dashes};height:{2 * width}px"


def swatch(kind: str) -> str:
    """The CSS of a kind in a legend."""
    if kind == "uncertain":
        return "background:#fff;border:1px solid #000;border-radius:50%;height:5px;margin:0 9px;width:5px"
    file = io.BytesIO()
    imsave(file, TILES[kind][::-1].view("uint8").reshape(*TILES[kind].shape, 4), format="png")
    picture = f"url(data:image/png;base64,{base64.b64encode(file.getvalue()).decode()})"
    return f"height:14px;border:1px solid #8a949e;border-radius:2px;background:{picture} {_EXAMPLE}"
