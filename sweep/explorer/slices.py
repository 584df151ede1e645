"""The axes and variables of a dataset, maps of them, and the values of a cell in words, for the explorer."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from sweep.axis import Axis
from sweep.faults import FileError
from sweep.grid import Array
from sweep.plots import labels, marks, quantities
from sweep.plots.description import Map, along, describe
from sweep.plots.pictures import of
from sweep.results.dataset import FURTHER, never_settles
from sweep.results.kind import kind, opened
from sweep.results.netcdf import open_dataset

IN_MEMORY = 2_000_000
"""Largest number of cells of a dataset that is read as a whole; slices of a larger one are read when they are shown."""


class PlacedAxis(Axis):
    """An axis as Bokeh draws it: an image has cells of one size, so uneven values are drawn at equal distances."""

    @cached_property
    def drawn_edges(self) -> Array:
        """Edges of the cells on the drawn axis, shape (values + 1,)."""
        return np.arange(len(self.values) + 1) - 0.5 if self.spacing == "uneven" else self.edges

    def place(self, values: Any) -> Any:
        """Return the places of values on the drawn axis; NaN beyond the cells of uneven values."""
        if self.spacing != "uneven":
            return values
        (low, high), (first, last) = self.edges[[0, -1]], self.drawn_edges[[0, -1]]
        places = [first, *range(len(self.values)), last]
        return np.interp(values, [low, *self.values, high], places, left=np.nan, right=np.nan)


ADDRESS = frozenset({"x", "y", "show", "palette", "scale", "low", "high", "zoom", "with", "cell", "frame"})
"""The keys of an address other than axes (`sweep.explorer.state`)."""


class Source:
    """The dataset of a sweep, as the explorer needs it.

    Raises
    ------
    FileError
        if the file is not a dataset with an axis.
    """

    def __init__(self, dataset: xr.Dataset, name: str = "dataset") -> None:
        dataset = _plain_texts(dataset)
        cells = dataset["status"] if "status" in dataset else next(iter(dataset.data_vars.values()), None)
        dims = () if cells is None else tuple(str(d) for d in cells.dims if d not in FURTHER)
        of_kind = kind(dataset)
        what = "no axis" if not dims else of_kind.words if of_kind and not of_kind.explored else ""
        if what:
            raise FileError(f"{name} has {what}; open a dataset of run or critical that has an axis or more")
        if taken := ADDRESS.intersection(dims):
            raise FileError(f"{name}: the axis {min(taken)} has the name of a key of the explorer's address")
        self.name = name
        self.dims = dims
        self._known_extremes: dict[str, Array] = {}
        ascending = {d: np.argsort(dataset[d].values, kind="stable") for d in (*dims, "sign") if d in dataset.indexes}
        self.dataset = dataset.isel({d: o for d, o in ascending.items() if (np.diff(o) < 0).any()})
        # Those of the cells, followed by those along which a variable has several values per cell.
        of_cells = [v.dims for v in self.dataset.data_vars.values() if set(dims) & set(v.dims) and "end" not in v.dims]
        self.axes = {d: PlacedAxis(d, along(self.dataset, d)) for d in map(str, chain(dims, *of_cells))}

    @cached_property
    def variables(self) -> list[str]:
        """Names of the variables with one number per cell; counts and derived quantities come first."""
        names = [str(n) for n, v in self.cell.data_vars.items() if v.dims and set(v.dims) <= set(self.axes)]
        names = [n for n in names if self.cell[n].dtype.kind in "fiub"]
        counts = ("reversals", "reversals_estimated", "reversals_predicted")
        first = (*counts, *quantities.DERIVED, "status", "t_stop", "t_last_reversal")
        return [*(n for n in first if n in names), *(n for n in names if n not in first)]

    @cached_property
    def cell(self) -> xr.Dataset:
        """One cell with all derived quantities, for the names, units and types of the variables."""
        return quantities.with_derived(self.dataset.isel({d: slice(1) for d in self.axes}).load())

    def dims_of(self, name: str) -> set[str]:
        """The dimensions of a variable."""
        return set(map(str, self.cell[name].dims))

    def words(self, name: str) -> str:
        """Return the words for a variable or an axis."""
        return labels.words(self.cell, name)

    def symbol(self, name: str) -> str:
        """Return the symbol of a parameter, with its unit in SI."""
        return labels.with_unit(labels.symbol(name), labels.si_unit(self.dataset, name).strip())

    @cached_property
    def meanings(self) -> dict[str, str]:
        """The sentences that describe the variables, by their words."""
        return {self.words(name): str(self.cell[name].attrs.get("description", "")) for name in self.variables}

    @cached_property
    def _notes(self) -> dict[str, str]:
        """The words for a cell of each kind."""
        endless = "status" in self.dataset and never_settles(self.dataset)
        return marks.WORDS | ({"time_limit": marks.UNBOUNDED} if endless else {})

    def label(self, name: str) -> str:
        """Return the words with the unit."""
        return labels.label(self.cell, name) if name in self.cell.variables else self.words(name)

    def map(self, name: str, x: str, y: str, at: Mapping[str, int]) -> Map:
        """Read the map of a variable over `x` and `y`, at an index of each other axis; a row if `y` is empty.

        A derived quantity keeps all cells along the axes that it does not have: it is derived from them together.
        """
        own = self.dims_of(name)
        chosen = (own if of(name).derive else {*self.dims, *own}) - {x, y}
        part = self.dataset.isel({d: at.get(d, 0) for d in chosen})
        return describe(part, name, x, y)

    def extremes(self, name: str) -> Array:
        """The lowest and the highest value of a variable in all maps, or of all counts; empty without any value."""
        counts = [n for n in self.variables if of(n).theory and not of(n).derive]
        values = [self._extremes(n) for n in (counts if name in counts else [name])]
        return np.concatenate(values)

    def _extremes(self, name: str) -> Array:
        if name not in self._known_extremes:
            values = marks.with_results(self.dataset, name)
            finite = values[np.isfinite(values)] if values.dtype.kind == "f" else values
            self._known_extremes[name] = np.array([finite.min(), finite.max()]) if finite.size else finite
        return self._known_extremes[name]

    def parameters_at(self, names: tuple[str, ...], index: Mapping[str, int]) -> dict[str, float]:
        """The parameters `names` of the cell at `index`, if the dataset has them; on further axes, the first value."""
        there = {name: self.dataset.coords[name] for name in names if name in self.dataset.coords}
        return {name: float(known.isel({d: index.get(str(d), 0) for d in known.dims})) for name, known in there.items()}

    def values_at(self, index: Mapping[str, int]) -> dict[str, str]:
        """All values of the cell at `index`: each variable in words, and its value with its unit.

        Without those that are derived from several cells.
        """
        cell = quantities.with_derived(self.dataset.isel({d: index.get(d, 0) for d in self.dims}).load())
        names = [n for n in self.variables if n in cell]
        values = {self.words(n): self._value(cell, n) for n in names}
        kinds = marks.marks(cell, names[0])
        here = [kind for kind, where in kinds.items() if bool(np.any(where)) and kind != "no_value"]
        if here:
            values["note"] = "; ".join(self._notes[kind] for kind in here)
        return values

    def _value(self, cell: xr.Dataset, name: str) -> str:
        values = np.ravel(cell[name].values)
        if of(name).scale == "differences":
            return labels.number(values[0]) if values[0] <= 0 else f"+{values[0]}"
        if flags := labels.flag_words(cell, name):
            return ", ".join(flags.get(int(v), str(v)) for v in values)
        if "flag_masks" in cell[name].attrs:
            return ", ".join(labels.flags_set(cell[name])) or "none"
        finite = [labels.number(v) for v in values if np.isfinite(v)]
        return f"{', '.join(finite)} {labels.unit(cell, name)}".strip() if finite else "none"


def _plain_texts(dataset: xr.Dataset) -> xr.Dataset:
    """Return a dataset whose texts and names Bokeh shows as they are.

    A joiner without width parts the signs in which Bokeh would recognise mathematics, which can hold links and HTML.
    """

    def plain(text: str) -> str:
        return re.sub(r"[$\\]", "\\g<0>\N{WORD JOINER}", text)

    names = {name: plain(str(name)) for name in {*dataset.variables, *dataset.dims}}
    return labels.rewritten(dataset, plain).rename({name: new for name, new in names.items() if new != name})


def open_source(path: Path) -> Source:
    """Open a dataset for the explorer: into memory if it is not too large."""
    lazy = opened(path, load=False)
    source = Source(lazy, str(path))
    if math.prod(lazy.sizes[d] for d in source.dims) > IN_MEMORY:
        return source
    with lazy:
        return Source(open_dataset(path), str(path))


def plain(values: Any) -> Array:
    """`values` in a type that browsers have, as small as it allows."""
    array = np.asarray(values)
    small = {"float64": "float32", "int64": "int32", "uint64": "int32", "bool": "uint8"}
    return array.astype(small.get(array.dtype.name, array.dtype), copy=False)
