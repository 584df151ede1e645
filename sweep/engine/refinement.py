"""Which nodes of a map to simulate if its outcome changes only across lines: the nodes near these lines.

The map is cut into patches with 2^depth intervals along each refined axis.  Neighbouring patches share the
nodes of their common side, and the last patch of an axis may be shorter.

1. The corners of every patch are simulated.
2. A patch in which, or on whose sides, known outcomes differ is halved along each axis, and so on down
   to patches of two intervals.  The inside of every other patch has the outcome of its corners.
3. Inside a patch of two intervals whose outcomes differ, a node is inferred if two opposite neighbours
   agree, and no two others agree on another outcome.  So along a line every second node is simulated,
   and each node where the line turns.
4. Lines one node wide would be lost by that.  Therefore, if most neighbours of a simulated node have
   another outcome, these neighbours are simulated too.

The axes that are not refined count maps, each of which is searched by itself.

Everything follows from the outcomes known so far, so a search can be resumed from these alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

Outcomes = NDArray[np.int32]
Flags = NDArray[np.bool_]
Nodes = NDArray[np.intp]

UNKNOWN = -1
"""Outcome of a node that is not simulated; no other outcome is negative."""


def missing(outcome: Outcomes, refined: Sequence[int], depth: int) -> Nodes:
    """Nodes to simulate next, as ascending indices in the C order of `outcome`; none when the search is complete.

    Parameters
    ----------
    outcome : outcomes of the nodes, of any shape; `UNKNOWN` where not simulated yet
    refined : indices of the refined axes
    depth : level of the largest patches, at least 1
    """
    wanted, _ = _search(outcome, refined, depth)
    return np.flatnonzero(wanted & (outcome == UNKNOWN))


def sources(outcome: Outcomes, refined: Sequence[int], depth: int) -> Nodes:
    """For each node the simulated one whose outcome it has, as indices; shape of `outcome`.

    Takes the outcomes of a complete search, for which `missing` finds no more nodes.
    """
    return _search(outcome, refined, depth)[1]


def _search(outcome: Outcomes, refined: Sequence[int], depth: int) -> tuple[Flags, Nodes]:
    """Which nodes to simulate, and for each node the one whose outcome it has (itself if that is not known yet)."""
    wanted = np.zeros(outcome.shape, bool)
    source = np.arange(outcome.size).reshape(outcome.shape)
    for level, patches, halved in _levels(outcome, refined, depth):
        size = 2**level
        at = [_corner_places(n, size) for n in outcome.shape]
        wanted[_mesh(outcome, refined, at)] |= _corners(patches, refined)
        # A node on the sides of several patches has the same outcome in each: any of them will do.
        patch = [np.minimum(np.arange(n), n - 2) // size for n in outcome.shape]
        inferred = (patches & ~halved)[_mesh(outcome, refined, patch)] & (outcome == UNKNOWN)
        first = _mesh(outcome, refined, [size * i for i in patch])
        np.copyto(source, np.ravel_multi_index(first, outcome.shape), where=inferred)
    _infer_between(outcome, refined, wanted, source)
    wanted |= _beside_tips(outcome, refined, outcome.ravel()[source])
    return wanted, source


def _infer_between(outcome: Outcomes, refined: Sequence[int], wanted: Flags, source: Nodes) -> None:
    """Infer the nodes between the corners of the smallest patches, or mark them as wanted; in place.

    Midpoints of edges come first, then those of faces, then those of bodies, so that the neighbours
    of a node are decided before it.
    """
    outcomes = outcome.ravel()
    for axes in (axes for count in range(len(refined)) for axes in combinations(refined, count + 1)):
        places = [np.arange(1, n - 1, 2) if i in axes else _corner_places(n, 2) for i, n in enumerate(outcome.shape)]
        here = _mesh(outcome, refined, places)
        origin, open_ = source[here], outcome[here] == UNKNOWN
        ready, agreed, clash = np.ones_like(open_), np.zeros_like(open_), np.zeros_like(open_)
        for axis in axes:
            below, above = (
                source[_mesh(outcome, refined, [at + side * (i == axis) for i, at in enumerate(places)])]
                for side in (-1, 1)
            )
            ready &= (outcomes[below] != UNKNOWN) & (outcomes[above] != UNKNOWN)
            agree = outcomes[below] == outcomes[above]
            clash |= agree & agreed & (outcomes[below] != outcomes[origin])
            np.copyto(origin, below, where=agree & open_)
            agreed |= agree
        wanted[here] |= open_ & ready & (clash | ~agreed)
        source[here] = np.where(clash, source[here], origin)


def _beside_tips(outcome: Outcomes, refined: Sequence[int], value: Outcomes) -> Flags:
    """The neighbours of tips: of simulated nodes like those at the end of a thin line.

    A tip shares its outcome with fewer neighbours than half of those that an inner node has.
    `value` has the outcomes of simulated and inferred nodes.
    """
    alike, judged = np.zeros(outcome.shape, np.int8), outcome != UNKNOWN
    for axis in refined:
        values, counts, flags = (np.moveaxis(each, axis, 0) for each in (value, alike, judged))
        same = values[1:] == values[:-1]
        counts[1:] += same
        counts[:-1] += same
        flags[1:] &= values[:-1] != UNKNOWN
        flags[:-1] &= values[1:] != UNKNOWN
    tips = judged & (alike < len(refined))
    near: Flags = np.zeros(outcome.shape, bool)
    for axis in refined:
        beside, tip = (np.moveaxis(each, axis, 0) for each in (near, tips))
        beside[1:] |= tip[:-1]
        beside[:-1] |= tip[1:]
    return near


def _corner_places(nodes: int, size: int) -> Nodes:
    """The corners of patches of `size` intervals, as indices along an axis."""
    return np.append(np.arange(0, nodes - 1, size), nodes - 1)


def _mesh(outcome: Outcomes, refined: Sequence[int], places: Sequence[Any]) -> tuple[Any, ...]:
    """Index with `places` along the refined axes and everything along the others."""
    return np.ix_(*(at if i in refined else range(outcome.shape[i]) for i, at in enumerate(places)))


def _levels(outcome: Outcomes, refined: Sequence[int], depth: int) -> Iterator[tuple[int, Flags, Flags]]:
    """Yield level, patches and which of these are halved; from the largest down to those of two intervals."""
    changed = _changed(outcome, refined, depth)
    patches = np.ones_like(changed[depth])
    for level in range(depth, 0, -1):
        halved = patches & changed[level]
        yield level, patches, halved
        patches = halved
        for axis in refined:
            patches = patches.repeat(2, axis).take(range(changed[level - 1].shape[axis]), axis)


def _changed(outcome: Outcomes, refined: Sequence[int], depth: int) -> list[Flags]:
    """By level: the patches in which, or on whose sides, known outcomes differ."""
    lowest, highest = np.where(outcome == UNKNOWN, np.iinfo(outcome.dtype).max, outcome), outcome
    for axis in refined:
        lowest, highest = _pairs(np.minimum, lowest, axis), _pairs(np.maximum, highest, axis)
    changed = [lowest < highest]
    for _ in range(depth):
        for axis in refined:
            starts = range(0, lowest.shape[axis], 2)
            lowest = np.minimum.reduceat(lowest, starts, axis)
            highest = np.maximum.reduceat(highest, starts, axis)
        changed.append(lowest < highest)
    return changed


def _pairs(function: np.ufunc, values: Any, axis: int) -> Any:
    """`function` of each pair of neighbours along an axis."""
    values = np.moveaxis(values, axis, 0)
    return np.moveaxis(function(values[:-1], values[1:]), 0, axis)


def _corners(patches: Flags, refined: Sequence[int]) -> Flags:
    """The nodes of a level that are corners of `patches`."""
    for axis in refined:
        framed = np.pad(patches, [(int(i == axis),) * 2 for i in range(patches.ndim)])
        patches = _pairs(np.logical_or, framed, axis)
    return patches
