"""A film beside the trajectory that fits it, and what is left between them."""

from __future__ import annotations

from typing import Any

import xarray as xr

from sweep.plots import labels
from sweep.plots.figure import Picture, page, panel_width, zero_line

_VALUES = 3.2
"""Inches that the values take across."""


def draw(dataset: xr.Dataset) -> Picture:
    """The film and the fit, or those of several laws, over time; below the residuals, beside the values or weights."""
    figure = Picture(panel_width(1, 11, 0), 6)
    figure.head(dataset.attrs.get("title", ""), "")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=[3, 1])
    time, seen = dataset["time"].values, dataset["seen"].values
    above.plot(time, seen, ".", color="0.6", markersize=3, label="film", gid="seen")
    laws = [(str(name), dataset.sel(law=name)) for name in dataset["law"].values] if "law" in dataset.dims else []
    for i, (name, one) in enumerate(laws or [("fit", dataset)]):
        fitted, colour = one["fitted"].values, f"C{i}" if laws else "0.4"
        above.plot(time, fitted, color=f"C{i}", linewidth=1, label=name, gid=f"fitted {name}")
        below.plot(time, seen - fitted, ".", color=colour, markersize=2, gid=f"residuals {name}")
    zero_line(above)
    above.set_ylabel(labels.label(dataset, "seen"))
    zero_line(below)
    below.set_ylabel("film − fit")
    below.set_xlabel(labels.label(dataset, "time"))
    words = [_of_law(name, one) for name, one in laws] or _values(dataset)
    where: Any = "outside right center" if page() > 2 * _VALUES else "outside lower center"
    figure.legend(handles=above.get_lines()[: 1 + max(len(laws), 1)], title="\n".join(words), loc=where, frameon=False,
                  alignment="left")  # fmt: skip
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
