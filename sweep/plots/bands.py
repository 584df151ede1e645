"""Series of many samples of one scene, as their median and the bands in which most of them lie."""

from __future__ import annotations

import warnings

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from sweep.grid import SAMPLE
from sweep.plots import labels
from sweep.results.kind import parameters

_BANDS = {0.95: 0.18, 0.68: 0.35}
"""Shares of the samples that the bands hold, the widest first, and the opacities of these."""


def draw(axes: Axes, dataset: xr.Dataset, name: str) -> list[Artist]:
    """Draw a series of sampled trajectories; returns the entries for the legend."""
    samples, time = int(dataset[SAMPLE].max()) + 1, dataset["time"]
    entries: list[Artist] = []
    for i in range(dataset.sizes["trajectory"] // samples):
        one = dataset.isel(trajectory=slice(i * samples, (i + 1) * samples))
        tails = [(1 - share) / 2 for share in _BANDS]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # no sample goes on so long
            median, *ends = np.nanquantile(one[name], [0.5, *tails, *(1 - tail for tail in tails)], axis=0)
        axes.plot(time, median, color=f"C{i}", linewidth=0.9, gid=name)
        for low, high, opacity in zip(ends[:2], ends[2:], _BANDS.values(), strict=True):
            axes.fill_between(time, low, high, color=f"C{i}", alpha=opacity, linewidth=0, rasterized=time.size > 5000)
        entries.append(Line2D([], [], color=f"C{i}", label=_label(dataset, one)))
    held = [Patch(color="0.4", alpha=opacity, label=f"{share:.0%} of them") for share, opacity in _BANDS.items()]
    return entries + held


def _label(dataset: xr.Dataset, one: xr.Dataset) -> str:
    """What the samples of one cell have in common and not with all others, and how many there are."""
    own = [
        labels.measured(dataset, name, float(one[name][0]))
        for name in parameters(dataset)
        if dataset[name].dims and len(np.unique(one[name])) == 1 < len(np.unique(dataset[name]))
    ]
    return ", ".join([*own, f"median of {one.sizes['trajectory']} samples"])
