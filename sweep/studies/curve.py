"""Refines a curve on which a count changes: points between simulated cells, checked halfway between each pair.

If the smooth curve through the points passes between two simulated cells whose counts agree with it, it is confirmed
there. Otherwise a new point is found nearby, and the two halves are checked in turn.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from sweep.axis import Axis
from sweep.grid import Array
from sweep.results.margins import FOUND, UNCERTAIN, WIDE, distinct, smoothed
from sweep.studies.roots import Root

# Factor by which the next two cells move away from an expected place if the last two lie on the same side of the curve.
_FARTHER = 8.0

# Largest width of the brackets between which a curve is followed, relative to the axis.
_COARSE = 1e-3

# A part of a curve that is longer than the next one by this factor always gets a point in its middle: next to a peak, a
# smooth curve may agree with a single place by chance.
_UNEVEN = 4.0


class Cell(NamedTuple):
    """What is known of a cell near a curve."""

    distance: float
    """Distance from the boundary, in spin; NaN if there is no count."""
    reversals: int
    certain: bool
    """Whether the count is certain, or its error is unknown."""
    measured: bool
    """Whether the distance is measured, and not estimated."""


@dataclass
class Line:
    """A line along one axis that crosses a curve, and what is known along it."""

    along: Axis
    cell: dict[str, float]
    """The other parameters."""
    cells: dict[float, Cell]
    """Known cells along the line, by place; places are straightened (`Axis.straight`)."""

    def parameters(self, place: float) -> dict[str, float]:
        """Return all parameters of the cell at a place."""
        return {**self.cell, self.along.name: float(self.along.bent(np.array(place)))}


@dataclass
class Point(Line):
    """A point of a curve whose bracket is being narrowed."""

    root: Root
    halvings: int = 0
    """Number of times the interval between two grid points was halved before this point was found."""

    @classmethod
    def between(
        cls, along: Axis, cell: dict[str, float], cells: dict[float, Cell], ends: Sequence[float], deviation: float
    ) -> Point:
        """Return a point between two cells on either side of a curve, good enough to follow it within `deviation`."""
        values = {place: cell.distance for place, cell in cells.items()}
        smooth = {place: values[place] for place, cell in cells.items() if cell.measured}
        width = min(deviation / 2, _COARSE) * float(np.ptp(along.straight(along.values)))
        return cls(along, cell, cells, Root(min(ends), max(ends), width, values, smooth, roughly=True))

    def narrow(self, width: float) -> None:
        """Set the final width of the bracket, relative to the parameter."""
        root = self.root
        size = np.abs(self.along.bent(np.array([root.expected, root.low, root.high])))
        root.roughly, root.width = False, width * (1.0 if self.along.spacing == "log" else float(size[0] or size.max()))

    @property
    def found(self) -> bool:
        return self.root.ended and not self.root.unknown

    def wanted(self) -> list[float]:
        return [] if self.root.ended else self.root.wanted()

    def learn(self, place: float, cell: Cell) -> None:
        self.root.learn(place, cell.distance, smooth=cell.measured)
        self.cells[place] = cell

    def row(self) -> dict[str, Any]:
        """Return the variables of the point in a dataset (`sweep.results.margins.POINTS`)."""
        root = self.root
        ends = sorted((root.low, root.high), key=lambda place: root.values[place])
        cells = [self.cells[place] for place in ends]
        fewer, more = (self.parameters(place) for place in ends)
        name = self.along.name
        certain = all(cell.certain for cell in cells) and cells[1].distance > 0 >= cells[0].distance
        sure = FOUND if certain else UNCERTAIN
        row: dict[str, Any] = {"end_fewer": fewer[name], "end_more": more[name], "bracket": name}
        row |= {"outcome": WIDE if root.unknown else sure}
        row |= {"reversals_fewer": cells[0].reversals, "reversals_more": cells[1].reversals}
        return fewer | row | {name: (fewer[name] + more[name]) / 2}


def _within(axis: Axis, places: Any) -> Array:
    """Return the nearest places on the axis; anything beyond was not requested, and may be an impossible body."""
    return np.asarray(np.clip(places, *axis.straight(axis.values)[[0, -1]]))


def _most_halvings(deviation: float) -> float:
    """Return how often the interval between two points is halved: from the axis length down to the deviation.

    Without a limit, two nearby parts of a curve would keep attracting new points in turn.
    """
    return -float(np.log2(deviation))


def _beside(axis: Axis, at: float, off: float) -> tuple[float, float]:
    """Return the places on both sides of one."""
    inner, outer = _within(axis, [at - off, at + off]).tolist()
    return inner, outer


@dataclass
class Middle(Line):
    """A place between two points where the curve is expected; two cells on either side check whether it is there.

    If it is not, the search moves to the crossing of the straight line between the points, and then farther and farther
    away: peaks caused by resonances are narrow and high.
    """

    at: float
    beside: tuple[float, float]
    """The places of the two requested cells."""
    between: tuple[float, float]
    """The places of the two points, if they lie along the line."""
    halvings: int = 0
    confirmed: bool | None = None
    """Whether the curve passes between the first two cells; None while unknown."""

    def wanted(self) -> list[float]:
        return [] if self.confirmed is not None else [place for place in self.beside if place not in self.cells]

    def learn(self, place: float, cell: Cell) -> None:
        self.cells[place] = cell

    def settled(self, deviation: float) -> Middle | Point:
        """Return what follows from the last cells: the place itself, confirmed or not, or a point on a line."""
        if self.confirmed is not None or not self.cells:
            return self
        more = {place: cell.distance > 0 for place, cell in self.cells.items()}
        nearest = min(more, key=lambda place: abs(place - self.at))
        other = next((place for place in self.beside if more[place] != more[nearest]), None)
        if any(np.isnan(cell.distance) for cell in self.cells.values()):
            self.confirmed = False
        elif other is None:
            self._look_farther()
        elif len(more) == 2:
            self.confirmed = True
        elif self.halvings > _most_halvings(deviation):
            self.confirmed = False
        else:
            this = min((place for place in more if more[place] != more[other]), key=lambda place: abs(place - other))
            return self.point((this, other), deviation)
        return self

    def point(self, ends: Sequence[float], deviation: float) -> Point:
        """Return a point between two of the cells, on either side of the curve."""
        return replace(Point.between(self.along, self.cell, self.cells, ends, deviation), halvings=self.halvings)

    def _look_farther(self) -> None:
        """Choose the next two cells: those of the two points, or farther away by a factor, within the axis."""
        inner, outer = self.beside
        if self.between[0] < inner or outer < self.between[1]:
            inner, outer = min(inner, self.between[0]), max(outer, self.between[1])
        else:
            off = _FARTHER * max(outer - self.at, self.at - inner)
            inner, outer = _beside(self.along, self.at, off)
        self.confirmed = False if (inner, outer) == self.beside else None
        self.beside = inner, outer


@dataclass
class Curve:
    """The ordered points, and the middles between them that are or were checked."""

    level: int
    closed: bool
    across: tuple[Axis, ...]
    points: list[Point]
    middles: dict[int, Middle] = field(default_factory=dict)
    """Middles by the `id` of the point before each."""

    @cached_property
    def spans(self) -> Array:
        return np.array([np.ptp(axis.straight(axis.values)) for axis in self.across])

    def searched(self) -> list[Point | Middle]:
        return [*self.points, *self.middles.values()]

    def grow(self, deviation: float) -> None:
        """Record the middles whose new cells are known, and check those between newly found points."""
        settled = {before: middle.settled(deviation) for before, middle in self.middles.items()}
        self._insert({before: point for before, point in settled.items() if isinstance(point, Point)})
        found, places = self._found()
        if len(found) < (3 if self.closed else 2):
            return
        after = np.roll(places, -1, axis=0)[: None if self.closed else -1]
        ways = after - places[: len(after)]
        long = np.hypot(*ways.T)
        padded = np.pad(long, 1, mode="wrap" if self.closed else "edge")
        around = np.minimum(padded[:-2], padded[2:])
        expected = np.stack(smoothed(*places.T, closed=self.closed, parts=2), axis=1)[1::2]
        kept, new = {*map(id, found)}, {}
        line = [point for point in self.points if id(point) in kept or not point.found]
        after_it = {id(point): other for point, other in zip(line, [*line[1:], line[0]], strict=True)}
        for i in np.flatnonzero(long > _FARTHER * deviation).tolist():
            this, following = found[i], found[(i + 1) % len(found)]
            if after_it[id(this)] is not following:
                continue  # a point between them is still being searched
            if (middle := self.middles.get(id(this))) is None:
                middle = self._middle(this, expected[i], (places[i], after[i]), deviation)
                self.middles[id(this)] = replace(middle, halvings=1 + max(this.halvings, following.halvings))
            elif middle.confirmed and long[i] > _UNEVEN * around[i] and middle.halvings <= _most_halvings(deviation):
                new[id(this)] = middle.point(middle.beside, deviation)
        self._insert(new)

    def pieces(self) -> list[tuple[list[Point], bool]]:
        """Return the points through which the curve could be followed, in pieces, and whether each piece is closed."""
        middles = [self.middles.get(id(point)) for point in self.points]
        ends = [i for i, middle in enumerate(middles, start=1) if middle and not middle.confirmed]
        if not ends:
            return [(self.points, self.closed)]
        first = ends[0] if self.closed else 0
        points = self.points[first:] + self.points[:first]
        cuts = sorted({0, *(end - first for end in ends), len(points)})
        return [(points[start:end], False) for start, end in pairwise(cuts)]

    def _insert(self, after: dict[int, Point]) -> None:
        """Insert points after those with these ids, replacing the middles there."""
        self.points = [each for point in self.points for each in (point, after.get(id(point))) if each is not None]
        self.middles = {before: middle for before, middle in self.middles.items() if before not in after}

    def _found(self) -> tuple[list[Point], Array]:
        """Return the points found so far (the last of those at one place) and their places, shape (points, 2).

        Places are fractions of the axis lengths.
        """
        found = [point for point in self.points if point.found]
        places = np.array([self._place(point) for point in found]).reshape(-1, 2)
        apart = distinct(*places.T, closed=self.closed)
        return [point for point, last in zip(found, apart, strict=True) if last], places[apart]

    def _place(self, point: Point) -> Array:
        middle = point.parameters(point.root.expected)
        return np.array([axis.straight(np.array(middle[axis.name])) for axis in self.across]) / self.spans

    def _middle(self, before: Point, expected: Array, ends: tuple[Array, Array], deviation: float) -> Middle:
        """Return a middle on a line across the segment between two ends, given as fractions of the axis lengths."""
        way = np.abs(ends[1] - ends[0])
        across = int(way[0] > way[1])
        along, other = self.across[across], self.across[1 - across]
        places, off, from_, to = (self.spans * each for each in (expected, deviation, *ends))
        at, place = (float(_within(axis, places[i])) for axis, i in ((along, across), (other, 1 - across)))
        cell = before.cell | {other.name: float(other.bent(np.array(place)))}
        between = _within(along, np.sort([from_[across], to[across]])).tolist()
        return Middle(along, cell, {}, at, _beside(along, at, float(off[across])), (between[0], between[1]))
