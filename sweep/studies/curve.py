"""A curve on which a count changes: points between simulated cells, and the look at the middle between two of them.

Where the smooth curve through the points passes between two simulated cells that count as it says, it is confirmed
there.  Where it does not, a point is found beside it, and the halves are looked at in their turn.
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
from sweep.results.margins import FOUND, OPEN, UNCERTAIN, distinct, smoothed
from sweep.studies.roots import Root

# How much farther from an expected place the next two cells are, where the last two lie on one side of the curve.
_FARTHER = 8.0

# Width of the brackets between which a curve is followed, at most, relative to the axis.
_COARSE = 1e-3

# A part of a curve that is longer than the next one by this factor gets a point in its middle all the same: beside a
# peak a smooth curve may pass a single place by chance.
_UNEVEN = 4.0


class Cell(NamedTuple):
    """What is known of a cell beside a curve."""

    distance: float
    """From the boundary, in spin; NaN where there is no count."""
    reversals: int
    decided: bool
    """Whether the count is certain, or its error is not known."""
    measured: bool
    """Whether the distance is the measured one, not a guess."""


@dataclass
class Line:
    """A line along one axis that crosses a curve, and what is known on it."""

    along: Axis
    cell: dict[str, float]
    """The other parameters."""
    cells: dict[float, Cell]
    """What is known along the line, by place; places are straight (`Axis.straight`)."""

    def parameters(self, place: float) -> dict[str, float]:
        """All parameters of the cell at a place."""
        return {**self.cell, self.along.name: float(self.along.bent(np.array(place)))}


@dataclass
class Point(Line):
    """A place of a curve that is being narrowed."""

    root: Root
    halvings: int = 0
    """How often the way between two points of the grid was halved before this one was found."""

    @classmethod
    def between(
        cls, along: Axis, cell: dict[str, float], cells: dict[float, Cell], ends: Sequence[float], deviation: float
    ) -> Point:
        """A point between two cells on either side of a curve, good enough to follow it within `deviation`."""
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
        """What a dataset tells of it (`sweep.results.margins.POINTS`)."""
        root = self.root
        ends = sorted((root.low, root.high), key=lambda place: root.values[place])
        cells = [self.cells[place] for place in ends]
        fewer, more = (self.parameters(place) for place in ends)
        name = self.along.name
        decided = all(cell.decided for cell in cells) and cells[1].distance > 0 >= cells[0].distance
        sure = FOUND if decided else UNCERTAIN
        row: dict[str, Any] = {"end_fewer": fewer[name], "end_more": more[name], "bracket": name}
        row |= {"outcome": OPEN if root.unknown else sure}
        row |= {"reversals_fewer": cells[0].reversals, "reversals_more": cells[1].reversals}
        return fewer | row | {name: (fewer[name] + more[name]) / 2}


def _within(axis: Axis, places: Any) -> Array:
    """The nearest places on the axis: what lies beyond it was not asked for, and may be no body."""
    return np.asarray(np.clip(places, *axis.straight(axis.values)[[0, -1]]))


def _most_halvings(deviation: float) -> float:
    """How often the way between two points is halved: as often as leads from an axis' length to the deviation.

    Where two parts of a curve are near each other, points are found now on one and now on the other, without end.
    """
    return -float(np.log2(deviation))


def _beside(axis: Axis, at: float, off: float) -> tuple[float, float]:
    """The places on both sides of one."""
    inner, outer = _within(axis, [at - off, at + off]).tolist()
    return inner, outer


@dataclass
class Middle(Line):
    """A place between two points at which the curve is expected: two cells beside it tell whether it is there.

    If not, it is looked for between the points, where it crosses the line if it goes straight from one to the other.
    Then it is looked for ever farther away: peaks that resonances make are narrow and high.
    """

    at: float
    beside: tuple[float, float]
    """The places of the two cells that are asked for."""
    between: tuple[float, float]
    """The places of the two points, as far as they lie along the line."""
    halvings: int = 0
    confirmed: bool | None = None
    """Whether the curve passes between the first two cells; None while that is open."""

    def wanted(self) -> list[float]:
        return [] if self.confirmed is not None else [place for place in self.beside if place not in self.cells]

    def learn(self, place: float, cell: Cell) -> None:
        self.cells[place] = cell

    def settled(self, deviation: float) -> Middle | Point:
        """What it is after the last cells: itself, confirmed or not, or a point on a line."""
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
        """A point between two of its cells, on either side of the curve."""
        return replace(Point.between(self.along, self.cell, self.cells, ends, deviation), halvings=self.halvings)

    def _look_farther(self) -> None:
        """Choose the next two cells: those of the two points, or farther by a factor, as far as the axis goes."""
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
    """Points in order, and the middles that are or were looked at."""

    level: int
    closed: bool
    across: tuple[Axis, Axis]
    points: list[Point]
    middles: dict[int, Middle] = field(default_factory=dict)
    """By the `id` of the point before each."""

    @cached_property
    def spans(self) -> Array:
        return np.array([np.ptp(axis.straight(axis.values)) for axis in self.across])

    def searched(self) -> list[Point | Middle]:
        return [*self.points, *self.middles.values()]

    def grow(self, deviation: float) -> None:
        """Take in the middles of which new cells are known, and look at those between points that have been found."""
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
                continue  # a point between them is being looked for
            if (middle := self.middles.get(id(this))) is None:
                middle = self._middle(this, expected[i], (places[i], after[i]), deviation)
                self.middles[id(this)] = replace(middle, halvings=1 + max(this.halvings, following.halvings))
            elif middle.confirmed and long[i] > _UNEVEN * around[i] and middle.halvings <= _most_halvings(deviation):
                new[id(this)] = middle.point(middle.beside, deviation)
        self._insert(new)

    def pieces(self) -> list[tuple[list[Point], bool]]:
        """The points between which it could be followed, piece by piece, and whether a piece is closed."""
        middles = [self.middles.get(id(point)) for point in self.points]
        ends = [i for i, middle in enumerate(middles, start=1) if middle and not middle.confirmed]
        if not ends:
            return [(self.points, self.closed)]
        first = ends[0] if self.closed else 0
        points = self.points[first:] + self.points[:first]
        cuts = sorted({0, *(end - first for end in ends), len(points)})
        return [(points[start:end], False) for start, end in pairwise(cuts)]

    def _insert(self, after: dict[int, Point]) -> None:
        """Put points behind those with these ids, in place of the middles there."""
        self.points = [each for point in self.points for each in (point, after.get(id(point))) if each is not None]
        self.middles = {before: middle for before, middle in self.middles.items() if before not in after}

    def _found(self) -> tuple[list[Point], Array]:
        """The points that have been found, of those at one place the last, and their places, shape (points, 2).

        Places are in lengths of the axes.
        """
        found = [point for point in self.points if point.found]
        places = np.array([self._place(point) for point in found]).reshape(-1, 2)
        apart = distinct(*places.T, closed=self.closed)
        return [point for point, last in zip(found, apart, strict=True) if last], places[apart]

    def _place(self, point: Point) -> Array:
        middle = point.parameters(point.root.expected)
        return np.array([axis.straight(np.array(middle[axis.name])) for axis in self.across]) / self.spans

    def _middle(self, before: Point, expected: Array, ends: tuple[Array, Array], deviation: float) -> Middle:
        """A middle on a line across the way between two ends, by their places in lengths of the axes."""
        way = np.abs(ends[1] - ends[0])
        across = int(way[0] > way[1])
        along, other = self.across[across], self.across[1 - across]
        places, off, from_, to = (self.spans * each for each in (expected, deviation, *ends))
        at, place = (float(_within(axis, places[i])) for axis, i in ((along, across), (other, 1 - across)))
        cell = before.cell | {other.name: float(other.bent(np.array(place)))}
        between = _within(along, np.sort([from_[across], to[across]])).tolist()
        return Middle(along, cell, {}, at, _beside(along, at, float(off[across])), (between[0], between[1]))
