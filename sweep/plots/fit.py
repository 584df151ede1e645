"""A film beside the trajectory that fits it, and what is left between them."""

from __future__ import annotations

import xarray as xr
from matplotlib.figure import Figure

from sweep.plots import labels
from sweep.plots.figure import Picture


def draw(dataset: xr.Dataset) -> Figure:
    """The film and the fit, or those of several laws, over time; below the residuals, beside the values or weights."""
    figure = Picture(11, 6)
    figure.suptitle(dataset.attrs["title"], fontsize=10)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=[3, 1])
    time, seen = dataset["time"].values, dataset["seen"].values
    above.plot(time, seen, ".", color="0.6", markersize=3, label="film", gid="seen")
    laws = [(str(name), dataset.sel(law=name)) for name in dataset["law"].values] if "law" in dataset.dims else []
    for i, (name, one) in enumerate(laws or [("fit", dataset)]):
        fitted, colour = one["fitted"].values, f"C{i}" if laws else "0.4"
        above.plot(time, fitted, color=f"C{i}", linewidth=1, label=name, gid=f"fitted {name}")
        below.plot(time, seen - fitted, ".", color=colour, markersize=2, gid=f"residuals {name}")
    above.axhline(0, color="black", linewidth=0.5)
    above.set_ylabel(labels.label(dataset, "seen"), fontsize=9)
    below.axhline(0, color="black", linewidth=0.5)
    below.set_ylabel("film - fit", fontsize=9)
    below.set_xlabel(labels.label(dataset, "time"), fontsize=9)
    for axes in (above, below):
        axes.tick_params(labelsize=8)
    words = [_of_law(name, one) for name, one in laws] or _values(dataset)
    above.legend(title="\n".join(words), fontsize=8, title_fontsize=8, loc="center left",
                 bbox_to_anchor=(1.01, 0.5), frameon=False, alignment="left")  # fmt: skip
    return figure


def _of_law(name: str, dataset: xr.Dataset) -> str:
    """A line on a law: how well it fits."""
    return f"{name}: χ² = {dataset['chi_square'].item():.5g}, weight {dataset['weight'].item():.2g}"


def _values(dataset: xr.Dataset) -> list[str]:
    """A line for each parameter: its value, and its interval of 95 %."""
    lines = []
    for name in dataset["parameter"].values:
        one = dataset.sel(parameter=name)
        value, low, high = (one[each].item() for each in ("value", "lower_95", "upper_95"))
        lines.append(f"{name} = {value:.4g}  ({low:.4g} … {high:.4g})")
    return [*lines, "in brackets: intervals of 95 %", ""]
