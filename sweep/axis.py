"""The axes of a map, and curves over two of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from contourpy import contour_generator

from sweep.grid import Array


@dataclass(frozen=True)
class Axis:
    """Its values in increasing order, how they follow one another, and where the cells around them end."""

    name: str
    values: Array

    @cached_property
    def spacing(self) -> Literal["linear", "log", "uneven"]:
        """Equal distances, equal ratios, or neither."""
        v = self.values
        if len(v) == 2 or (len(v) > 2 and np.allclose(np.diff(v), v[1] - v[0], rtol=1e-6, atol=0)):
            return "linear"
        equal = len(v) > 2 and v[0] > 0 and np.allclose(np.diff(np.log(v)), np.log(v[1] / v[0]), rtol=1e-6)
        return "log" if equal else "uneven"

    @cached_property
    def edges(self) -> Array:
        """Where the cells begin and end, shape (values + 1,): halfway, on a logarithmic axis in the logarithm."""
        v = self.straight(self.values)
        if len(v) == 1:
            return np.asarray(v[0] + [-0.5, 0.5])
        between = (v[1:] + v[:-1]) / 2
        return self.bent(np.concatenate([[2 * v[0] - between[0]], between, [2 * v[-1] - between[-1]]]))

    def straight(self, values: Array) -> Array:
        """Return what is linear along the drawn axis: the values, or their logarithms."""
        return np.asarray(np.log(values) if self.spacing == "log" else values)

    def bent(self, places: Array) -> Array:
        """The inverse of `straight`."""
        return np.asarray(np.exp(places) if self.spacing == "log" else places)

    def nearest(self, value: float) -> int:
        return int(np.abs(self.values - value).argmin())


def contours(
    values: Array, x: Axis, y: Axis, level: float = 0.0, *, corners: bool = False, to_edges: bool = False
) -> Iterator[tuple[Array, Array]]:
    """Where `values`, of shape (y, x), pass through `level`: the x and y of each curve, in order, on lines of the grid.

    There is no curve beside values that are NaN, or with `corners` between three others, which may end on a diagonal.
    With `to_edges` curves go on to the edges of the outer cells, for which `values` have further rows and columns.
    """
    if min(len(x.values), len(y.values)) < 2:
        return
    across, up = (axis.straight(axis.values) for axis in (x, y))
    if to_edges:
        across, up = (np.insert(axis.straight(axis.edges[[0, -1]]), 1, axis.straight(axis.values)) for axis in (x, y))
    generator = contour_generator(across, up, np.ma.masked_invalid(values), corner_mask=corners)
    for part in map(np.asarray, generator.lines(level)):
        yield x.bent(part[:, 0]), y.bent(part[:, 1])
