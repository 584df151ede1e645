"""Chooses which nodes of a map to simulate, and infers the outcomes of the others, if counts change only across lines.

The map is cut into patches with 2^(depth + 1) intervals along each axis.

1. The corners of each patch, the places halfway between them and its middle are simulated: every 2^depth-th node.
2. Parabolas along the axes, through the distances in spin of these nodes from where a count begins
   (`sweep.results.margins`), estimate how far the nodes between them are.  A node is inferred if all its distances are
   clear of zero by a fortieth of how far the parabolas are from straight lines.  Where margins are unknown, it is
   inferred if all simulated nodes of the patch have one outcome.
3. A patch is halved along each axis around the nodes that are left, and around those that a neighbouring patch has
   simulated and that contradict it, and so on, down to patches of two intervals.
4. In the end the inferred nodes next to another outcome are simulated, and so are those around the end of a strip: a
   strip of one outcome may be thinner than a node, and continue between two of them.  Nodes inferred to have no
   possible body are simulated too: which bodies are impossible is known without a simulation.

Everything follows from the results known so far, so a search can be resumed from them alone.
"""

from __future__ import annotations

from functools import reduce
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from sweep.grid import Array
from sweep.kernels.status import IMPOSSIBLE
from sweep.results.margins import Counts

Nodes = NDArray[np.intp]
"""Indices in the C order of the map."""

UNKNOWN = -1
"""Status of a node that is not simulated; no other is negative."""

# Required distance of a node from a boundary, relative to the largest distance of the parabolas from straight lines.
# Over 512 x 512 cells of configs/mu_b.yaml with 32 intervals a patch, 0.025, 0.05, 0.1 and 0.2 simulate 10.5, 10.5,
# 10.9 and 11.7 %; 1, 4, 2 and 2 cells are wrong.
_CLEAR = 0.025

# Number of nodes around the end of a strip that are simulated. Over the same map, none, 2, 3, 4, 5 and 6 simulate 9.5,
# 9.6, 9.8, 10.1, 10.5 and 10.9 %, and 16, 13, 6, 1, 1 and 1 cells are wrong.
_AROUND = 5

# Weights of the two corners at three places of a straight line.
_STRAIGHT = np.array([[1.0, 0.0], [0.5, 0.5], [0.0, 1.0]])


class Outcomes(NamedTuple):
    """Known outcomes of the nodes of a map, arrays of shape (nodes,)."""

    reversals: Array
    status: Array
    """`UNKNOWN` where not known."""

    def differ(self, these: Any, others: Any) -> Array:
        """Return where the outcomes of these nodes differ from those of the others."""
        found: Array = (self.status[these] != self.status[others]) | (self.reversals[these] != self.reversals[others])
        return found


