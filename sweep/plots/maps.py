"""Pictures of a dataset, from the dataset alone."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product
from typing import Any

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, Colormap, ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from sweep.grid import Array
from sweep.kernels.lanes import FAILURES
from sweep.models.analytic import best_b

SYMBOLS = {"mu": "μ", "delta": "δ", "n0": "n₀", "x0": "x₀", "y0": "y₀", "case": "case"}

# An axis of more values than this is drawn as an axis; a shorter one gets a panel for each value.
_PANEL_VALUES = 4
_MAX_ROWS = 8

# What a trajectory that failed has no value of.
_SIMULATED = {
    "reversals", "t_first_reversal", "t_last_reversal", "noise_limited", "spin_mean", "spin_final", "energy_error",
}  # fmt: skip
_MAX_COLOURS = 40
_MAX_VALUES = 1000
"""Of an axis, evenly taken: more are less than a pixel."""


def draw(dataset: xr.Dataset, variable: str | None = None) -> Figure:
    """Maps (two long axes) or curves (one) of `variable`; by default the simulated reversals beside
    the predicted ones.

    Raises
    ------
    ValueError
        where the dataset has no such variable, or too many panels to draw.
    """
    if variable is None and "reversals" in dataset:
        names = [name for name in ("reversals", "reversals_predicted") if name in dataset]
    else:
        names = [variable or "spin_final"]
    if missing := [name for name in names if name not in dataset]:
        raise ValueError(f"no variable {missing[0]}; allowed: {', '.join(map(str, dataset.data_vars))}")
    dims = [str(d) for d in dataset[names[0]].dims]
    long = [d for d in dims if dataset.sizes[d] > _PANEL_VALUES]
    long = long or sorted(dims, key=lambda d: -dataset.sizes[d])[:1]
    across = long[:2]
    dataset = dataset.isel({d: slice(None, None, -(-dataset.sizes[d] // _MAX_VALUES)) for d in across})
    rest = [d for d in dims if d not in across]
    if (count := math.prod(dataset.sizes[d] for d in rest)) > _MAX_ROWS:
        shown = " × ".join(f"{d}: {dataset.sizes[d]}" for d in rest)
        raise ValueError(f"{count} panels ({shown}); allowed: {_MAX_ROWS}, select a part of the dataset first")
    panels = list(_panels(dataset, rest))
    painter = _maps if len(across) == 2 else _curves
    return painter(dataset, names, across, panels)


def _panels(dataset: xr.Dataset, dims: list[str]) -> Iterator[dict[str, int]]:
    for index in product(*(range(dataset.sizes[d]) for d in dims)):
        yield dict(zip(dims, index, strict=True))


def _title(dataset: xr.Dataset, panel: dict[str, int]) -> str:
    return ", ".join(f"{_symbol(d)} = {float(dataset[d][i]):g}" for d, i in panel.items())


def _symbol(name: str) -> str:
    return SYMBOLS.get(name, name)


def _heading(dataset: xr.Dataset) -> str:
    scalars = [f"{_symbol(str(n))} = {float(v):g}" for n, v in dataset.coords.items() if v.ndim == 0]
    return f"{dataset.attrs.get('title', '')}\n{', '.join(scalars)}"


def draw_critical(dataset: xr.Dataset) -> Figure:
    """Critical spins by formula, eigenvalues and simulation, over the longest axis."""
    dims = [str(d) for d in dataset["n_c1_plus_simulated"].dims]
    dims.sort(key=lambda d: -dataset.sizes[d])
    x = dims[0] if dims else None
    panels = list(_panels(dataset, dims[1:]))[:_MAX_ROWS]
    figure = Figure(figsize=(8, 1.2 + 3.2 * len(panels)), dpi=110, layout="constrained")
    figure.suptitle(_heading(dataset), fontsize=10)
    rows = figure.subplots(len(panels), 1, squeeze=False, sharex=True)[:, 0]
    styles = {"": ("--", "formula"), "_linear": ("-", "eigenvalues"), "_simulated": ("x", "simulation")}
    for axes, panel in zip(rows, panels, strict=True):
        chosen = dataset.isel(panel)
        at = np.atleast_1d(chosen[x].values) if x else np.zeros(1)
        for colour, name in enumerate(("n_c1_plus", "n_c1_minus", "n_c2_plus", "n_c2_minus")):
            for suffix, (style, source) in styles.items():
                if name + suffix in chosen:
                    values = np.atleast_1d(chosen[name + suffix].values)
                    label = f"{name[:4]}{'+' if name.endswith('plus') else '-'}, {source}"
                    axes.plot(at, values, style, color=f"C{colour}", linewidth=1, markersize=4, label=label)
        axes.axhline(0, color="black", linewidth=0.5)
        axes.set_title(_title(dataset, panel), fontsize=9)
        axes.set_ylabel("n / sqrt(g/c)")
    rows[0].legend(fontsize=6, ncols=4)
    rows[-1].set_xlabel(_symbol(x) if x else "")
    return figure


def _maps(dataset: xr.Dataset, names: list[str], across: list[str], panels: list[dict[str, int]]) -> Figure:
    down, right = across
    figure = Figure(figsize=(1.5 + 4.6 * len(names), 1.2 + 3.6 * len(panels)), dpi=110, layout="constrained")
    figure.suptitle(_heading(dataset), fontsize=10)
    grid = figure.subplots(len(panels), len(names), squeeze=False, sharex=True, sharey=True)
    for row, panel in zip(grid, panels, strict=True):
        colours, norm = _colours(dataset.isel(panel), names)
        for axes, name in zip(row, names, strict=True):
            chosen = dataset.isel(panel)
            values = chosen[name].transpose(down, right).values
            empty = _without_result(chosen, name, (down, right))
            # cells without a result: dark with a hatch, never a colour of the scale
            axes.set_facecolor("0.25")
            axes.patch.set(hatch="xxx", edgecolor="0.6")
            mesh = axes.pcolormesh(
                dataset[right], dataset[down], np.ma.masked_where(empty, values),
                cmap=colours, norm=norm, shading="nearest",
            )  # fmt: skip
            axes.set_title(f"{_words(name)}\n{_title(dataset, panel)}", fontsize=9)
            _mark_best_shape(axes, dataset, right)
            if empty.any():
                label = f"no result: {empty.sum()} of {empty.size}"
                axes.legend(handles=[Patch(facecolor="0.25", hatch="xxx", edgecolor="0.6", label=label)],
                            fontsize=7, loc="upper left")  # fmt: skip
        row[0].set_ylabel(_symbol(down))
        bar = figure.colorbar(mesh, ax=list(row), label=_words(names[0]) if len(names) == 1 else "reversals")
        _label_bar(bar, dataset, names[0], norm)
    for axes in grid[-1]:
        axes.set_xlabel(_symbol(right))
    return figure


def _words(name: str) -> str:
    return {"reversals": "simulated reversals", "reversals_predicted": "predicted reversals (Takano)"}.get(
        name, name.replace("_", " ")
    )


def _without_result(chosen: xr.Dataset, name: str, dims: tuple[str, str]) -> Array:
    values = chosen[name]
    empty = np.isnan(values.transpose(*dims).values.astype(float))
    if name in _SIMULATED:
        empty |= np.isin(chosen["status"].transpose(*dims).values, (0, *FAILURES))
    return np.asarray(empty)


def _best_shape(dataset: xr.Dataset) -> float | None:
    """b of the largest form factor, where there is one for the whole dataset."""
    if any(name not in dataset or dataset[name].ndim for name in ("a", "c")):
        return None
    b = best_b(float(dataset["a"]), float(dataset["c"]))
    return b if np.isfinite(b) else None


def _mark_best_shape(axes: Axes, dataset: xr.Dataset, right: str) -> None:
    b = _best_shape(dataset)
    if right == "b" and b and dataset["b"].min() <= b <= dataset["b"].max():
        axes.axvline(b, color="white", linestyle="--", linewidth=1.2)
        axes.annotate(f"max L(f)\nb = {b:.2f}", (b, 0.99), xycoords=("data", "axes fraction"), color="white",
                      fontsize=7, va="top", xytext=(3, 0), textcoords="offset points")  # fmt: skip


def _colours(dataset: xr.Dataset, names: list[str]) -> tuple[Colormap, Normalize]:
    values = np.concatenate([np.ravel(dataset[name].values) for name in names])
    if "flag_values" in dataset[names[0]].attrs:
        n = len(dataset[names[0]].attrs["flag_values"])
        return ListedColormap(mpl.colormaps["tab10"].colors[:n]), BoundaryNorm(np.arange(n + 1) - 0.5, n)  # type: ignore[attr-defined]
    if values.dtype.kind == "i":
        return _count_colours(values)
    finite = values[np.isfinite(values)]
    low, high = (finite.min(), finite.max()) if len(finite) else (0.0, 1.0)
    if low > 0 and high > 100 * low:
        return mpl.colormaps["viridis"], LogNorm(low, high)
    return mpl.colormaps["viridis"], Normalize(low, high)


def _count_colours(values: Array) -> tuple[Colormap, BoundaryNorm]:
    """A colour for each integer; the rare few of the highest counts share the last one."""
    top = max(int(np.quantile(values, 0.995)), 1)
    unit = -(-(top + 1) // _MAX_COLOURS)
    edges = np.arange(-0.5, top + unit + 0.5, unit)
    over = values.max() > edges[-1]
    norm = BoundaryNorm(edges, len(edges) - 1 + over, extend="max" if over else "neither")
    return mpl.colormaps["viridis"].resampled(len(edges) - 1 + over), norm


def _label_bar(bar: Any, dataset: xr.Dataset, name: str, norm: Normalize) -> None:
    if isinstance(norm, BoundaryNorm):
        edges = np.asarray(norm.boundaries)
        unit = int(edges[1] - edges[0])
        first = (edges[:-1] + 0.5).astype(int)
        sparse = -(-len(first) // 12)
        labels = [("" if k % sparse else str(i)) if unit == 1 else f"{i}–{i + unit - 1}" for k, i in enumerate(first)]
        if meanings := dataset[name].attrs.get("flag_meanings"):
            labels = meanings.split()
        bar.set_ticks((edges[:-1] + edges[1:]) / 2, labels=labels, fontsize=7)
        bar.ax.tick_params(which="minor", length=0)


def _curves(dataset: xr.Dataset, names: list[str], across: list[str], panels: list[dict[str, int]]) -> Figure:
    figure = Figure(figsize=(7, 1.2 + 2.8 * len(panels)), dpi=110, layout="constrained")
    figure.suptitle(_heading(dataset), fontsize=10)
    rows = figure.subplots(len(panels), 1, squeeze=False, sharex=True)[:, 0]
    x = across[0] if across else None
    for axes, panel in zip(rows, panels, strict=True):
        for name in names:
            chosen = dataset.isel(panel)
            values = np.atleast_1d(chosen[name].values).astype(float)
            at = np.atleast_1d(dataset[x].values) if x else np.zeros(1)
            if name in _SIMULATED and "status" in chosen:
                failed = np.isin(np.atleast_1d(chosen["status"].values), (0, *FAILURES))
                values = np.where(failed, np.nan, values)
                if failed.any():
                    axes.plot(at[failed], np.zeros(failed.sum()), "v", color="crimson", label="no result")
            style: dict[str, Any] = (
                {"marker": "s", "fillstyle": "none"} if name == "reversals_predicted" else {"marker": "x"}
            )
            axes.plot(at, values, linestyle="none", label=_words(name), **style)
        if x == "b" and names[0] == "reversals":
            _add_form_factor(axes, dataset, panel)
        axes.set_ylabel("reversals" if len(names) > 1 else _words(names[0]))
        axes.set_title(_title(dataset, panel), fontsize=9)
        axes.grid(alpha=0.3)
        axes.legend(fontsize=7)
    rows[-1].set_xlabel(_symbol(x) if x else "")
    return figure


def _add_form_factor(axes: Axes, dataset: xr.Dataset, panel: dict[str, int]) -> None:
    twin = axes.twinx()
    twin.plot(dataset["b"], dataset.isel(panel)["form_factor"], color="0.5", linewidth=1)
    twin.set_ylabel("L(f)", color="0.4")
    twin.set_ylim(bottom=0)
    axes.set_ylim(bottom=0)
    if b := _best_shape(dataset):
        axes.axvline(b, color="0.5", linestyle="--", linewidth=1)
