"""Curves over one axis of a dataset."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.plots.panels import Panels, best_shape, failed, heading, panel_title, symbol, words


def draw(panels: Panels) -> Figure:
    """A curve of each variable over the one long axis, in a panel for each value of the others."""
    dataset, names = panels.dataset, panels.names
    figure = Figure(figsize=(7, 1.2 + 2.8 * len(panels.each)), dpi=110, layout="constrained")
    figure.suptitle(heading(dataset), fontsize=10)
    rows = figure.subplots(len(panels.each), 1, squeeze=False, sharex=True)[:, 0]
    x = panels.across[0] if panels.across else None
    for axes, panel in zip(rows, panels.each, strict=True):
        for name in names:
            chosen = dataset.isel(panel)
            values = np.atleast_1d(chosen[name].values).astype(float)
            at = np.atleast_1d(dataset[x].values) if x else np.zeros(1)
            if (empty := np.atleast_1d(failed(chosen, name).values)).any():
                values = np.where(empty, np.nan, values)
                axes.plot(at[empty], np.zeros(empty.sum()), "v", color="crimson", label="no result")
            style: dict[str, Any] = (
                {"marker": "s", "fillstyle": "none"} if name == "reversals_predicted" else {"marker": "x"}
            )
            axes.plot(at, values, linestyle="none", label=words(name), **style)
        if x == "b" and names[0] == "reversals":
            _add_form_factor(axes, dataset, panel)
        axes.set_ylabel("reversals" if len(names) > 1 else words(names[0]))
        axes.set_title(panel_title(dataset, panel), fontsize=9)
        axes.grid(alpha=0.3)
        axes.legend(fontsize=7)
    rows[-1].set_xlabel(symbol(x) if x else "")
    return figure


def _add_form_factor(axes: Axes, dataset: xr.Dataset, panel: dict[str, int]) -> None:
    twin = axes.twinx()
    twin.plot(dataset["b"], dataset.isel(panel)["form_factor"], color="0.5", linewidth=1)
    twin.set_ylabel("L(f)", color="0.4")
    twin.set_ylim(bottom=0)
    axes.set_ylim(bottom=0)
    if b := best_shape(dataset):
        axes.axvline(b, color="0.5", linestyle="--", linewidth=1)
