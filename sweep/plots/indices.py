"""Sobol indices as bars, with their intervals."""

from __future__ import annotations

import numpy as np
import xarray as xr

from sweep.plots import labels
from sweep.plots.figure import Picture, arrangement, page, panel_width, write_words

_ORDERS = {"first_order": "the parameter alone", "total_order": "including interactions"}


def draw(dataset: xr.Dataset) -> Picture:
    """Draw a panel for each quantity, with the share of its variance that comes from each parameter."""
    quantities = dataset["quantity"].values
    rows, columns = arrangement(len(quantities), 1) if page() < 3.2 * len(quantities) else (1, len(quantities))
    figure = Picture(dataset, panel_width(columns, 3.2, 1) * columns + 1, 1 + 2.6 * rows, constants=False)
    grid = figure.panels(rows, columns, len(quantities), sharey=True)
    places = np.arange(dataset.sizes["parameter"])
    for axes, quantity in zip(grid, quantities, strict=True):
        one = dataset.sel(quantity=quantity)
        for k, (order, words) in enumerate(_ORDERS.items()):
            index, low, high = (one[f"{order}{end}"].values for end in ("", "_low", "_high"))
            axes.bar(
                places + 0.36 * (k - 0.5), index, 0.34, color=f"C{k}", label=words, zorder=2,
                yerr=np.maximum([index - low, high - index], 0), error_kw={"elinewidth": 1, "capsize": 3},
            )  # fmt: skip
        if not np.isfinite(one["first_order"]).any():
            write_words(axes, "undefined:\nsome samples\nhave no value")
        axes.set_xticks(places, [labels.symbol(name) for name in one["parameter"].values])
        axes.set_title(labels.short(quantity))
        axes.grid(axis="y", alpha=0.3)
    grid[0].set_ylabel("share of the variance")
    figure.explain(grid[0].get_legend_handles_labels()[0])
    return figure
