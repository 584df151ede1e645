"""A dataset as maps: its axes, its variables, and slices of them over two axes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
import xarray as xr

from sweep.grid import Array
from sweep.plots import labels, marks, quantities
from sweep.results.netcdf import open_dataset
from sweep.results.store import StoreError

IN_MEMORY = 2_000_000
"""Cells up to which a dataset is read as a whole; of a larger one, each slice is read when it is shown."""

_HOW = {"linear": "eigenvalues", "simulated": "simulation", "reason": "whether found"}
"""How a critical spin was found, by what follows its name."""

_NEEDED_BY_MARKS = ("status", "inferred", "noise_limited", "sensitive", "window_dependent")


@dataclass(frozen=True)
class Axis:
    """An axis of the dataset, with its values in ascending order."""

    name: str
    values: Array

    @cached_property
    def spacing(self) -> Literal["linear", "log", "list"]:
        """How the values follow one another; those of a `list` are drawn at equal distances."""
        v = self.values
        if len(v) < 3:
            return "linear" if len(v) == 2 else "list"
        if np.allclose(np.diff(v), v[1] - v[0], rtol=1e-6, atol=0):
            return "linear"
        return "log" if v[0] > 0 and np.allclose(v[1:] / v[:-1], v[1] / v[0], rtol=1e-6, atol=0) else "list"

    @cached_property
    def edges(self) -> Array:
        """Where the cells begin and end on the drawn axis, shape (values + 1,)."""
        v = np.log(self.values) if self.spacing == "log" else self.places
        half = (v[1] - v[0]) / 2 if len(v) > 1 else 0.5
        edges = np.append(v - half, v[-1] + half)
        return np.exp(edges) if self.spacing == "log" else edges

    @property
    def places(self) -> Array:
        """Where the middles of the cells lie on the drawn axis, shape (values,)."""
        return np.arange(float(len(self.values))) if self.spacing == "list" else self.values

    def place(self, value: float) -> float:
        """Where any value lies on the drawn axis."""
        return float(np.interp(value, self.values, self.places)) if self.spacing == "list" else value

    def nearest(self, value: float) -> int:
        return int(np.abs(self.values - value).argmin())


@dataclass(frozen=True)
class Slice:
    """A variable over two axes, all other axes being fixed."""

    name: str
    x: Axis
    y: Axis
    dataset: xr.Dataset
    """All variables that tell about these cells and were asked for, and what is derived from them, over (y, x)."""
    values: Array
    """Shape (y, x)."""
    kinds: Array
    """Bits, shape (y, x): bit k is set where the cell is of the k-th kind of `marks.WORDS`."""
    legend: Mapping[str, str]
    """What the legend says of the kinds that occur."""

    @property
    def shown(self) -> Array:
        """The values that are drawn: those of all cells that have one, shape (cells,)."""
        blank = sum(1 << k for k, kind in enumerate(marks.WORDS) if kind in marks.BLANK)
        values = self.values[(self.kinds & blank) == 0]
        return np.asarray(values[np.isfinite(values)] if values.dtype.kind == "f" else values)


class Source:
    """The dataset of a sweep, as the explorer needs it.

    Raises
    ------
    StoreError
        if the file is not a dataset with an axis.
    """

    def __init__(self, dataset: xr.Dataset, name: str = "dataset") -> None:
        cells = dataset["status"] if "status" in dataset else next(iter(dataset.data_vars.values()), None)
        dims = () if cells is None else tuple(str(d) for d in cells.dims)
        if not dims or "trajectory" in dims:
            what = "single trajectories" if dims else "no axis"
            raise StoreError(f"{name}: {what}; allowed: a dataset of run or critical, with an axis or more")
        self.name = name
        self.dims = dims
        ascending = {d: np.argsort(dataset[d].values, kind="stable") for d in dims if d in dataset.coords}
        self.dataset = dataset.isel({d: o for d, o in ascending.items() if (np.diff(o) < 0).any()})
        self.axes = {d: self._axis(d) for d in self._all_dims()}

    def _all_dims(self) -> list[str]:
        """The dimensions of the cells, then those further ones along which a variable lists several values a cell."""
        more = [
            str(d)
            for variable in self.dataset.data_vars.values()
            if set(self.dims) <= set(variable.dims)
            for d in variable.dims
        ]
        return list(dict.fromkeys([*self.dims, *more]))

    def _axis(self, dim: str) -> Axis:
        values = self.dataset[dim].values if dim in self.dataset.coords else np.arange(self.dataset.sizes[dim])
        return Axis(dim, values.astype(float))

    @property
    def cells(self) -> int:
        return math.prod(self.dataset.sizes[d] for d in self.dims)

    @cached_property
    def variables(self) -> list[str]:
        """Whatever has a number per cell: the counts and what is derived first."""
        found = [str(n) for n, v in self._cell.data_vars.items() if v.dims and set(v.dims) <= set(self.axes)]
        found = [n for n in found if self._cell[n].dtype.kind in "fiub"]
        first = ("reversals", "reversals_predicted", *quantities.DERIVED, "status", "t_stop", "t_last_reversal")
        return [*(n for n in first if n in found), *(n for n in found if n not in first)]

    @cached_property
    def _cell(self) -> xr.Dataset:
        """One cell with all that is derived, which tells of the variables what no number does."""
        return quantities.with_derived(self.dataset.isel({d: slice(1) for d in self.axes}).load())

    def dims_of(self, name: str) -> set[str]:
        """The dimensions of a variable."""
        return set(map(str, self._cell[name].dims))

    def words(self, name: str) -> str:
        """What a variable or an axis is."""
        if name.startswith("n_c") and name.count("_") > 1:
            _, _, _, *how = name.split("_")
            words = ", ".join([_HOW.get(h, h) for h in how] or ["formula"])
            return f"{critical_symbol(name)}, {words}"
        return labels.words(self._cell, name)

    def label(self, name: str) -> str:
        """The same with the unit."""
        return labels.label(self._cell, name) if name in self._cell.variables else self.words(name)

    def slice(self, name: str, x: str, y: str, at: Mapping[str, int], more: tuple[str, ...] = ()) -> Slice:
        """Read the slice of a variable over the axes `x` and `y`, at an index of each other axis.

        Parameters
        ----------
        y : empty for a dataset of one axis
        more : variables wanted beside it
        """
        wanted = dict.fromkeys((name, *_NEEDED_BY_MARKS, *more))
        parts = {p for n in wanted for p in (quantities.DERIVED[n].needs if n in quantities.DERIVED else (n,))}
        fixed = {d: at.get(d, 0) for d in self.axes if d not in (x, y)}
        part = self.dataset[[n for n in self.dataset.data_vars if n in parts]].isel(fixed, missing_dims="ignore").load()
        part = quantities.with_derived(part)
        across = (y, x) if y else (x,)
        template = xr.DataArray(np.zeros([len(self.axes[d].values) for d in across], bool), dims=across)

        def table(array: xr.DataArray) -> Array:
            whole = array.drop_vars(array.coords).broadcast_like(template).transpose(*across).values
            return np.ascontiguousarray(np.atleast_2d(whole))

        found = marks.marks(part, name)
        kinds = np.zeros(np.atleast_2d(template.values).shape, "uint8")
        for k, where in enumerate(found.values()):
            kinds |= table(where).astype("uint8") << np.uint8(k)
        flat = xr.Dataset({n: ((y or "row", x), table(v), v.attrs) for n, v in part.data_vars.items()})
        return Slice(
            name, self.axes[x], self.axes[y] if y else Axis("", np.zeros(1)), flat, flat[name].values,
            kinds, marks.legend(part, name, found),
        )  # fmt: skip

    def parameters_at(self, names: tuple[str, ...], index: Mapping[str, int]) -> dict[str, float]:
        """The parameters `names` of the cell at `index`, as far as the dataset tells them."""
        found = {}
        for name in names:
            if name in self.dataset.coords:
                coordinate = self.dataset.coords[name]
                found[name] = float(coordinate.isel({d: index[str(d)] for d in coordinate.dims}))
        return found

    def describe(self, index: Mapping[str, int]) -> dict[str, str]:
        """All that the dataset tells of the cell at `index`: each variable in words, and its value with its unit."""
        cell = quantities.with_derived(self.dataset.isel({d: index.get(d, 0) for d in self.dims}).load())
        told = {self.words(n): self._value(cell, n) for n in self.variables}
        kinds = marks.marks(cell, self.variables[0])
        if said := [marks.WORDS[kind] for kind, where in kinds.items() if bool(np.any(where)) and kind != "no_value"]:
            told["note"] = "; ".join(said)
        return told

    def _value(self, cell: xr.Dataset, name: str) -> str:
        values = np.ravel(cell[name].values)
        if name == "difference":
            return f"{values[0]:+d}" if values[0] else "0"
        flags = labels.flag_words(cell, name)
        if flags:
            return ", ".join(flags.get(int(v), str(v)) for v in values)
        finite = [f"{v:.6g}" for v in values if np.isfinite(v)]
        return f"{', '.join(finite)} {labels.unit(cell, name)}".strip() if finite else "none"


def critical_symbol(name: str) -> str:
    """The symbol of a critical spin: n_c1⁺ for `n_c1_plus` and for `n_c1_plus_linear`."""
    _, number, side, *_ = name.split("_")
    return f"n_{number}{'⁺' if side == 'plus' else '⁻'}"


def open_source(path: Path) -> Source:
    """Open a dataset for the explorer: into memory if it is not too large."""
    lazy = open_dataset(path, load=False)
    source = Source(lazy, str(path))
    if source.cells > IN_MEMORY:
        return source
    with lazy:
        return Source(open_dataset(path), str(path))


def plain(values: Any) -> Array:
    """`values` in a type that browsers have, as small as it allows."""
    array = np.asarray(values)
    if array.dtype.kind == "f":
        return array.astype("float32")
    if array.dtype.kind == "b":
        return array.astype("uint8")
    return array.astype("int32") if array.dtype.itemsize > 4 else array
