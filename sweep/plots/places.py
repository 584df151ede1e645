"""Says where the lines of a map have room for what is written at them: counts on them, and symbols beside them.

All boxes are told by their middles and half sizes, as shares of the map.  Without any library that draws.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import product

import numpy as np

from sweep.axis import Axis
from sweep.grid import Array
from sweep.plots.theory import Line, Points

_NUMBER, _LARGE = np.array([0.03, 0.03]), 0.25
"""Half the size of a number, and how large the parts of lines are that need one."""

_FINE, _STRIDE = 100, 4
"""Points of a line across a map, and from which to which of them a place for a symbol is sought."""

_BESIDE = 1.15
"""How far the middle of a symbol is from a point of its line, in half sizes of the symbol."""

_SIDES = [np.array(side) for side in product((-1.0, 0.0, 1.0), repeat=2) if any(side)]

Number = tuple[float, float, str]
"""x, y and the count."""


def numbers(drawn: list[Line], x: Axis, y: Axis) -> Iterator[Number]:
    """Where on the boundaries among these lines their counts are written: near the middle of each part, and off others.

    Small parts have none, unless they are the largest of their line, and neither have parts without room for one.
    """
    taken = np.empty((0, 4))
    others = _points((line for line in drawn if line.name != "boundary"), x, y)
    for line in (each for each in drawn if each.name == "boundary"):
        paths = [_shares(part, x, y) for part in line.parts]
        sizes = [np.ptp(path, axis=0).max() for path in paths]
        least = min(_LARGE, max(sizes))
        for (xs, ys), path, size in zip(line.parts, paths, sizes, strict=True):
            free = np.flatnonzero(_room(path, _NUMBER, taken) > 1)
            if size >= least and free.size:
                crowded = _room(path[free], _NUMBER, others) <= 1
                at = free[np.lexsort([np.abs(free - len(path) // 2), crowded])[0]]
                taken = np.vstack([taken, [*path[at], *_NUMBER]])
                yield float(xs[at]), float(ys[at]), line.symbol


def symbols(
    drawn: list[Line], x: Axis, y: Axis, written: Iterable[Number], halves: Mapping[str, Array]
) -> Iterator[tuple[str, Array, Array]]:
    """Where the symbols of lines other than boundaries stand: the symbol, a point of its line, and its middle.

    A symbol is nearest to its own line, and as far as it can be from numbers, other symbols, other lines and the edges.
    There is none without room for it; boundaries are crossed if need be.

    Parameters
    ----------
    written : the numbers on the boundaries
    halves : half the width and height of each symbol, shape (2,)
    """
    theory = [line for line in drawn if line.name != "boundary"]
    boundaries = _points((line for line in drawn if line.name == "boundary"), x, y)
    counts = [[*_shares((np.array([at_x]), np.array([at_y])), x, y)[0], *_NUMBER] for at_x, at_y, _ in written]
    taken = np.array(counts).reshape(-1, 4)
    for line in (each for each in theory if each.symbol):
        half, own = halves[line.symbol], _points([line], x, y)
        others = _points((each for each in theory if each is not line), x, y)
        points = own[::_STRIDE, :2]
        places = np.concatenate([points + _BESIDE * half * side for side in _SIDES])
        clear = _room(places, half, np.concatenate([taken, others]))
        beside = _room(places, half, own)
        free = np.flatnonzero((beside > 1) & (clear > beside))
        if free.size:
            best = free[np.minimum(clear, _room(places, half, boundaries))[free].argmax()]
            taken = np.vstack([taken, [*places[best], *half]])
            yield line.symbol, points[best % len(points)], places[best]


def _room(places: Array, half: Array, taken: Array) -> Array:
    """How far boxes at these places are from others and from the edges, in their half sizes: 1 where they touch."""
    inside = (0.5 - np.abs(places - 0.5)) / half
    beyond = (np.abs(places[:, None] - taken[:, :2]) - taken[:, 2:]) / half
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
    """Points of a line as shares of the map: 0 at its left or lower edge, 1 at the other; shape (points, 2)."""
    places = []
    for axis, values in ((x, part[0]), (y, part[1])):
        first, last = axis.straight(axis.edges)[[0, -1]]
        places.append((axis.straight(values) - first) / (last - first))
    return np.stack(places, axis=1)
