"""Which nodes of a map to simulate where its outcome is constant but for lines: those near the lines.

The nodes of the refined axes are cut into blocks of 2^depth intervals a side; a block shares the nodes
of its sides with its neighbours, and the last of an axis may be shorter.  Of a block the corners are
simulated.  It is halved where the outcomes known in it or on its sides differ and, from `BESIDE` up,
where those of a block beside it do.  Along the other axes there are as many maps.

All follows from the outcomes known so far: a search can go on from these alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Outcomes = NDArray[np.int32]
Flags = NDArray[np.bool_]
Nodes = NDArray[np.intp]

UNKNOWN = -1
"""Outcome of a node that is not simulated; those of the others are not negative."""

BESIDE = 3
"""Least level of the blocks that are halved for a change beside them; a block is 2^level intervals a side.

Lower ones cost much and find little: README, refined maps."""


def missing(outcome: Outcomes, refined: Sequence[int], depth: int) -> Nodes:
    """Nodes to simulate next, as ascending indices in the C order of `outcome`; none when all is known.

    Parameters
    ----------
    outcome : of any shape, `UNKNOWN` where not simulated yet
    refined : its refined axes
    depth : level of the largest blocks
    """
    wanted = np.zeros(outcome.shape, bool)
    for size, blocks in _levels(outcome, refined, depth):
        at = [np.append(np.arange(0, n - 1, size), n - 1) for n in outcome.shape]
        wanted[_mesh(outcome, refined, at)] |= _corners(blocks, refined)
    return np.flatnonzero(wanted & (outcome == UNKNOWN))


def sources(outcome: Outcomes, refined: Sequence[int], depth: int) -> Nodes:
    """For each node the simulated one whose outcome it has, its own or its block's; shape of `outcome`.

    Takes the outcomes as `missing` leaves them when it finds nothing more.
    """
    source = np.arange(outcome.size).reshape(outcome.shape)
    for size, blocks in _levels(outcome, refined, depth):  # the halves of a block come after it
        # A node on the sides of several blocks has one outcome with each: any will do.
        block = [np.minimum(np.arange(n), n - 2) // size for n in outcome.shape]
        inferred = blocks[_mesh(outcome, refined, block)] & (outcome == UNKNOWN)
        first = _mesh(outcome, refined, [size * i for i in block])
        np.copyto(source, np.ravel_multi_index(first, outcome.shape), where=inferred)
    return source


def _mesh(outcome: Outcomes, refined: Sequence[int], places: Sequence[Any]) -> tuple[Any, ...]:
    """Index with `places` along the refined axes and everything along the others."""
    return np.ix_(*(at if i in refined else range(outcome.shape[i]) for i, at in enumerate(places)))


def _levels(outcome: Outcomes, refined: Sequence[int], depth: int) -> Iterator[tuple[int, Flags]]:
    """From the largest blocks to single cells: intervals a side, and which of these blocks there are."""
    changed = _changed(outcome, refined, depth)
    blocks = np.ones_like(changed[depth])
    for level in range(depth, 0, -1):
        yield 2**level, blocks
        blocks = blocks & (_widened(changed[level], refined) if level >= BESIDE else changed[level])
        for axis in refined:
            blocks = blocks.repeat(2, axis).take(range(changed[level - 1].shape[axis]), axis)
    yield 1, blocks


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
        blocks = _pairs(np.logical_or, _framed(blocks, axis), axis)
    return blocks


def _widened(blocks: Flags, refined: Sequence[int]) -> Flags:
    """`blocks` and those beside them, across corners too."""
    for axis in refined:
        blocks = _pairs(np.logical_or, _pairs(np.logical_or, _framed(blocks, axis), axis), axis)
    return blocks


def _framed(blocks: Flags, axis: int) -> Flags:
    return np.pad(blocks, [(int(i == axis),) * 2 for i in range(blocks.ndim)])
