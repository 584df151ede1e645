"""What theory draws over a map: the critical spins, which explain its edges, and the shape of the largest L(f)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patheffects import Stroke, withStroke

from sweep.grid import Array
from sweep.plots.panels import best_shape

REVERSALS = ("reversals", "reversals_predicted", "difference", "raw_reversals", "reversals_low", "reversals_high")
"""The variables over which theory is drawn."""

_SOURCES = {
    "n_c1": (("_linear", "eigenvalues"), ("", "formula")),
    "n_c2": (("_simulated", "simulation"), ("", "formula")),
}
"""Where a critical spin comes from: the full model if the dataset has it, else the formula of Takano (2011)."""

WORDS = {"n_c1": "a tiny rattle grows", "n_c2": "the spin reverses"}
STYLES: dict[str, Any] = {"n_c1": (0, (1.5, 1.5)), "n_c2": "-", "best": (0, (6, 3))}

_LINE: dict[str, Any] = {"color": "black", "linewidth": 1.2}


def _halo(width: float) -> list[Stroke]:
    return [withStroke(linewidth=width, foreground="white")]


def draw(axes: Axes, dataset: xr.Dataset, across: tuple[str, str], *, labelled: bool) -> dict[str, Line2D]:
    """Draw the lines of theory on a map, and return their entries for the legend.

    Parameters
    ----------
    dataset : of one panel
    across : vertical and horizontal dimension
    labelled : whether there is room for labels at the lines
    """
    box = axes.axis()
    entries = _critical_spins(axes, dataset, across, labelled)
    if b := best_shape(dataset):
        line = axes.axvline if across[1] == "b" else axes.axhline if across[0] == "b" else None
        if line:
            line(b, linestyle=STYLES["best"], path_effects=_halo(2.4), gid="best", **_LINE)
            entries["best"] = handle("best", f"b = {b:.2f}, where the form factor L(f) is largest")
    axes.axis(box)
    return entries


def entry(name: str, source: str, *, over_n0: bool, spin: str = "n₀") -> Line2D:
    """The entry of a legend for n_c1 or n_c2, on figures over the spin or over other parameters."""
    if over_n0:
        return handle(name, f"n$_{{{name[2:]}}}$ ({source}): {WORDS[name]} where |{spin}| is larger")
    return handle(name, f"{spin} = n$_{{{name[2:]}}}$ ({source}): {WORDS[name]} where that is smaller")


def symbol(name: str, side: str) -> str:
    """Such as n_c1 with a plus, as matplotlib sets it."""
    return f"n$_{{{name[2:]}}}^{'+' if side == 'plus' else '-'}$"


def handle(key: str, words: str) -> Line2D:
    """The entry of a legend for a line of theory."""
    return Line2D([], [], linestyle=STYLES[key], label=words, **_LINE)


def critical_spins(dataset: xr.Dataset, name: str) -> Iterator[tuple[str, xr.DataArray, str]]:
    """The side, values and source of n_c1 or n_c2, for both signs, as far as the dataset has them."""
    for side in ("plus", "minus"):
        for suffix, source in _SOURCES[name]:
            if f"{name}_{side}{suffix}" in dataset:
                yield side, dataset[f"{name}_{side}{suffix}"], source
                break


def _critical_spins(axes: Axes, dataset: xr.Dataset, across: tuple[str, str], labelled: bool) -> dict[str, Line2D]:
    entries = {}
    for name in ("n_c1", "n_c2"):
        for side, values, source in critical_spins(dataset, name):
            if "n0" in across:
                seen = _curve(axes, dataset, values, across, name)
            else:
                seen = _contour(axes, dataset, values, across, name)
            if seen is not None:
                entries[name] = entry(name, source, over_n0="n0" in across)
                # Over n0 the lines of n_c1 are too close to those of n_c2 for a label of their own.
                if labelled and ("n0" not in across or name == "n_c2"):
                    _label(axes, seen, name, side, across)
    return entries


def _curve(axes: Axes, dataset: xr.Dataset, values: xr.DataArray, across: tuple[str, str], name: str) -> Array | None:
    """A critical spin over the other axis of a map with an axis n0; its points on the map, None if it has none."""
    (other,) = (dim for dim in across if dim != "n0")
    if set(values.dims) - {other}:
        return None
    spins = values.broadcast_like(dataset[other]).values
    points = np.stack([spins, dataset[other].values] if across[1] == "n0" else [dataset[other].values, spins], axis=1)
    if values.ndim == 0:  # it does not depend on the other axis: right across the map
        low, high = axes.get_ylim() if across[1] == "n0" else axes.get_xlim()
        points[[0, -1], 1 if across[1] == "n0" else 0] = low, high
    within = (float(dataset["n0"].min()) <= spins) & (spins <= float(dataset["n0"].max()))
    if not within.any():
        return None
    axes.plot(*points.T, linestyle=STYLES[name], path_effects=_halo(2.4), gid=name, **_LINE)
    return points[within]


def _contour(axes: Axes, dataset: xr.Dataset, values: xr.DataArray, across: tuple[str, str], name: str) -> Array | None:
    """Where a critical spin equals the n0 of the map; its points, None if it does nowhere."""
    n0 = float(dataset["n0"]) if "n0" in dataset.coords and dataset["n0"].ndim == 0 else 0.0
    if set(values.dims) - set(across):
        return None
    down, right = across
    field = values.broadcast_like(dataset[down] * dataset[right]).transpose(down, right).values
    if min(field.shape) < 2 or not np.nanmin(field, initial=np.inf) < n0 < np.nanmax(field, initial=-np.inf):
        return None
    lines = axes.contour(
        dataset[right], dataset[down], np.ma.masked_invalid(field), [n0],
        colors="black", linewidths=_LINE["linewidth"], linestyles=[STYLES[name]],
    )  # fmt: skip
    lines.set(path_effects=_halo(2.4), gid=name)
    parts = [np.asarray(path.vertices) for path in lines.get_paths()]
    return max(parts, key=len) if any(map(len, parts)) else None


def _label(axes: Axes, points: Array, name: str, side: str, across: tuple[str, str]) -> None:
    """The symbol of a critical spin beside its line, on the side of the larger spins or on the roomier one."""
    place_on_map = axes.transData + axes.transAxes.inverted()
    last = len(points) - 1
    if name == "n_c1":  # the lines are farthest apart near the ends that are closer to the middle
        x, y = min(
            points[[last // 8, last - last // 8]],
            key=lambda point: float(np.hypot(*(place_on_map.transform(point) - 0.5))),
        )
    else:
        x, y = points[int(0.6 * last)]
    outwards = 1 if side == "plus" else -1
    if across[0] == "n0":
        place: dict[str, Any] = {"xytext": (0, 4 * outwards), "ha": "center", "va": "bottom" if outwards > 0 else "top"}
    else:
        if across[1] != "n0":
            outwards = 1 if place_on_map.transform((x, y))[0] < 0.5 else -1
        place = {"xytext": (4 * outwards, 0), "ha": "left" if outwards > 0 else "right", "va": "center"}
    axes.annotate(symbol(name, side), (x, y), textcoords="offset points", fontsize=9, path_effects=_halo(2), **place)


def draw_at(axes: Axes, dataset: xr.Dataset, x: str | None) -> dict[str, Line2D]:
    """Draw vertical lines on curves over `x`, where the start spin is a critical one and where L(f) is largest."""
    entries = {}
    for name in ("n_c1", "n_c2"):
        for side, values, source in critical_spins(dataset, name):
            if x is None or "n0" not in dataset.coords or set(values.dims) - {x} or dataset["n0"].ndim > (x == "n0"):
                continue
            crossings = _crossings(dataset, values, x, side)
            for at in crossings:
                axes.axvline(at, linestyle=STYLES[name], color="black", linewidth=0.8, gid=name)
            if crossings:
                entries[name] = entry(name, source, over_n0=x == "n0")
    if x == "b" and (b := best_shape(dataset)):
        axes.axvline(b, linestyle=STYLES["best"], color="black", linewidth=0.8, gid="best")
        entries["best"] = handle("best", f"b = {b:.2f}, where the form factor L(f) is largest")
    return entries


def _crossings(dataset: xr.Dataset, values: xr.DataArray, x: str, side: str) -> list[float]:
    """Where along `x` the start spin passes a critical spin."""
    at = dataset[x].values
    beyond = np.broadcast_to(dataset["n0"].values, at.shape) - np.broadcast_to(values.values, at.shape)
    beyond = beyond if side == "plus" else -beyond
    known = np.isfinite(beyond)
    k = np.flatnonzero(((beyond[1:] < 0) != (beyond[:-1] < 0)) & known[1:] & known[:-1])
    return [float(v) for v in at[k] + (at[k + 1] - at[k]) * beyond[k] / (beyond[k] - beyond[k + 1])]
