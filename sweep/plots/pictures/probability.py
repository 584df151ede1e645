"""The probability of each number of reversals, as bars over counts or as curves over one axis."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import xarray as xr

from sweep.grid import Array
from sweep.plots import labels
from sweep.plots.pictures.record import Picture
from sweep.results.probabilities import interval, sound

_COLOURS = 0.85
"""Part of the colour map used for curves: its last colours are too light for lines."""


def _draw(axes: Any, chosen: xr.Dataset, x: str) -> None:
    """Draw curves over an axis of the dataset, and bars over counts."""
    if x in ("", "count"):
        _bars(axes, chosen)
    else:
        _curves(axes, chosen, x)
    axes.set_ylim(0, 1.02)
    axes.grid(alpha=0.3)


def _curves(axes: Any, chosen: xr.Dataset, x: str) -> None:
    """Draw the probability of each count or more, or of a chosen one, with its interval as a band."""
    from matplotlib import colormaps  # which configurations do without

    each = chosen if "count" in chosen.dims else chosen.expand_dims("count")
    counts = each["count"].values
    colours = colormaps["viridis"](_COLOURS * np.arange(len(counts)) / max(len(counts) - 1, 3))
    at = chosen[x].values
    axes.update_datalim([(value, 0.0) for value in at])  # also where all samples failed
    known = {"probability_low", "probability_high"} <= each.data_vars.keys()
    for i, (count, colour) in enumerate(zip(counts, colours, strict=True)):
        one, words = each.isel(count=i), labels.measured(each, "count", float(count))
        axes.plot(at, one["probability"], ".-", color=colour, linewidth=1.2, label=words)
        if known:
            ends = one["probability_low"], one["probability_high"]
            axes.fill_between(at, *ends, color=colour, alpha=0.25, linewidth=0)
            axes.vlines(at, *ends, color=colour, linewidth=0.6)  # a point between failures has no band
    axes.set_ylabel("probability, with its interval of 95 %" if known else "probability")


def _bars(axes: Any, chosen: xr.Dataset) -> None:
    """Draw the probability of each count, or of at least a chosen count and of fewer, with its interval."""
    at_least = np.concatenate([[1.0], np.atleast_1d(chosen["probability"]), [0.0]])
    share: Array = np.array([more - still for more, still in pairwise(at_least)])
    places = np.arange(len(share))
    axes.bar(places, share, color="C0", label="share of the samples", zorder=2)
    axes.set_xlim(-0.6, len(share) - 0.4)
    if "status" in chosen and labels.is_code(chosen["status"]):  # otherwise the number of samples is unknown
        low, high = interval(share, np.asarray(sound(chosen).sum()))
        axes.errorbar(
            places, share, yerr=[share - low, high - share],
            fmt="none", ecolor="black", elinewidth=1, capsize=3, label="interval of 95 %", zorder=3,
        )  # fmt: skip
    if "count" in chosen.dims:
        axes.xaxis.get_major_locator().set_params(integer=True)
        lowest = axes.xaxis.get_tick_params().get("labelbottom", True)
        axes.set_xlabel("spin reversals" if lowest else "")
    else:
        axes.set_xticks([0, 1], labels=["fewer", labels.measured(chosen, "count", float(chosen["count"]))])
    axes.set_ylabel("probability")


PICTURES = (Picture("probability", together=("count",), draw=_draw, words={"no_value": "all samples failed"}, rank=5),)
