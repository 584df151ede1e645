"""Describe a map: its values and their colours, the marks of its cells, lines and words.

`sweep.plots.maps` draws it with matplotlib, `sweep.explorer.figure` with Bokeh.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from sweep.axis import Axis, contours
from sweep.grid import Array
from sweep.plots import labels, scales, theory
from sweep.plots.marks import BLANK, legend, marks, shared_kinds
from sweep.plots.pictures import of
from sweep.plots.quantities import field
from sweep.plots.scales import AUTO, Limits, Scale
from sweep.plots.theory import Line, table
from sweep.results.margins import Counts

MARGINS = ("reversals", "margin_more", "margin_fewer", "status")
"""The variables from which boundaries are drawn."""


@dataclass(frozen=True)
class Map:
    """A variable over two axes; all other axes are fixed."""

    name: str
    x: Axis
    y: Axis
    """A nameless axis of one value if the dataset has a single axis."""
    values: Array
    """Shape (y, x)."""
    marks: dict[str, Array]
    """Masks of the cells of each kind of `marks.WORDS`, shape (y, x)."""
    legend: dict[str, str]
    """Legend entries of the kinds that occur and are marked."""
    notes: tuple[str, ...]
    """Sentences on kinds that more than half of the cells share, which are not marked, and on cells not drawn."""
    flags: dict[int, str]
    """The meaning of each value; empty if they are numbers."""
    lines: list[Line]
    frame: tuple[Array, Array]
    """The ends of the drawn axes x and y."""

    @property
    def blank(self) -> Array:
        """Cells without a value to draw, shape (y, x)."""
        none = np.isnan(self.values) if self.values.dtype.kind == "f" else np.zeros(self.values.shape, bool)
        return np.asarray(np.any([none, *(self.marks[kind] for kind in BLANK)], axis=0))

    @property
    def shown(self) -> Array:
        """The values that are drawn, shape (cells,)."""
        return self.values[~self.blank]


def describe(dataset: xr.Dataset, name: str, x: str, y: str = "", shared: Mapping[str, str] | None = None) -> Map:
    """Describe the map of a variable, or its single row.

    Parameters
    ----------
    dataset : all axes but `x` and `y` are fixed, and the values of these are in increasing order
    name : as `sweep.plots.quantities.field` takes it
    x, y : empty where there is no such axis
    shared : kinds of cell that are not marked, with a sentence on each; by default those that more than half of the
        cells share
    """
    found, kinds = field(dataset, name), marks(dataset, name)
    notes = shared_kinds(dataset, name) if shared is None else shared
    words = {kind: entry for kind, entry in legend(dataset, name).items() if kind not in notes}
    across, up = Axis(x, along(dataset, x)), Axis(y, along(dataset, y))
    lines = theory.lines(dataset, across, up) if y and of(name).theory else []
    lines += boundaries(dataset, across, up) if y and of(name).boundaries else []
    frame = ends(dataset, across), ends(dataset, up)
    return Map(
        name, across, up, table(found, across, up),
        {kind: table(where & (kind not in notes), across, up) for kind, where in kinds.items()},
        words, (*notes.values(), *_wider(dataset, across, up)),
        labels.flag_words(dataset.assign({name: found}), name), list(_visible(lines, *frame)),
        frame,
    )  # fmt: skip


def ends(dataset: xr.Dataset, axis: Axis) -> Array:
    """Return the ends of a drawn axis: the edges of the outer cells, or b = a if the axis passes it.

    Beyond b = a the semi-axes would change their names.
    """
    low, high = axis.edges[[0, -1]]
    if axis.name == "b" and "a" in dataset and not dataset["a"].ndim and axis.values[0] < dataset["a"]:
        high = min(high, float(dataset["a"]))
    return np.array([low, high])


def _visible(lines: list[Line], x: Array, y: Array) -> Iterator[Line]:
    """Yield the lines with the parts of them that a frame with these ends shows."""
    for line in lines:
        inside = [np.any((x[0] <= a) & (a <= x[1]) & (y[0] <= b) & (b <= y[1])) for a, b in line.parts]
        if any(inside):
            yield replace(line, parts=[part for part, within in zip(line.parts, inside, strict=True) if within])


def _wider(dataset: xr.Dataset, *axes: Axis) -> Iterator[str]:
    """Say that cells with b > a are not drawn, if there are any."""
    if any(axis.values[-1] > ends(dataset, axis)[1] for axis in axes):
        yield "cells with b > a are not drawn"


def boundaries(dataset: xr.Dataset, x: Axis, y: Axis) -> list[Line]:
    """Find the boundaries between counts from the margins of cells: a line for each count.

    There are none without margins, nor where these have other axes than the map.
    """
    if not set(MARGINS) <= set(dataset.data_vars):
        return []
    if any({*dataset[name].dims} != {x.name, y.name} for name in MARGINS):
        return []
    counts = Counts.of({name: dataset[name].transpose(y.name, x.name).values for name in MARGINS})
    words = "boundary of counts"
    curves = {
        level: list(contours(np.pad(counts.distance(level), 1, mode="edge"), x, y, corners=True, to_edges=True))
        for level in counts.levels()
    }
    return [Line("boundary", words, parts, f"{level}") for level, parts in curves.items() if parts]


def along(dataset: xr.Dataset, dim: str) -> Array:
    """The values of an axis, counted from zero if it has none; a zero without an axis."""
    if not dim:
        return np.zeros(1)
    return np.asarray(dataset[dim].values, float)


def common_scale(maps: Sequence[Map], limits: Limits = AUTO, cmap: str | None = None) -> Scale:
    """Return the scale of a map, or the common scale of several maps of one kind of value."""
    return scale_of(maps[0], np.concatenate([each.shown for each in maps]), limits, cmap)


def scale_of(first: Map, values: Array, limits: Limits = AUTO, cmap: str | None = None) -> Scale:
    """Return the scale for these values of the variable of a map, shape (values,)."""
    if first.flags:
        present = {int(v): first.flags.get(int(v), str(v)) for v in np.unique(values)}
        return scales.flags(present or first.flags, cmap)
    if not values.size:
        values = np.zeros(1, first.values.dtype)
    usual = "counts" if values.dtype.kind in "iu" else "continuous"
    scale: Scale = getattr(scales, of(first.name).scale or usual)(values, limits, cmap)
    return scale
