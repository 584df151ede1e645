"""Pictures of dense trajectories."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.grid import Array
from sweep.models.rocking import slower_period
from sweep.plots.panels import symbol

# Title, unit, and the variables drawn together.
_PANELS = (
    ("contact point", "c", ("contact_x", "contact_y")),
    ("normal coordinates", "1", ("mode_1", "mode_2")),
    ("amplitudes", "1", ("amplitude_1", "amplitude_2")),
    ("along x: derivatives of v_p and v_0", "g", ("v0_rate_1", "slip_rate_1")),
    ("along y: derivatives of v_p and v_0", "g", ("v0_rate_2", "slip_rate_2")),
    ("normal force R", "m g", ("normal_force",)),
    ("energy above rest and work against friction", "m g c", ("energy", "dissipated")),
)


def draw(dataset: xr.Dataset) -> Figure:
    """The spin with its reversals and critical values over time, and below it whatever else the dataset has."""
    panels = [panel for panel in _PANELS if panel[2][0] in dataset]
    figure = Figure(figsize=(9, 3.2 + 1.9 * len(panels)), dpi=110, layout="constrained")
    rows = figure.subplots(1 + len(panels), 1, sharex=True, squeeze=False, height_ratios=[2] + [1] * len(panels))[:, 0]
    draw_spin(rows[0], dataset)
    rows[0].set_title(dataset.attrs.get("title", ""), fontsize=10)
    for axes, (title, unit, names) in zip(rows[1:], panels, strict=True):
        for i in range(dataset.sizes["trajectory"]):
            for k, name in enumerate(names):
                label = name.replace("_", " ") if i == 0 and len(names) > 1 else None
                axes.plot(dataset["time"][i], dataset[name][i], linewidth=0.7, color=f"C{i + 5 * k}", label=label)
        axes.set_title(title, fontsize=8, loc="left")
        axes.set_ylabel(unit)
        if len(names) > 1:
            axes.legend(fontsize=6, loc="upper right")
    rows[-1].set_xlabel("t / sqrt(c/g)")
    return figure


def draw_spin(axes: Axes, dataset: xr.Dataset, critical: bool = True) -> None:
    """n(t) of each trajectory with its reversals as dots, and the critical spins of the first trajectory as lines."""
    for i in range(dataset.sizes["trajectory"]):
        one = dataset.isel(trajectory=i)
        count = f": {int(one['reversals'])} reversals" if "reversals" in one else ""
        axes.plot(one["time"], one["spin"], linewidth=0.8, color=f"C{i}", label=_label(dataset, i) + count)
        times = reversal_times(one)
        axes.plot(times, np.zeros(len(times)), "o", color=f"C{i}", markersize=4)
    axes.axhline(0, color="black", linewidth=0.5)
    lines = {"n_c1_plus": ":", "n_c1_minus": ":", "n_c2_plus": "--", "n_c2_minus": "--"}
    for name, style in lines.items():
        if critical and name in dataset and np.isfinite(value := float(dataset[name][0])):
            axes.axhline(value, color="0.5", linestyle=style, linewidth=0.8)
            sign = {"plus": "+", "minus": "-"}[name.split("_")[2]]
            axes.annotate(f"n_{name[2:4]}{sign}", (1.0, value), xycoords=("axes fraction", "data"), fontsize=6)
    axes.set_ylabel("n / sqrt(g/c)")
    axes.legend(fontsize=7)


def reversal_times(one: xr.Dataset) -> Array:
    """Times at which the ripple-free spin of one trajectory, averaged over a period of the rattle, changes sign."""
    if "ripple_free_spin" not in one:
        return np.array([])
    good = np.isfinite(one["time"].values)
    time, spin = one["time"].values[good], one["ripple_free_spin"].values[good]
    columns = {name: np.atleast_1d(one[name].values) for name in ("a", "b", "c", "delta")}
    tau = float(slower_period(columns)[0])
    total = np.concatenate([[0], np.cumsum(np.diff(time) * (spin[1:] + spin[:-1]) / 2)])
    ends = np.arange(0, time[-1], tau)
    means = np.diff(np.interp(ends, time, total)) / tau
    at = np.flatnonzero(means[1:] * means[:-1] < 0)
    return np.asarray(ends[at] + tau * (0.5 + means[at] / (means[at] - means[at + 1])))


def _label(dataset: xr.Dataset, i: int) -> str:
    """The parameters that set this trajectory apart from the others."""
    varying = [n for n in ("mu", "b", "n0", "a", "c", "delta", "x0", "y0") if n in dataset and _varies(dataset, n)]
    return ", ".join(f"{symbol(n)} = {float(dataset[n][i]):g}" for n in varying or ["n0"])


def _varies(dataset: xr.Dataset, name: str) -> bool:
    return len(set(dataset[name].values)) > 1
