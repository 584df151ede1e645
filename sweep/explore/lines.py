"""The critical spins of theory as lines on a map: they explain its edges."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import xarray as xr
from contourpy import contour_generator

from sweep.explore.slices import Axis, Slice, Source
from sweep.grid import Array
from sweep.plots import theory

Line = tuple[Array, Array]
"""x and y of the points."""


@dataclass(frozen=True)
class Lines:
    """Where the start spin is n_c1 or n_c2, of either sign."""

    name: str
    source: str
    """Eigenvalues, formula or simulation."""
    words: str
    """What the line means."""
    parts: list[Line] = field(default_factory=list)


def critical_lines(source: Source, part: Slice, at: Mapping[str, int]) -> list[Lines]:
    """The lines of theory on the map of a slice at an index of each other axis; none where they explain nothing."""
    across = (part.x.name, part.y.name)
    if part.name not in theory.REVERSALS or not part.y.name:
        return []
    fixed = {d: i for d, i in at.items() if d not in across}
    found = list[Lines]()
    for name in ("n_c1", "n_c2"):
        for side, values, how in theory.critical_spins(source.dataset, name):
            here = values.isel(fixed, missing_dims="ignore")
            if set(here.dims) - set(across):
                continue
            parts = _curve(part, here) if "n0" in across else _contours(part, here, _spin(source, at), side)
            if parts:
                known = next((lines for lines in found if lines.name == name), None)
                if known is None:
                    words = f"{theory.WORDS[name]} where {'|n₀| is larger' if 'n0' in across else 'that is smaller'}"
                    found.append(known := Lines(name, how, words))
                known.parts.extend(parts)
    return found


def _spin(source: Source, at: Mapping[str, int]) -> float:
    """The start spin of a map without an axis n0."""
    if "n0" in source.axes:
        return float(source.axes["n0"].values[at["n0"]])
    return float(source.dataset["n0"]) if "n0" in source.dataset.coords and source.dataset["n0"].ndim == 0 else 0.0


def _curve(part: Slice, values: xr.DataArray) -> list[Line]:
    """A critical spin over the other axis than n0, as far as it lies on the map."""
    across, other = (part.x, part.y) if part.x.name == "n0" else (part.y, part.x)
    spins = np.broadcast_to(values.values, len(other.values)).astype(float)
    low, high = (across.values if across.spacing == "list" else across.edges)[[0, -1]]
    within = (low <= spins) & (spins <= high)
    if not within.any():
        return []
    places = np.where(within, [across.place(spin) for spin in spins], np.nan)
    return [(places, other.places) if across is part.x else (other.places, places)]


def _contours(part: Slice, values: xr.DataArray, spin: float, side: str) -> list[Line]:
    """Where a critical spin equals the start spin of the map."""
    if (spin <= 0 if side == "plus" else spin >= 0) or min(part.values.shape) < 2:
        return []
    dims = (part.y.name, part.x.name)
    whole = xr.DataArray(np.zeros(part.values.shape), dims=dims)
    field_ = values.drop_vars(list(values.coords)).broadcast_like(whole).transpose(*dims).values
    found = contour_generator(_straight(part.x), _straight(part.y), np.ma.masked_invalid(field_)).lines(spin)
    return [(_bent(part.x, points[:, 0]), _bent(part.y, points[:, 1])) for points in map(np.asarray, found)]


def _straight(axis: Axis) -> Array:
    """The places of the cells, in logarithms where the axis is logarithmic."""
    return np.asarray(np.log(axis.places) if axis.spacing == "log" else axis.places)


def _bent(axis: Axis, places: Array) -> Array:
    return np.asarray(np.exp(places) if axis.spacing == "log" else places)
