"""A film, the trajectory that fits it, and their residuals."""

from __future__ import annotations

import textwrap
from numbers import Real
from typing import Any

import numpy as np
import xarray as xr

from sweep.plots import labels
from sweep.plots.figure import Sheet, is_column, page, panel_width, zero_line
from sweep.results.summary import bound, verdict

_VALUES = 3.2
"""Width of the values in inches."""

_LETTERS = 13
"""Letters of the verdict per inch."""


def draw(dataset: xr.Dataset) -> Sheet:
    """Draw the film and the fit, or the fits of several laws, over time, with the residuals below.

    Outliers are crossed out, and a band shows the noise of the residuals.  The title gives the verdict and the legend
    the values, except in a column of text.
    """
    width = panel_width(1, 11, 0)
    sentences = [] if is_column() else verdict(dataset)
    lines = [line for each in sentences for line in textwrap.wrap(each, int(_LETTERS * width))]
    figure = Sheet(dataset, width, (3.6 if is_column() else 6) + 0.15 * len(lines), constants=False)
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
    if out.any():  # an empty unclipped line would spoil the layout
        if high > low:
            above.set_ylim(low - 0.1 * (high - low), high + 0.1 * (high - low))
        at = np.clip(seen[out], *above.get_ylim())  # an outlier beyond the axis is marked at its end
        above.plot(time[out], at, "x", color="C3", markersize=5, clip_on=False, gid="outliers", label="outlier")
    zero_line(above)
    above.set_ylabel(labels.label(dataset, "seen"))
    zero_line(below)
    below.set_ylabel("film − fit")
    below.set_xlabel(labels.label(dataset, "time"))
    entries = [line for line in above.get_lines() if not str(line.get_label()).startswith("_")]
    if is_column():
        figure.explain(entries)
        return figure
    values = [_of_law(name, one) for name, one in laws] or _values(dataset)
    where: Any = "outside right center" if page() > 2 * _VALUES else "outside lower center"
    figure.legend(handles=entries, title="\n".join(values), loc=where, frameon=False, alignment="left")
    return figure


def _of_law(name: str, dataset: xr.Dataset) -> str:
    """Write a line on how well a law fits."""
    return f"{name}: χ² = {dataset['chi_square'].item():.5g}, weight {dataset['weight'].item():.2g}"


def _values(dataset: xr.Dataset) -> list[str]:
    """Write a line for each parameter: its value, and its 95 % interval."""
    lines = []
    for name in dataset["parameter"].values:
        one = dataset.sel(parameter=name)
        value, *ends = (labels.number(float(f"{one[each]:.4g}")) for each in ("value", "lower_95", "upper_95"))
        symbol, words = labels.symbol(name), bound(one)
        lines.append(f"{symbol}: {words}" if words else f"{symbol} = {value}  ({' to '.join(ends)})")
    return [*lines, "in brackets: 95 % intervals", ""]
