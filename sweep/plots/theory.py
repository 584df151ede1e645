"""Lines that theory adds to a picture: critical spins, which explain edges, and the shape of largest form factor.

This needs the dataset alone, and no plotting library.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from sweep.axis import Axis, contours
from sweep.grid import Array
from sweep.models.ladder.analytic import best_b
from sweep.parameters import START

_SOURCES = {
    "n_c1": (("_linear", "eigenvalues"), ("", "formula")),
    "n_c2": (("_simulated", "simulation"), ("", "formula")),
}
"""Sources of a critical spin: the full model if the dataset has it, else the formula of Takano (2011)."""

WORDS = {"n_c1": "rattle grows", "n_c2": "reversal"}

STYLES = {"n_c1": ("dotted", 1.2), "n_c2": ("solid", 1.2), "best": ("dashed", 1.2), "boundary": ("solid", 0.6)}
"""Dashes of the lines over a map, and their widths in points."""

OVER_TIME = {"n_c2": "dashed", "n_c1": "dotted"}
"""Dashes of critical spins over time."""


def holds(name: str, changed: Iterable[str]) -> bool:
    """Return whether a line of a map still holds where these parameters, which are not axes, have other values."""
    depends = {"best": set(changed) & {"a", "c"}, "boundary": set(changed)}
    return not depends.get(name, set(changed) - START)


Points = tuple[Array, Array]
"""x and y of a line."""


@dataclass(frozen=True)
class Line:
    """A line over a map or, at some values of x, over curves."""

    name: str
    """Key of its style: `n_c1`, `n_c2`, `boundary`, or `best` for the shape of the largest form factor."""
    words: str
    """Its legend entry, with symbols such as n_c1."""
    parts: list[Points]
    """Over curves, y is empty."""
    symbol: str = ""
    """The label on it: n_c1⁺ and the like, or the count that begins on a boundary."""


def critical_spins(known: Mapping[Any, xr.DataArray], name: str) -> Iterator[tuple[str, xr.DataArray, str]]:
    """Yield the symbol, values and source of n_c1 or n_c2 for each sign, from the best source in `known`."""
    for suffix, source in _SOURCES[name]:
        if f"{name}{suffix}" in known:
            yield from ((f"{name}{sign}", values, source) for sign, values in by_sign(known[f"{name}{suffix}"]))
            return


def by_sign(spins: xr.DataArray) -> Iterator[tuple[str, xr.DataArray]]:
    """Yield the sign and the values of critical spins for each sign that they have."""
    if "sign" in spins.coords:
        each = spins if "sign" in spins.dims else spins.expand_dims("sign")
        yield from (("⁺" if one["sign"] > 0 else "⁻", one.drop_vars("sign")) for one in each.transpose("sign", ...))


def levels(one: xr.Dataset) -> list[tuple[str, str, float, str]]:
    """The name, symbol, value and source of each critical spin that one trajectory has."""
    spins = ((name, *found) for name in OVER_TIME for found in critical_spins(one.data_vars, name))
    return [(name, sign, float(at), source) for name, sign, at, source in spins if np.isfinite(at)]


def words(name: str, source: str, *, over_n0: bool) -> str:
    """Word a legend for n_c1 or n_c2, in figures over the spin or over other parameters."""
    return f"{WORDS[name]}{f' beyond {name}' if over_n0 else f': {name} < n₀'} ({source})"


def lines(dataset: xr.Dataset, x: Axis, y: Axis) -> list[Line]:
    """The lines over a map with these axes, for which all other axes of the dataset are fixed."""
    across, found = {x.name, y.name}, list[Line]()
    for name, sign, values, source in _explaining(dataset, x, y):
        parts = _over_spins(values, x, y) if "n0" in across else _contours(values, float(dataset["n0"]), x, y)
        if parts:
            found.append(Line(name, words(name, source, over_n0="n0" in across), parts, sign))
    if "b" in across and (b := best_shape(dataset)):
        at = np.array([b, b])
        part = (at, y.edges[[0, -1]]) if x.name == "b" else (x.edges[[0, -1]], at)
        found.append(Line("best", _best_words(b), [part]))
    return found


def crossings(dataset: xr.Dataset, x: Axis) -> list[Line]:
    """Find where the start spin passes a critical spin along the axis `x` of curves, and where L(f) is largest."""
    found = list[Line]()
    for name, sign, values, source in _explaining(dataset, x) if x.name else ():
        at = (x if x.name == "n0" else _axis(values, x)).values
        start = at if x.name == "n0" else dataset["n0"].values
        beyond = np.broadcast_to(start - values.values, at.shape) * (1 if "⁺" in sign else -1)
        known = np.isfinite(beyond)
        k = np.flatnonzero(((beyond[1:] < 0) != (beyond[:-1] < 0)) & known[1:] & known[:-1])
        if len(k):
            passed = at[k] + (at[k + 1] - at[k]) * beyond[k] / (beyond[k] - beyond[k + 1])
            found.append(Line(name, words(name, source, over_n0=x.name == "n0"), [(passed, np.array([]))], sign))
    if x.name == "b" and (b := best_shape(dataset)):
        found.append(Line("best", _best_words(b), [(np.array([b]), np.array([]))]))
    return found


def _explaining(dataset: xr.Dataset, *axes: Axis) -> Iterator[tuple[str, str, xr.DataArray, str]]:
    """Yield name, symbol, values and source of the critical spins that depend on these axes alone."""
    across = {axis.name for axis in axes}
    if "n0" not in dataset.coords or not set(dataset["n0"].dims) <= across & {"n0"}:
        return
    known = {name: values for name, values in dataset.data_vars.items() if {*values.dims} <= {*across, "sign"}}
    for name in _SOURCES:
        for sign, values, source in critical_spins(known, name):
            yield name, sign, values, source


def best_shape(dataset: xr.Dataset) -> float | None:
    """b of the largest form factor, if it is the same in the whole dataset and lies within its axis b."""
    if any(name not in dataset or dataset[name].ndim for name in ("a", "c")) or "b" not in dataset.dims:
        return None
    b = best_b(float(dataset["a"]), float(dataset["c"]))
    return b if dataset["b"].min() <= b <= dataset["b"].max() else None


def _best_words(b: float) -> str:
    return f"b = {b:.2f}: largest form factor L(f)"


def _over_spins(values: xr.DataArray, x: Axis, y: Axis) -> list[Points]:
    """Draw a critical spin over the axis other than n0."""
    spin, other = (x, y) if x.name == "n0" else (y, x)
    axis = _axis(values, other)
    along, spins = axis.values, np.broadcast_to(values.values, axis.values.shape).astype(float)
    if not ((spin.values[0] <= spins) & (spins <= spin.values[-1])).any():
        return []
    if other.name in values.dims and len(along) > 1:
        first, last = axis.edges[[0, -1]]
        along = np.concatenate([[first], along, [last]])
        spins = 1 / _to_edges(1 / spins)
    return [(spins, along) if spin is x else (along, spins)]


def _to_edges(inverse: Array) -> Array:
    """Continue 1/n_c, which is proportional to μ, in a straight line to the edges of the outer cells.

    It nowhere changes its sign; where the line would, next to a round body, a quarter of the last value stands for it.
    """
    level = np.pad(inverse, 1, mode="edge")
    straight = (level + np.pad(inverse, 1, mode="reflect", reflect_type="odd")) / 2
    return np.where(straight * level < 0, level / 4, straight)


def _contours(values: xr.DataArray, n0: float, x: Axis, y: Axis) -> list[Points]:
    """Return the contours on which a critical spin equals the start spin of the map."""
    across, up = _axis(values, x), _axis(values, y)
    field = table(values, across, up)
    if not n0:
        return []
    return list(contours(_to_edges(1 / field), across, up, 1 / n0, to_edges=True))  # n_c is infinite for a round body


def table(array: xr.DataArray, x: Axis, y: Axis) -> Array:
    """An array as a table of shape (y, x), repeated along an axis on which it does not vary."""
    sizes = {y.name or "_y": len(y.values), x.name or "_x": len(x.values)}
    template = xr.DataArray(np.zeros(list(sizes.values()), bool), dims=list(sizes))
    return np.ascontiguousarray(array.drop_vars(array.coords).broadcast_like(template).transpose(*sizes).values)


def _axis(values: xr.DataArray, axis: Axis) -> Axis:
    """The axis of a map with the places of these values, or with both its edges where they do not vary along it."""
    if axis.name in values.coords:
        return Axis(axis.name, values[axis.name].values)
    return axis if axis.name in values.dims else Axis(axis.name, axis.edges[[0, -1]])
