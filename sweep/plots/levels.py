"""Says where counts change between the cells of a map, by their margins, and where the counts are written.

From the dataset alone, and without any library that draws.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import xarray as xr

from sweep.axis import Axis, contours
from sweep.grid import Array
from sweep.plots.theory import Line
from sweep.results.margins import Counts

NEEDED = ["reversals", "margin_more", "margin_fewer", "status"]
"""The variables of a dataset from which boundaries are drawn."""

_APART, _LARGE, _WITHIN = 0.06, 0.25, 0.03
"""How far numbers are from each other at least, how large parts of lines are that need one, and how far numbers are
from the edges, as shares of a map."""


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


def numbers(drawn: Iterable[Line], x: Axis, y: Axis) -> Iterator[tuple[float, float, str]]:
    """Where on the boundaries among these lines their counts are written: near the middle of each part.

    Small parts have none, unless they are the largest of their line, and neither have parts without room for one.
    """
    taken = np.empty((0, 2))
    for line in (each for each in drawn if each.name == "boundary"):
        paths = [np.stack([_shares(x, xs), _shares(y, ys)], axis=1) for xs, ys in line.parts]
        sizes = [np.ptp(path, axis=0).max() for path in paths]
        least = min(_LARGE, max(sizes))
        for (xs, ys), path, size in zip(line.parts, paths, sizes, strict=True):
            within = (np.abs(path - 0.5) < 0.5 - _WITHIN).all(axis=1)
            free = np.flatnonzero(within & (np.abs(path[:, None] - taken).max(axis=2) > _APART).all(axis=1))
            if size >= least and free.size:
                at = free[np.abs(free - len(path) // 2).argmin()]
                taken = np.vstack([taken, path[at]])
                yield float(xs[at]), float(ys[at]), line.symbol


def _shares(axis: Axis, values: Array) -> Array:
    """The values along the drawn axis, from 0 at one edge to 1 at the other."""
    first, last = axis.straight(axis.edges)[[0, -1]]
    return np.asarray((axis.straight(values) - first) / (last - first))
