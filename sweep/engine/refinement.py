"""Which nodes of a map to simulate where its outcome is constant but for lines: those near the lines.

The nodes of the refined axes are cut into blocks of 2^depth intervals a side; a block shares the nodes
of its sides with its neighbours, and the last of an axis may be shorter.  Of a block the corners are
simulated.  It is halved where the outcomes known in it or on its sides differ.  Inside a block of two
intervals a side that differs, a node is inferred where two opposite neighbours agree, and no other two
on another outcome; so of a line every second node is simulated, and where it turns.  Lines one cell
wide get lost by that: a node simulated whose neighbours for the most part differ has these simulated
too.  Along the other axes there are as many maps.

All follows from the outcomes known so far: a search can go on from these alone.
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
"""Outcome of a node that is not simulated; those of the others are not negative."""


def missing(outcome: Outcomes, refined: Sequence[int], depth: int) -> Nodes:
    """Nodes to simulate next, as ascending indices in the C order of `outcome`; none when all is known.

    Parameters
    ----------
    outcome : of any shape, `UNKNOWN` where not simulated yet
    refined : its refined axes
    depth : level of the largest blocks, at least 1
    """
    wanted, _ = _search(outcome, refined, depth)
    return np.flatnonzero(wanted & (outcome == UNKNOWN))


def sources(outcome: Outcomes, refined: Sequence[int], depth: int) -> Nodes:
    """For each node the simulated one whose outcome it has; shape of `outcome`.

    Takes the outcomes as `missing` leaves them when it finds nothing more.
    """
    return _search(outcome, refined, depth)[1]


def _search(outcome: Outcomes, refined: Sequence[int], depth: int) -> tuple[Flags, Nodes]:
    """Which nodes are to be simulated, and for each the one whose outcome it has; itself where that is open."""
    wanted = np.zeros(outcome.shape, bool)
    source = np.arange(outcome.size).reshape(outcome.shape)
    for level, blocks, halved in _levels(outcome, refined, depth):
        size = 2**level
        at = [_corner_places(n, size) for n in outcome.shape]
        wanted[_mesh(outcome, refined, at)] |= _corners(blocks, refined)
        # A node on the sides of several blocks has one outcome with each: any will do.
        block = [np.minimum(np.arange(n), n - 2) // size for n in outcome.shape]
        inferred = (blocks & ~halved)[_mesh(outcome, refined, block)] & (outcome == UNKNOWN)
        first = _mesh(outcome, refined, [size * i for i in block])
        np.copyto(source, np.ravel_multi_index(first, outcome.shape), where=inferred)
    _infer_between(outcome, refined, wanted, source)
    wanted |= _beside_tips(outcome, refined, outcome.ravel()[source])
    return wanted, source


def _infer_between(outcome: Outcomes, refined: Sequence[int], wanted: Flags, source: Nodes) -> None:
    """Infer what is between the corners of the smallest blocks, or want it; in place.

    Middles of edges come before those of faces, these before those of bodies: each has its neighbours before it.
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
    """Neighbours of the nodes simulated that share the outcome of fewer than half an inner node's: ends of thin lines.

    `value` has the outcomes that are inferred too.
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
    """Where the corners of blocks of `size` intervals are along an axis."""
    return np.append(np.arange(0, nodes - 1, size), nodes - 1)


def _mesh(outcome: Outcomes, refined: Sequence[int], places: Sequence[Any]) -> tuple[Any, ...]:
    """Index with `places` along the refined axes and everything along the others."""
    return np.ix_(*(at if i in refined else range(outcome.shape[i]) for i, at in enumerate(places)))


def _levels(outcome: Outcomes, refined: Sequence[int], depth: int) -> Iterator[tuple[int, Flags, Flags]]:
    """From the largest blocks to those of two intervals a side: level, which there are, which of these are halved."""
    changed = _changed(outcome, refined, depth)
    blocks = np.ones_like(changed[depth])
    for level in range(depth, 0, -1):
        halved = blocks & changed[level]
        yield level, blocks, halved
        blocks = halved
        for axis in refined:
            blocks = blocks.repeat(2, axis).take(range(changed[level - 1].shape[axis]), axis)


def _changed(outcome: Outcomes, refined: Sequence[int], depth: int) -> list[Flags]:
    """By level: in which blocks, their sides included, known outcomes differ."""
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
    """`function` of each two neighbours along an axis."""
    values = np.moveaxis(values, axis, 0)
    return np.moveaxis(function(values[:-1], values[1:]), 0, axis)


def _corners(blocks: Flags, refined: Sequence[int]) -> Flags:
    """Nodes of the level that are corners of `blocks`."""
    for axis in refined:
        framed = np.pad(blocks, [(int(i == axis),) * 2 for i in range(blocks.ndim)])
        blocks = _pairs(np.logical_or, framed, axis)
    return blocks
