"""Says where counts change between the cells of a map, by their margins.

From the dataset alone, and without any library that draws.
"""

from __future__ import annotations

import xarray as xr

from sweep.axis import Axis, contours
from sweep.plots.theory import Line
from sweep.results.margins import Counts

NEEDED = ["reversals", "margin_more", "margin_fewer", "status"]
"""The variables of a dataset from which boundaries are drawn."""


def lines(dataset: xr.Dataset, x: Axis, y: Axis) -> list[Line]:
    """The boundaries over a map with these axes, for which all other axes of the dataset are fixed: one for each count.

    There are none if the dataset has no margins.
    """
    if not set(NEEDED) <= set(dataset.data_vars):
        return []
    counts = Counts.of({name: dataset[name].transpose(y.name, x.name).values for name in NEEDED})
    words = "from here on so many reversals, by the margins of the cells"
    curves = {level: list(contours(counts.distance(level), x, y, corners=True)) for level in counts.levels()}
    return [Line("boundary", words, parts, f"{level}") for level, parts in curves.items() if parts]
