"""Says where words stand on the lines of a map: counts on boundaries, and symbols on critical spins.

Places are shares of the map: 0 at its left or lower edge, 1 at the other.  Without any library that draws.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from sweep.axis import Axis
from sweep.grid import Array
from sweep.plots.theory import Line, Points

_HALF = np.array([0.03, 0.03])
"""Half the width and height of a word."""

_LARGE = 0.25
"""How large the parts of lines are that need a word."""

_FINE = 100
"""Points of a line across a map."""

Number = tuple[float, float, str]
"""x, y and the word."""


def numbers(drawn: list[Line], x: Axis, y: Axis) -> Iterator[Number]:
    """Where on the boundaries among these lines their counts are written: near the middle of each part, and off others.

    Small parts have none, unless they are the largest of their line, and neither have parts without room for one.
    """
    return words([line for line in drawn if line.name == "boundary"], drawn, x, y)


def words(named: Iterable[Line], drawn: list[Line], x: Axis, y: Axis) -> Iterator[Number]:
    """Where the symbols of lines are written, each as `numbers`, where all these are `drawn`."""
    taken = np.empty((0, 4))
    for line in named:
        others = _points((each for each in drawn if each.name != "boundary" and each is not line), x, y)
        parts = [(np.stack(part, axis=1), _shares(part, x, y)) for part in line.parts]
        inside = [(((at >= 0) & (at <= 1)).all(axis=1), at, values) for values, at in parts]
        paths = [(values[kept], at[kept]) for kept, at, values in inside if kept.any()]
        sizes = [np.ptp(path, axis=0).max() for _, path in paths]
        least = min(_LARGE, max(sizes, default=0))
        for (values, path), size in zip(paths, sizes, strict=True):
            free = np.flatnonzero(_room(path, taken) > 1)
            if size >= least and free.size:
                crowded = _room(path[free], others) <= 1
                at = free[np.lexsort([np.abs(free - len(path) // 2), crowded])[0]]
                taken = np.vstack([taken, [*path[at], *_HALF]])
                yield float(values[at, 0]), float(values[at, 1]), line.symbol


def _room(places: Array, taken: Array) -> Array:
    """How far words at these places are from others and from the edges, in their half sizes: 1 where they touch."""
    inside = (0.5 - np.abs(places - 0.5)) / _HALF
    beyond = (np.abs(places[:, None] - taken[:, :2]) - taken[:, 2:]) / _HALF
    return np.asarray(np.minimum(inside.min(axis=1), beyond.max(axis=2).min(axis=1, initial=np.inf)))


def _points(drawn: Iterable[Line], x: Axis, y: Axis) -> Array:
    """Points that follow lines closely, within the map: boxes without a size, shape (points, 4)."""
    found = [np.empty((0, 2))]
    for part in (part for line in drawn for part in line.parts):
        path = _shares(part, x, y)
        path = path[np.isfinite(path).all(axis=1)].clip(-1, 2)
        if len(path):
            length = np.cumsum(np.hypot(*np.diff(path, axis=0, prepend=path[:1]).T))
            along = np.linspace(0, length[-1], int(_FINE * length[-1]) + 2)
            found.append(np.stack([np.interp(along, length, path[:, i]) for i in range(2)], axis=1))
    points = np.concatenate(found)
    points = points[((points >= 0) & (points <= 1)).all(axis=1)]
    return np.pad(points, ((0, 0), (0, 2)))


def _shares(part: Points, x: Axis, y: Axis) -> Array:
    """Points of a line as shares of the map, shape (points, 2)."""
    places = []
    for axis, values in ((x, part[0]), (y, part[1])):
        first, last = axis.straight(axis.edges)[[0, -1]]
        places.append((axis.straight(values) - first) / (last - first))
    return np.stack(places, axis=1)
