"""Says where words stand on the lines of a map: counts on boundaries, and symbols on critical spins.

Without any library that draws.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from sweep.axis import Axis
from sweep.grid import Array
from sweep.plots.theory import Line, Points

_HALF = 0.03
"""Half the width and height of a word, as a share of the map."""

_LARGE = 0.25
"""How large the parts of lines are that need a word, as a share of the map."""

Word = tuple[float, float, str]
"""x, y and the symbol of a line."""


def words(lines: Iterable[Line], x: Axis, y: Axis) -> Iterator[Word]:
    """Where the symbols of lines are written on a map: near the middle of each part, and off others and the edges.

    Small parts have none, unless they are the largest of their line, and neither have parts without room for one.
    """
    taken = np.empty((0, 2))
    for line in lines:
        placed = [(np.stack(part, axis=1), _shares(part, x, y)) for part in line.parts]
        inside = [(((at >= 0) & (at <= 1)).all(axis=1), points, at) for points, at in placed]
        parts = [(points[kept], at[kept]) for kept, points, at in inside if kept.any()]
        sizes = [np.ptp(at, axis=0).max() for _, at in parts]
        for (points, at), size in zip(parts, sizes, strict=True):
            apart = np.any(np.abs(at[:, None] - taken) > 2 * _HALF, axis=2).all(axis=1)
            free = np.flatnonzero(apart & (np.abs(at - 0.5) < 0.5 - _HALF).all(axis=1))
            if free.size and size >= min(_LARGE, max(sizes)):
                k = free[np.abs(free - len(at) // 2).argmin()]
                taken = np.vstack([taken, at[k]])
                yield float(points[k, 0]), float(points[k, 1]), line.symbol


def _shares(part: Points, x: Axis, y: Axis) -> Array:
    """Points of a line as shares of the map, 0 at its left or lower edge and 1 at the other, shape (points, 2)."""
    places = []
    for axis, values in zip((x, y), part, strict=True):
        first, last = axis.straight(axis.edges)[[0, -1]]
        places.append((axis.straight(values) - first) / (last - first))
    return np.stack(places, axis=1)
