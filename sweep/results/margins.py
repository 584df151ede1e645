"""Locates changes of the count between the cells of a grid from their margins, without further trajectories."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from sweep.grid import Array
from sweep.kernels.status import SETTLED, TIME_LIMIT
from sweep.units import NUMBER
from sweep.variables import Variable

FOUND, WIDE, UNCERTAIN = range(3)

# If the margin to one reversal fewer is at least this share of the margin to one more, the two are the same: the spin
# comes no nearer to zero after its last arc, so it does not show how far the next reversal is. This holds for 250 of
# 576 cells of configs/mu_b.yaml at n0 = 0.05. One in twenty points of the drawn curves is off by 0.159 cells or more;
# by 0.174 with 0.9 here, by 0.175 with 0.999, and by 0.213 if all margins are taken as distances.
_NO_DIP = 0.98

# Points of a curve that are closer together than this, as a fraction of the axis lengths, are merged.
_SAME = 1e-9

_PLACE = "Place along the bracket's axis of the simulated cell that reverses"

POINTS = {
    "level": Variable("int16", NUMBER, "spin reversals that begin at the point"),
    "curve": Variable("int32", NUMBER, "number of the curve",
                      "Number of the curve to which the point belongs; its points are in order along it."),
    "closed": Variable("int8", NUMBER, "is the curve closed?", "", {0: "ends_at_an_edge", 1: "closed"}),
    "end_fewer": Variable("float64", NUMBER, "end of the bracket, fewer reversals", f"{_PLACE} less."),
    "end_more": Variable("float64", NUMBER, "end of the bracket, more reversals", f"{_PLACE} more."),
    "reversals_fewer": Variable("int16", NUMBER, "spin reversals at end_fewer"),
    "reversals_more": Variable("int16", NUMBER, "spin reversals at end_more"),
    "outcome": Variable(
        "int8", NUMBER, "outcome of the search",
        "Found if the bracket is as narrow as requested; wide if it is wider, because a cell in it failed, met the "
        "time limit or has no certain count; uncertain if the count of one of its ends is not certain.",
        {FOUND: "found", WIDE: "wide", UNCERTAIN: "uncertain"},
    ),
}  # fmt: skip
"""Variables over the points of a dataset, besides `bracket`, the axis along which each bracket lies."""


@dataclass(frozen=True)
class Counts:
    """Counts of cells and their margins, in arrays of one shape."""

    reversals: Array
    more: Array
    """Margin to one reversal more, in spin; NaN where unknown."""
    fewer: Array
    """Margin to one reversal fewer."""
    known: Array
    """Whether the cell has a count at all."""

    @classmethod
    def of(cls, found: Mapping[str, Array]) -> Counts:
        """Take counts and margins from the variables of a dataset."""
        known = np.isin(found["status"], (SETTLED, TIME_LIMIT))
        return cls(found["reversals"].astype(float), found["margin_more"], found["margin_fewer"], known)

    @cached_property
    def _below(self) -> Array:
        """Return the range of spin taken by all counts below each count, up to the highest one.

        Each count takes the median of its cells. A single width for all counts would be too coarse: at n0 = 0.05 in
        configs/mu_b.yaml the counts from 2 on take 0.004, 0.015, 0.004, 0.010, 0.002 ... of spin, odd ones several
        times as much as even.
        """
        width, count = self.more + self.fewer, self._count
        usable = np.isfinite(width) & self.known & self._dips
        widths = np.full(count.max(initial=0) + 1, np.median(width[usable]) if usable.any() else 0.0)
        for k in np.unique(count[usable]):
            widths[k] = np.median(width[usable & (count == k)])
        return np.concatenate([[0.0], np.cumsum(widths)])

    @cached_property
    def _dips(self) -> Array:
        """Return where the spin comes nearer to zero after its last arc, so that `more` is a distance."""
        return np.asarray(~(self.more >= _NO_DIP * self.fewer))

    @cached_property
    def _to_more(self) -> Array:
        """Return the distance to one reversal more, estimated from other cells with this count if there is no dip."""
        guess = np.diff(self._below)[self._count] - self.fewer
        return np.where(self._dips, self.more, np.maximum(self.more, guess))

    @cached_property
    def _count(self) -> Array:
        return np.where(self.known, self.reversals, 0).astype(int)

    def distance(self, level: Any) -> Array:
        """Return the distance in spin of all cells from the boundary of `level` reversals.

        It is negative where the cells count fewer, and NaN where unknown. There is one level for all cells, or one for
        each. If the count of a cell is more than one away, or its spin comes no nearer to zero after its last arc, the
        distance is an estimate that takes the width of each count from other cells.
        """
        count, below = self._count, self._below
        of_level = np.interp(level, np.arange(below.size), below)
        found = np.where(
            count >= level,
            self.fewer + (below[count] - of_level),
            -(self._to_more + (of_level - below[np.minimum(count + 1, level)])),
        )
        return np.where(self.known, found, np.nan)

    def borders(self, level: Any) -> Array:
        """Return whether the distance from the boundary of `level` reversals is measured, and not estimated."""
        return np.asarray((self.reversals == level) | ((self.reversals == level - 1) & self._dips))

    def levels(self) -> range:
        """Return the counts that begin somewhere between the cells."""
        found = self.reversals[self.known]
        return range(int(found.min()) + 1, int(found.max()) + 1) if found.size else range(0)


def distinct(x: Array, y: Array, *, closed: bool) -> Array:
    """Return a mask of the points of a curve that differ from the next one; parameters as for `smoothed`.

    Points coincide where a cell of the grid lies exactly on the boundary: they are found on several of its edges.
    """
    apart = np.hypot(np.roll(x, -1) - x, np.roll(y, -1) - y) > _SAME
    apart[-1:] |= not closed
    return np.asarray(apart)


def smoothed(x: Array, y: Array, *, closed: bool, parts: int = 8) -> tuple[Array, Array]:
    """Return a smooth curve through ordered points: piecewise cubic, with the slopes of parabolas at the points.

    Parameters
    ----------
    x, y : `distinct` points as fractions of the axis lengths, shape (points,)
    closed : whether the curve goes on from the last point to the first
    parts : number of straight segments drawn between two points
    """
    points = np.stack([x, y], axis=1)
    if len(points) < (3 if closed else 2):
        return x, y
    if closed:
        points = np.concatenate([points[-2:], points, points[:3]])
    steps = np.hypot(*np.diff(points, axis=0).T)
    along = np.append(0.0, np.cumsum(steps))
    slopes = np.gradient(points, along, axis=0, edge_order=2 if len(points) > 2 else 1)
    spline = CubicHermiteSpline(along, points, slopes)
    places = np.interp(np.arange(parts * len(steps) + 1) / parts, np.arange(len(along)), along)
    curve = spline(places[2 * parts : -2 * parts] if closed else places)
    return curve[:, 0], curve[:, 1]
