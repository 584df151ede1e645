"""Colours of the explorer: those of a map's scale as Bokeh wants them, and those of curves."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.colors import BoundaryNorm, LogNorm, Normalize, to_hex

from sweep.explorer.state import State
from sweep.plots import scales
from sweep.plots.description import Map, common_scale
from sweep.plots.scales import SEQUENTIAL, Scale, colour_map

CURVES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#8a6d00")
"""Of Okabe and Ito: safe for the colour-blind."""

_MOST = 4096
"""Colours of a palette."""


def mapping(scale: Scale) -> dict[str, Any]:
    """List what a colour mapper of Bokeh has to be told: a colour for each integer of a scale of steps."""
    low, high = float(scale.norm.vmin or 0), float(scale.norm.vmax or 0)
    if isinstance(scale.norm, BoundaryNorm):
        first, last = math.ceil(low), math.floor(high)
        at = np.linspace(first, last, min(last - first + 1, _MOST)).round()
    else:
        at = np.asarray(scale.norm.inverse(np.linspace(0, 1, 256)))
    return {"palette": [to_hex(colour) for colour in scale.rgba(at)], "low": low, "high": high}


def scale_of(part: Map, state: State) -> Scale:
    """The scale of a map, with whatever of it the visitor has chosen; all values of flags have their colours."""
    palette = state.palette or None
    if part.flags:
        return scales.flags(part.flags, palette)
    shown = part.shown[np.isfinite(part.shown)].astype(float)
    if state.spacing == "log":
        shown = shown[shown > 0]
    if not shown.size:
        return common_scale([part], cmap=palette)
    low = shown.min() if state.low is None else state.low
    high = shown.max() if state.high is None else state.high
    given = (state.low, state.high) != (None, None) and low < high and (low > 0 or part.name != "ratio")
    scale = common_scale([part], (low, high) if given else None, palette)
    norm = {"linear": Normalize, "log": LogNorm}.get(state.spacing)
    if norm is None or not (low < high and (low > 0 or norm is Normalize)):
        return scale
    return replace(scale, norm=norm(low, high), ticks=None, colours=colour_map(palette or SEQUENTIAL))


def is_logarithmic(scale: Scale) -> bool:
    return isinstance(scale.norm, LogNorm)


def beyond(part: Map, scale: Scale) -> str:
    """Say in words what lies beyond the scale; empty if nothing does."""
    ends = {"min": ("down to", np.min), "max": ("up to", np.max)}
    there = (said for end, said in ends.items() if scale.arrows in (end, "both"))
    words = " and ".join(f"{said} {extreme(part.shown):.2g}" for said, extreme in there)
    return f"the last colours also stand for values {words}" if words else ""
