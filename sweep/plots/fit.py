"""A film, the trajectory that fits it, and their residuals."""

from __future__ import annotations

import textwrap
from numbers import Real
from typing import Any

import numpy as np
import xarray as xr

from sweep.plots import labels
from sweep.plots.figure import Picture, page, panel_width, zero_line
from sweep.results.summary import bound, verdict

_VALUES = 3.2
"""Inches that the values take across."""

_LETTERS = 13
"""Letters of the verdict in an inch."""


def draw(dataset: xr.Dataset) -> Picture:
    """Draw the film and the fit, or the fits of several laws, over time, with the residuals below.

    The title gives the verdict; outliers are crossed out, and a band shows the noise of the residuals.
    """
    width = panel_width(1, 11, 0)
    lines = [line for each in verdict(dataset) for line in textwrap.wrap(each, int(_LETTERS * width))]
    figure = Picture(width, 6 + 0.15 * len(lines))
    figure.head(dataset.attrs.get("title", ""), "")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=[2, 1])
    above.set_title("\n".join(lines), loc="left", fontsize="small")
    time, seen = dataset["time"].values, dataset["seen"].values
    out = dataset["outlier"].values.reshape(-1, len(time))[0] if "outlier" in dataset else np.zeros(len(time), bool)
    above.plot(time, seen, ".", color="0.6", markersize=3, label="film", gid="seen")
    laws = [(str(name), dataset.sel(law=name)) for name in dataset["law"].values] if "law" in dataset.dims else []
    for i, (name, one) in enumerate(laws or [("fit", dataset)]):
        fitted, colour = one["fitted"].values, f"C{i}" if laws else "0.4"
        above.plot(time, fitted, color=f"C{i}", linewidth=1, label=name, gid=f"fitted {name}")
        left = np.where(out, np.nan, seen - fitted)
        below.plot(time, left, ".", color=colour, markersize=2, gid=f"residuals {name}")
    if isinstance(noise := dataset.attrs.get("noise"), Real):
        below.axhspan(-2 * float(noise), 2 * float(noise), color="0.9", zorder=0, gid="noise")
    low, high = np.nanpercentile(seen[~out], [0, 100])
    if out.any() and high > low:
        above.set_ylim(low - 0.1 * (high - low), high + 0.1 * (high - low))
    at = np.clip(seen[out], *above.get_ylim())  # an outlier beyond the axis is marked at its end
    above.plot(time[out], at, "x", color="C3", markersize=5, clip_on=False, gid="outliers",
               label="outlier" if out.any() else None)  # fmt: skip
    zero_line(above)
    above.set_ylabel(labels.label(dataset, "seen"))
    zero_line(below)
    below.set_ylabel("film − fit")
    below.set_xlabel(labels.label(dataset, "time"))
    words = [_of_law(name, one) for name, one in laws] or _values(dataset)
    where: Any = "outside right center" if page() > 2 * _VALUES else "outside lower center"
    entries = [line for line in above.get_lines() if not str(line.get_label()).startswith("_")]
    figure.legend(handles=entries, title="\n".join(words), loc=where, frameon=False, alignment="left")
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
        lines.append(f"{name}: {words}" if (words := bound(one)) else f"{name} = {value:.4g}  ({low:.4g} … {high:.4g})")
    return [*lines, "in brackets: intervals of 95 %", ""]
