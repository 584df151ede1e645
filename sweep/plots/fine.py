"""Critical spins between the cells of a map, by formulas and eigenvalues, so that their lines are smooth.

This needs the dataset alone, and no plotting library.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache

import numpy as np
import xarray as xr

from sweep.axis import Axis
from sweep.config import Config, InputError
from sweep.grid import Grid
from sweep.parameters import START
from sweep.prediction import predict
from sweep.results.configuration import configuration

_POINTS = {1: 401, 2: 41}
"""Number of values along one axis, and along each of two; the eigenvalues of a body take 0.1 ms."""


def critical_spins(dataset: xr.Dataset, *axes: Axis) -> Mapping[str, xr.DataArray]:
    """Compute the critical spins along the axes of a map, or along the axis of curves, by their names in a dataset.

    They go from edge to edge of a map, and from the first to the last value of curves.  Each extends over the axes on
    which the body depends.  There are none if a parameter of the body varies along another axis, and none if
    the dataset has no configuration, or one whose model is user-defined.
    """
    text = str(dataset.attrs.get("config", ""))
    config = _config(text)
    body = [name for name in config.tier.parameters if name not in START] if config else []
    drawn = {axis.name: axis for axis in axes if axis.name in body}
    fixed = [name for name in body if name not in drawn]
    if not config or any(name not in dataset.coords or dataset[name].ndim for name in fixed):
        return {}
    number, whole = _POINTS.get(len(drawn), 1), len(axes) > 1
    between = tuple((name, tuple(_between(axis, number, config, whole=whole))) for name, axis in drawn.items())
    return _evaluated(text, between, tuple((name, float(dataset[name])) for name in fixed))


def _between(axis: Axis, number: int, config: Config, *, whole: bool) -> Iterator[float]:
    """Values along an axis within the bounds of the parameter; for a map, from edge to edge."""
    first, last = axis.straight(axis.edges if whole else axis.values)[[0, -1]]
    for value in axis.bent(np.linspace(first, last, number)).tolist():
        if config.table[axis.name].allows(value) and (value > 0 or axis.name not in config.tier.positive):
            yield value


@lru_cache(maxsize=8)
def _config(text: str) -> Config | None:
    try:
        return configuration(xr.Dataset(attrs={"config": text}))
    except InputError:
        return None


@lru_cache(maxsize=8)
def _evaluated(
    text: str, axes: tuple[tuple[str, tuple[float, ...]], ...], fixed: tuple[tuple[str, float], ...]
) -> Mapping[str, xr.DataArray]:
    """Compute the critical spins of the bodies in the configuration with this text; cached, since panels and maps share
    them."""
    config = _config(text)
    assert config is not None
    # No critical spin depends on the start.
    starts = {name: value.numbers[0] for name, value in config.parameters.items() if name in START}
    grid = Grid({name: np.array(values) for name, values in axes}, {**starts, **dict(fixed)})
    predicted = predict(config.tier, grid).variables
    return {
        name: xr.DataArray(values.reshape(*grid.shape, 2), {**grid.axes, "sign": [1, -1]}, (*grid.dims, "sign"))
        for name, values in predicted.items()
        if name.startswith("n_c")
    }
