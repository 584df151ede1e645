"""The cells that a lasso or a box encloses, and what their values are."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from matplotlib.path import Path

from sweep.explorer.slices import PlacedAxis
from sweep.grid import Array
from sweep.plots import labels, marks
from sweep.plots.description import Map

_BINS = 12
"""Ranges into which the values of a variable that is no count are told apart; counts beyond so many are, too."""


def enclosed(corners: Array, x: PlacedAxis, y: PlacedAxis) -> Array:
    """Which cells have their middles within corners of shape (2, corners), shape (y, x)."""
    places = np.meshgrid(x.straight(x.place(x.values)), y.straight(y.place(y.values)))
    around = np.stack([x.straight(corners[0]), y.straight(corners[1])], axis=1)
    points = np.stack([each.ravel() for each in places], axis=1)
    return np.asarray(Path(around).contains_points(points)).reshape(places[0].shape)


def statistics(part: Map, chosen: Array) -> tuple[list[tuple[str, int]], list[str]]:
    """How many of the chosen cells have each value, or one of each range, and what else is to be said of them."""
    said = [
        f"{words.split(':')[0]}: {count / chosen.sum():.1%}"
        for kind, words in marks.WORDS.items()
        if (count := int((part.marks[kind] & chosen).sum()))
    ]
    values = part.values[chosen & ~part.blank]
    if not values.size:
        return [], said
    if part.flags:
        return [(words, n) for value, words in part.flags.items() if (n := int((values == value).sum()))], said
    said = [f"mean {labels.number(values.mean())}", f"median {labels.number(np.median(values))}", *said]
    if values.dtype.kind in "iu" and np.ptp(values) < _BINS:
        steps = range(values.min(), values.max() + 1)
        return [(labels.number(step), int((values == step).sum())) for step in steps], said
    counts, edges = np.histogram(values, _BINS)
    ranges = (f"{labels.number(low)} to {labels.number(high)}" for low, high in pairwise(edges))
    return list(zip(ranges, map(int, counts), strict=True)), said
