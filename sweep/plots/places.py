"""Place words on the lines of a map: counts on boundaries, and symbols on critical spins.

This needs no plotting library.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from sweep.axis import Axis
from sweep.grid import Array
from sweep.plots.theory import Line, Points

_HALF = np.array([0.15, 0.09])
"""Half the width and half the height of a word in inches."""

_WIDTH, _RATIO = 4.0, 0.78
"""Usual width of a map in inches, and its height relative to it."""

_LARGE = 0.25
"""Smallest size of a part of a line that needs a word, as a share of the map."""

Word = tuple[float, float, str]
"""x, y and the symbol of a line."""


def legible(lines: Iterable[Line], x: Axis, y: Axis, width: float) -> tuple[list[Line], list[Word]]:
    """The lines of a map to draw, and the words on them.

    A boundary has no meaning without its number: parts without room for one are left out, and so are all boundaries of
    a map without room for words, whose `width` is zero.
    """
    ordered = sorted(lines, key=lambda line: line.name != "boundary")
    placed = list(_placed(ordered, x, y, width)) if width else []
    numbered = {id(part) for _, part in placed}
    drawn = [
        replace(line, parts=[part for part in line.parts if line.name != "boundary" or id(part) in numbered])
        for line in ordered
    ]
    return [line for line in drawn if line.parts], [word for word, _ in placed]


def words(lines: Iterable[Line], x: Axis, y: Axis, width: float = _WIDTH) -> Iterator[Word]:
    """Place the symbols of lines on a map: near the middle of each part, off other symbols and the edges.

    Small parts get no symbol, unless they are the largest of their line; parts without room get none either.

    Parameters
    ----------
    width : of the map in inches
    """
    return (word for word, _ in _placed(lines, x, y, width))


def _placed(lines: Iterable[Line], x: Axis, y: Axis, width: float) -> Iterator[tuple[Word, Points]]:
    """Each word, and the part of a line on which it stands."""
    taken, half = np.empty((0, 2)), _HALF / [width, width * _RATIO]
    for line in (each for each in lines if each.symbol):
        shares = [(part, np.stack(part, axis=1), _shares(part, x, y)) for part in line.parts]
        inside = [(((at >= 0) & (at <= 1)).all(axis=1), part, points, at) for part, points, at in shares]
        parts = [(part, points[within], at[within]) for within, part, points, at in inside if within.any()]
        sizes = [np.ptp(at, axis=0).max() for *_, at in parts]
        for (part, points, at), size in zip(parts, sizes, strict=True):
            apart = np.any(np.abs(at[:, None] - taken) > 2 * half, axis=2).all(axis=1)
            free = np.flatnonzero(apart & (np.abs(at - 0.5) < 0.5 - half).all(axis=1))
            if free.size and size >= min(_LARGE, max(sizes)):
                k = free[np.abs(free - len(at) // 2).argmin()]
                taken = np.vstack([taken, at[k]])
                yield (float(points[k, 0]), float(points[k, 1]), line.symbol), part


def _shares(part: Points, x: Axis, y: Axis) -> Array:
    """Points of a line as shares of the map, 0 at its left or lower edge and 1 at the other, shape (points, 2)."""
    places = []
    for axis, values in zip((x, y), part, strict=True):
        first, last = axis.straight(axis.edges)[[0, -1]]
        places.append((axis.straight(values) - first) / (last - first))
    return np.stack(places, axis=1)
