"""Axes of figures: logarithmic where their values are, with plain numbers at the ticks."""

from __future__ import annotations

from typing import Literal

from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullFormatter

from sweep.grid import Array
from sweep.plots import labels
from sweep.plots.panels import is_logarithmic


def set_scale(axes: Axes, which: Literal["x", "y"], values: Array) -> None:
    """Make an axis logarithmic if its values, in increasing order, have equal ratios."""
    if not is_logarithmic(values):
        return
    axes.set(**{f"{which}scale": "log"})
    axis = axes.xaxis if which == "x" else axes.yaxis
    between = (1, 2, 5) if values[-1] < 1000 * values[0] else (1,)
    axis.set_major_locator(LogLocator(subs=between))
    axis.set_major_formatter(lambda at, _: labels.number(at))
    axis.set_minor_formatter(NullFormatter())
