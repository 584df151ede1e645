"""Probabilities of reversal counts: bars for one scene or curves over one axis, with their intervals."""

from __future__ import annotations

from itertools import pairwise

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from sweep.grid import Array
from sweep.plots import labels
from sweep.plots.figure import Frames, set_scale, write_words
from sweep.plots.panels import Panels, title
from sweep.plots.scales import Limits
from sweep.results.probabilities import interval, sound

_COLOURS = 0.85
"""Part of the colour map used for curves: its last colours are too light for lines."""


def draw(panels: Panels, frames: Frames, limits: Limits | None = None) -> list[Artist]:
    """Draw the probabilities over the one long axis, or over counts; returns entries for a legend."""
    for axes, chosen in frames:
        if panels.across in ([], ["count"]):
            _bars(axes, chosen, lowest=len(frames) == 1 or bool(axes.get_xlabel()))
        else:
            _curves(axes, chosen, panels.across[0])
        if chosen["probability"].isnull().all():
            write_words(axes, "all samples failed" if "status" in chosen else "no probability is known")
        axes.set_ylim(limits or (0, 1.02))
        axes.grid(alpha=0.3)
    shown = [axes for axes, chosen in frames if chosen["probability"].notnull().any()]
    return shown[0].get_legend_handles_labels()[0] if shown else []


def _curves(axes: Axes, chosen: xr.Dataset, x: str) -> None:
    """Draw the probability of each count or more, or of a chosen one, with its interval as a band."""
    each = chosen if "count" in chosen.dims else chosen.expand_dims("count")
    counts = each.sizes["count"]
    colours = mpl.colormaps["viridis"](_COLOURS * np.arange(counts) / max(counts - 1, 3))
    at = chosen[x].values
    set_scale(axes, "x", at)
    axes.update_datalim([(value, 0.0) for value in at])  # also where all samples failed
    known = {"probability_low", "probability_high"} <= each.data_vars.keys()
    for i, colour in enumerate(colours):
        one = each.isel(count=i)
        axes.plot(at, one["probability"], ".-", color=colour, linewidth=1.2, label=title(each, {"count": i}))
        if known:
            ends = one["probability_low"], one["probability_high"]
            axes.fill_between(at, *ends, color=colour, alpha=0.25, linewidth=0)
            axes.vlines(at, *ends, color=colour, linewidth=0.6)  # a point between failures has no band
    axes.set_ylabel("probability, with its interval of 95 %" if known else "probability")


def _bars(axes: Axes, chosen: xr.Dataset, *, lowest: bool) -> None:
    """Draw the probability of each count, or of at least a chosen count and of fewer, with its interval."""
    at_least = np.concatenate([[1.0], np.atleast_1d(chosen["probability"]), [0.0]])
    share: Array = np.array([more - still for more, still in pairwise(at_least)])
    axes.bar(np.arange(len(share)), share, color="C0", label="share of the samples", zorder=2)
    axes.set_xlim(-0.6, len(share) - 0.4)
    if "status" in chosen and labels.is_code(chosen["status"]):  # otherwise the number of samples is unknown
        low, high = interval(share, np.asarray(sound(chosen).sum()))
        axes.errorbar(
            np.arange(len(share)), share, yerr=[share - low, high - share],
            fmt="none", ecolor="black", elinewidth=1, capsize=3, label="interval of 95 %", zorder=3,
        )  # fmt: skip
    if "count" in chosen.dims:
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_xlabel("spin reversals" if lowest else "")
    else:
        axes.set_xticks([0, 1], labels=["fewer", labels.measured(chosen, "count", float(chosen["count"]))])
    axes.set_ylabel("probability")
