"""Critical spins of a dataset of `sweep critical`."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from sweep.plots.labels import symbol
from sweep.plots.panels import MAX_PANELS, heading, indices, title


def draw(dataset: xr.Dataset) -> Figure:
    """Critical spins by formula, eigenvalues and simulation, over the longest axis."""
    dims = [str(d) for d in dataset["n_c1_plus_simulated"].dims]
    dims.sort(key=lambda d: -dataset.sizes[d])
    x = dims[0] if dims else None
    panels = list(indices(dataset, dims[1:]))[:MAX_PANELS]
    figure = Figure(figsize=(8, 1.2 + 3.2 * len(panels)), dpi=110, layout="constrained")
    figure.suptitle(heading(dataset), fontsize=10)
    rows = figure.subplots(len(panels), 1, squeeze=False, sharex=True)[:, 0]
    styles = {"": ("--", "formula"), "_linear": ("-", "eigenvalues"), "_simulated": ("x", "simulation")}
    for axes, panel in zip(rows, panels, strict=True):
        chosen = dataset.isel(panel)
        at = np.atleast_1d(chosen[x].values) if x else np.zeros(1)
        for colour, name in enumerate(("n_c1_plus", "n_c1_minus", "n_c2_plus", "n_c2_minus")):
            for suffix, (style, source) in styles.items():
                if name + suffix in chosen:
                    values = np.atleast_1d(chosen[name + suffix].values)
                    label = f"{name[:4]}{'+' if name.endswith('plus') else '-'}, {source}"
                    axes.plot(at, values, style, color=f"C{colour}", linewidth=1, markersize=4, label=label)
        axes.axhline(0, color="black", linewidth=0.5)
        axes.set_title(title(dataset, panel), fontsize=9)
        axes.set_ylabel("n / sqrt(g/c)")
    rows[0].legend(fontsize=6, ncols=4)
    rows[-1].set_xlabel(symbol(x) if x else "")
    return figure
