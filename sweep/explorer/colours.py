"""Colours of the explorer: those of a map's scale as Bokeh wants them, and those of curves."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.colors import BoundaryNorm, LogNorm, to_hex

from sweep.plots.description import Map
from sweep.plots.scales import Scale

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


def is_logarithmic(scale: Scale) -> bool:
    return isinstance(scale.norm, LogNorm)


def beyond(part: Map, scale: Scale) -> str:
    """Say in words what lies beyond the scale; empty if nothing does."""
    ends = {"min": f"down to {part.shown.min():.2g}", "max": f"up to {part.shown.max():.2g}"}
    words = " and ".join(said for end, said in ends.items() if scale.arrows in (end, "both"))
    return f"the last colours also stand for values {words}" if words else ""