def search(shape: tuple[int, ...], simulated: Outcomes, counts: Counts, depth: int) -> tuple[Nodes, Outcomes]:
    """Return the nodes to simulate next, in ascending order, and all known or inferred outcomes.

    If there are no more nodes, each has an outcome.

    Parameters
    ----------
    shape : of the map; each axis has more than 2^(depth + 1) nodes
    simulated : the outcomes that are known
    counts : counts and margins of the nodes, of shape (nodes,); margins are NaN where unknown
    depth : the first nodes to simulate lie 2^depth apart; at least 1
    """
    known: Array = simulated.status != UNKNOWN
    outcomes = Outcomes(*(each.copy() for each in simulated))
    size, wanted = 2 ** (depth + 1), list[Nodes]()
    patches = _largest(shape, size)
    while len(patches):
        nodes = patches[:, None] + _offsets(shape, [0, size // 2, size])
        ready = known[nodes].all(axis=1)
        wanted.append(nodes[~ready].ravel())
        if size == 2:
            break
        patches = _infer(outcomes, known, counts, nodes[ready], size, shape)
        size //= 2
    new = np.unique(np.concatenate(wanted))
    new = new[~known[new]]
    if not len(new):
        doubtful = _beside_changes(outcomes, shape) | _around_ends(outcomes, shape) | (outcomes.status == IMPOSSIBLE)
        new = np.flatnonzero(doubtful & ~known)
    return new, outcomes


def _infer(outcomes: Outcomes, known: Array, counts: Counts, nodes: Nodes, size: int, shape: tuple[int, ...]) -> Nodes:
    """Infer the nodes between the known `nodes` of patches, one patch a row, in place; return the remaining parts."""
    first = nodes[:, :1]
    inside = first + _offsets(shape, range(size + 1))
    count, left = _by_margins(counts, nodes, size, len(shape))
    alone = np.isnan(count[:, 0]) | (outcomes.status[nodes] != outcomes.status[first]).any(axis=1)
    count[alone] = outcomes.reversals[first][alone]
    left[alone] = np.any(outcomes.differ(nodes, first), axis=1)[alone, None]
    here, status = known[inside], np.broadcast_to(outcomes.status[first], inside.shape)
    contradicted = (outcomes.reversals[inside] != count) | (outcomes.status[inside] != status)
    left = np.where(here, contradicted, left)
    new = ~here & ~left
    outcomes.reversals[inside[new]], outcomes.status[inside[new]] = count[new], status[new]
    return _parts(nodes[:, 0], left, size, shape)


def _by_margins(counts: Counts, nodes: Nodes, size: int, axes: int) -> tuple[Array, Array]:
    """Return the count of each node inside each patch, by the margins at three nodes an axis, and where it is unsure.

    Returns
    -------
    Both of shape (patches, nodes inside); NaN for a patch with an unknown margin.
    """
    weights, straight = _over(_parabola(size), axes), _over(_STRAIGHT, axes)
    corners = np.flatnonzero([1 not in place for place in product(range(3), repeat=axes)])
    low, high = (extreme(counts.reversals[nodes], axis=1).astype(int) for extreme in (np.min, np.max))
    known = np.isfinite(counts.more[nodes]).all(axis=1)
    count = np.repeat(np.where(known, np.maximum(low - 1.0, 0.0), np.nan)[:, None], len(weights), axis=1)
    unsure = np.zeros(count.shape, bool)
    levels = range(max(low[known].min(), 1), high[known].max() + 2) if known.any() else range(0)
    for level in levels:
        rows = np.flatnonzero(known & (low <= level) & (level <= high + 1))
        distance = counts.distance(level, nodes[rows])
        inside = distance @ weights.T
        off = np.abs(distance - distance[:, corners] @ straight.T).max(axis=1, keepdims=True)
        count[rows] += inside > 0
        unsure[rows] |= np.abs(inside) <= _CLEAR * off
    return count, unsure


def _parts(patches: Nodes, left: Array, size: int, shape: tuple[int, ...]) -> Nodes:
    """Return the halves of patches along each axis with a node in `left`, by their first nodes."""
    half, axes = size // 2, len(shape)
    left = left.reshape(len(patches), *[size + 1] * axes)
    parts = list[Nodes]()
    for part, offset in zip(product((0, 1), repeat=axes), _offsets(shape, [0, half]), strict=True):
        inside = left[(slice(None), *(slice(half * i, half * i + half + 1) for i in part))]
        parts.append(patches[inside.any(axis=tuple(range(1, axes + 1)))] + offset)
    return np.unique(np.concatenate(parts))


def _largest(shape: tuple[int, ...], size: int) -> Nodes:
    """Return the first nodes of the largest patches; the last ones reach to the end of an axis and overlap others."""
    starts = [np.unique(np.append(np.arange(0, n - size, size), n - 1 - size)) for n in shape]
    return np.ravel_multi_index(np.meshgrid(*starts, indexing="ij"), shape).ravel()


def _offsets(shape: tuple[int, ...], places: Any) -> Nodes:
    """Return the distance of the nodes at these places along each axis from the first node of a patch."""
    return np.ravel_multi_index(np.meshgrid(*[np.asarray(places)] * len(shape), indexing="ij"), shape).ravel()


def _parabola(size: int) -> Array:
    """Return the weights of three nodes, at the ends and halfway, at all places along a patch: shape (size + 1, 3)."""
    t = np.arange(size + 1) / size
    return np.stack([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)], axis=1)


def _over(weights: Array, axes: int) -> Array:
    """Return the weights along one axis, as those over several."""
    return reduce(np.kron, [weights] * axes)


def _beside_changes(outcomes: Outcomes, shape: tuple[int, ...]) -> Array:
    """Return the nodes with a neighbour along an axis that has another outcome, shape (nodes,)."""
    beside, index = np.zeros(len(outcomes.status), bool), np.arange(len(outcomes.status)).reshape(shape)
    for axis in range(len(shape)):
        along = np.moveaxis(index, axis, 0)
        changes = outcomes.differ(along[:-1], along[1:])
        beside[along[:-1][changes]] = beside[along[1:][changes]] = True
    return beside


def _around_ends(outcomes: Outcomes, shape: tuple[int, ...]) -> Array:
    """Return the nodes near one with hardly a neighbour (diagonals included) of its outcome, shape (nodes,)."""
    outcome = np.stack([each.reshape(shape) for each in outcomes], axis=-1)
    padded = np.pad(outcome, [(1, 1)] * len(shape) + [(0, 0)], mode="edge")
    alike = np.zeros(shape, np.int8)  # including the node itself
    for offset in product(range(3), repeat=len(shape)):
        there = padded[tuple(slice(first, first + n) for first, n in zip(offset, shape, strict=True))]
        alike += (there == outcome).all(axis=-1)
    return np.asarray(maximum_filter(alike <= len(shape), 2 * _AROUND + 1)).ravel()
