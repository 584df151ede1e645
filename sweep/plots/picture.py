"""The picture of a dataset, from the dataset alone."""

from __future__ import annotations

import math

import xarray as xr
from matplotlib.figure import Figure

from sweep.plots import curves, maps
from sweep.plots.panels import MAX_ROWS, Panels, indices

_PANEL_VALUES = 4
"""An axis of more values is drawn as an axis; one of fewer gets a panel for each value."""

_MAX_VALUES = 1000
"""Values drawn of an axis, taken evenly: more would be less than a pixel each."""


def draw(dataset: xr.Dataset, variable: str | None = None) -> Figure:
    """Draw maps (two long axes) or curves (one) of `variable`, by default the simulated and the predicted reversals.

    Raises
    ------
    ValueError
        if the dataset has no such variable, or would need too many panels.
    """
    if variable is None and "reversals" in dataset:
        names = [name for name in ("reversals", "reversals_predicted") if name in dataset]
    else:
        names = [variable or "spin_final"]
    if missing := [name for name in names if name not in dataset]:
        raise ValueError(f"no variable {missing[0]}; allowed: {', '.join(map(str, dataset.data_vars))}")
    dims = [str(d) for d in dataset[names[0]].dims]
    long = [d for d in dims if dataset.sizes[d] > _PANEL_VALUES]
    long = long or sorted(dims, key=lambda d: -dataset.sizes[d])[:1]
    across = long[:2]
    dataset = dataset.isel({d: slice(None, None, -(-dataset.sizes[d] // _MAX_VALUES)) for d in across})
    rest = [d for d in dims if d not in across]
    if (count := math.prod(dataset.sizes[d] for d in rest)) > MAX_ROWS:
        shown = " × ".join(f"{d}: {dataset.sizes[d]}" for d in rest)
        raise ValueError(f"{count} panels ({shown}); allowed: {MAX_ROWS}, select a part of the dataset first")
    panels = Panels(dataset, names, across, list(indices(dataset, rest)))
    return maps.draw(panels) if len(across) == 2 else curves.draw(panels)
