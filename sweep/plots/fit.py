"""A film beside the trajectory that fits it, and what is left between them."""

from __future__ import annotations

import xarray as xr
from matplotlib.figure import Figure

from sweep.plots import labels
from sweep.plots.figure import Picture


def draw(dataset: xr.Dataset) -> Figure:
    """The film and the fit over time, below them the residuals, and beside them the values with their intervals."""
    figure = Picture(11, 6)
    figure.suptitle(dataset.attrs["title"], fontsize=10)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=[3, 1])
    time, seen, fitted = (dataset[name].values for name in ("time", "seen", "fitted"))
    above.plot(time, seen, ".", color="0.6", markersize=3, label="film", gid="seen")
    above.plot(time, fitted, color="C0", linewidth=1, label="fit", gid="fitted")
    above.axhline(0, color="black", linewidth=0.5)
    above.set_ylabel(labels.label(dataset, "seen"), fontsize=9)
    below.plot(time, seen - fitted, ".", color="0.4", markersize=2, gid="residuals")
    below.axhline(0, color="black", linewidth=0.5)
    below.set_ylabel("film - fit", fontsize=9)
    below.set_xlabel(labels.label(dataset, "time"), fontsize=9)
    for axes in (above, below):
        axes.tick_params(labelsize=8)
    above.legend(title="\n".join(_values(dataset)), fontsize=8, title_fontsize=8, loc="center left",
                 bbox_to_anchor=(1.01, 0.5), frameon=False, alignment="left")  # fmt: skip
    return figure


def _values(dataset: xr.Dataset) -> list[str]:
    """A line for each parameter: its value, and its interval of 95 %."""
    lines = []
    for name in dataset["parameter"].values:
        one = dataset.sel(parameter=name)
        value, low, high = (one[each].item() for each in ("value", "lower_95", "upper_95"))
        lines.append(f"{name} = {value:.4g}  ({low:.4g} … {high:.4g})")
    return [*lines, "in brackets: intervals of 95 %", ""]
