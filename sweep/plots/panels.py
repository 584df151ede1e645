"""Choose what a figure of a dataset shows: variables, axes, and a panel for each value of other axes.

This needs no plotting library.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import xarray as xr

from sweep.config.document import is_number, plain_data
from sweep.faults import fault_of, refusal
from sweep.plots import labels
from sweep.plots.pictures import of
from sweep.plots.quantities import derivable, field, first_picture, subject
from sweep.results.kind import odd_axis

MAX_PANELS = 8
"""Largest number of panels in a figure."""

_MAX_VALUES = 1000
"""Largest number of values of an axis drawn in a map, evenly chosen: with more, each would be less than a pixel.  The
others are not read."""

_TELLING = 3
"""Largest number of maps along a dimension that other panels show together."""

_PANEL_VALUES = 4
"""A longer axis is drawn as an axis; a shorter one gets a panel for each value."""


Panel = dict[str, int]
"""The index along every axis that is not drawn."""


@dataclass(frozen=True)
class Panels:
    """The variables to draw, and their axes and panels."""

    dataset: xr.Dataset
    """The cells that are drawn."""
    whole: xr.Dataset
    """All cells."""
    names: list[str]
    """The variable, or the two that it compares, which share a scale."""
    compared: list[str]
    """Their comparison, for maps alone."""
    across: list[str]
    """Dimensions drawn as axes, the vertical one first: up to two."""
    each: list[Panel]


def choose(
    dataset: xr.Dataset,
    variable: str | None = None,
    *,
    x: str | None = None,
    y: str | None = None,
    at: Mapping[str, float] | None = None,
    alone: bool = False,
) -> Panels:
    """Choose what to draw of a dataset; other parameters as of `sweep.plots.picture.plot`.

    Parameters
    ----------
    alone : whether a comparison is shown without what it compares

    Raises
    ------
    InputError
        if there is no such variable or axis, or there would be too many panels.
    """
    dataset = dataset.isel(nearest(dataset, at or {}))
    names, compared = _variables(dataset, variable, alone=alone)
    first = field(dataset, names[0])
    if first.dtype.kind not in "fiub":
        raise fault_of(f"the values of {names[0]} are not numbers; choose another variable", "variable")
    if names[0] not in dataset.data_vars:
        dataset = dataset.assign({names[0]: first})
    dims = [str(d) for d in first.dims]
    check(dataset, dims)
    own = of(names[0])
    if lost := [d for d in own.together if d not in first.coords]:
        raise fault_of(f"{names[0]} has lost its axis {lost[0]}; reduce the dataset along other axes", "variable")
    for option, name in (("x", x), ("y", y)):
        if name is not None and name not in dims:
            raise fault_of(f"{names[0]} has no axis {name}; its axes are {', '.join(dims) or 'none'}", option)
    if x is not None and x == y:
        raise fault_of(f"{x} is the other axis already; choose two axes", "y")
    across = _across(dataset, [d for d in dims if own.over_axis and d not in own.together], x, y)
    if own.draw:  # a curve of one point shows less than its own drawing
        across = [d for d in across if dataset.sizes[d] > 1 or d in (x, y)]
    if len(across) == 1 and not own.over_axis and across[0] not in own.together:
        raise fault_of(f"{names[0]} is not drawn over one axis; leave it out, or give both x and y", "x" if x else "y")
    rest = [d for d in dims if d not in across and (len(across) == 2 or d not in own.together)]
    dataset = dataset.isel({d: _telling(first, d) for d in rest if d in own.together})
    if (count := math.prod(dataset.sizes[d] for d in rest)) > MAX_PANELS:
        shown = " × ".join(f"{d}: {dataset.sizes[d]}" for d in rest)
        raise fault_of(f"{count} panels ({shown}) are more than {MAX_PANELS}; select one value of an axis")
    whole = dataset
    if len(across) == 2:
        dataset = dataset.isel({d: slice(None, None, -(-dataset.sizes[d] // _MAX_VALUES)) for d in across})
    dataset = dataset.assign({name: field(dataset, name) for name in names[1:] + compared})
    dataset = dataset.sortby([d for d in across if d in dataset.coords])
    return Panels(dataset, whole, names, compared, across, indices(dataset, rest))


def nearest(dataset: xr.Dataset, at: Mapping[str, Any]) -> dict[str, int]:
    """Return the index along each axis of `at` of the value that is nearest to the requested one.

    Raises
    ------
    InputError
        if there is no such axis, or no such value on it.
    """
    found = {}
    for name, wanted in at.items():
        if name not in dataset.dims or name not in dataset.coords:
            axes = ", ".join(str(d) for d in dataset.dims if d in dataset.coords)
            raise fault_of(f"there is no axis {name}; the axes are {axes or 'none'}", "at")
        check(dataset, [name])
        of_axis = isinstance(wanted, xr.DataArray) and wanted.attrs.get("units") == dataset[name].attrs.get("units")
        value = plain_data(wanted.values if of_axis else wanted)
        if not (is_number(value) and math.isfinite(value)):
            raise fault_of(refusal(wanted, "one finite number"), "at", name)
        values = dataset[name].values
        low, high = values.min(), values.max()
        # Half a cell beyond the ends, like the cells of a map.
        beyond = (high - low) / (len(values) - 1) / 2 if len(values) > 1 else abs(low) / 2
        if not low - beyond <= value <= high + beyond:
            span = f"{low:g}" if low == high else f"{low:g} to {high:g}"
            raise fault_of(f"{value:g} is far from all its values, {span}; choose one of them", "at", name)
        found[name] = int(np.abs(values - value).argmin())
    return found


def check(dataset: xr.Dataset, dims: list[str]) -> None:
    """Raise an `InputError` if nothing can be drawn over these dimensions."""
    if odd := odd_axis(dataset, dims):
        raise fault_of(odd)
    for d in dims:
        if dataset[d].dtype.kind not in "fiub" or not np.isfinite(dataset[d].values).all():
            names = dataset[d].dtype.kind in "UO"
            way_out = "xarray draws names: dataset[NAME].to_series().plot.bar()" if names else "give it numbers"
            raise fault_of(f"the values of the axis {d} are not finite numbers; {way_out}")


def indices(dataset: xr.Dataset, dims: list[str]) -> list[Panel]:
    """Return all indices along `dims`, one for each panel."""
    return [dict(zip(dims, index, strict=True)) for index in product(*(range(dataset.sizes[d]) for d in dims))]


def title(dataset: xr.Dataset, panel: Panel) -> str:
    """Name the values that distinguish a panel from the others."""
    return ", ".join(labels.measured(dataset, d, float(dataset[d][i])) for d, i in panel.items())


def _variables(dataset: xr.Dataset, variable: str | None, *, alone: bool) -> tuple[list[str], list[str]]:
    """The variables to draw, and how they compare."""
    chosen = variable or (subject if alone else first_picture)(dataset)
    pair = [] if alone or chosen not in derivable(dataset) else [*of(chosen).compares]
    return (pair, [chosen]) if pair else ([chosen], [])


def _across(dataset: xr.Dataset, dims: list[str], x: str | None, y: str | None) -> list[str]:
    """The dimensions to draw as axes, the vertical one first: those asked for, then the first long ones."""
    free = [d for d in dims if d not in (x, y)]
    long = [d for d in free if dataset.sizes[d] > _PANEL_VALUES]
    longest = sorted(free, key=lambda d: -dataset.sizes[d])[:1]
    rest = iter(long if x else long or longest)
    return [d for d in (y or next(rest, None), x or next(rest, None)) if d]


def _telling(values: xr.DataArray, dim: str) -> list[int]:
    """Return up to three indices along `dim` whose values differ most from cell to cell, in ascending order."""
    spread = values.std([d for d in values.dims if d != dim]).values
    return sorted(np.argsort(-spread)[:_TELLING].tolist())
