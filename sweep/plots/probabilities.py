"""How probable each number of reversals is: bars of one scene, or curves over one axis, with their intervals."""

from __future__ import annotations

from itertools import pairwise

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from sweep.grid import Array
from sweep.plots.figure import Frames, set_scale
from sweep.plots.panels import Panels, title
from sweep.results.probabilities import interval, sound

_COLOURS = 0.85
"""Part of the colour map that curves take: its last colours are too light for lines."""


def draw(panels: Panels, frames: Frames) -> list[Artist]:
    """Draw the probabilities over the one long axis, or those of each panel; returns entries for a legend."""
    for axes, chosen in frames:
        if panels.across:
            _curves(axes, chosen, panels.across[0])
        else:
            _bars(axes, chosen)
        axes.set_ylim(0, 1.02)
        axes.grid(alpha=0.3)
    return frames[0][0].get_legend_handles_labels()[0]


def _curves(axes: Axes, chosen: xr.Dataset, x: str) -> None:
    """Draw the probability of each count or more, with its interval as a band."""
    counts = chosen["count"].values
    colours = mpl.colormaps["viridis"](_COLOURS * np.arange(len(counts)) / max(len(counts) - 1, 3))
    at = chosen[x].values
    set_scale(axes, "x", at)
    for count, colour in zip(counts, colours, strict=True):
        one = chosen.sel(count=count)
        axes.plot(at, one["probability"], color=colour, linewidth=1.2, label=title(chosen, {"count": count - 1}))
        axes.fill_between(at, one["probability_low"], one["probability_high"], color=colour, alpha=0.25, linewidth=0)
    axes.set_ylabel("probability, with its interval of 95 %")


def _bars(axes: Axes, chosen: xr.Dataset) -> None:
    """Draw the probability of each count, with its interval."""
    at_least = np.concatenate([[1.0], chosen["probability"].values, [0.0]])
    share: Array = np.array([more - still for more, still in pairwise(at_least)])
    low, high = interval(share, np.asarray(sound(chosen).sum()))
    axes.bar(np.arange(len(share)), share, color="C0", label="share of the samples", zorder=2)
    axes.errorbar(
        np.arange(len(share)), share, yerr=[share - low, high - share],
        fmt="none", ecolor="black", elinewidth=1, capsize=3, label="interval of 95 %", zorder=3,
    )  # fmt: skip
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("spin reversals")
    axes.set_ylabel("probability")
