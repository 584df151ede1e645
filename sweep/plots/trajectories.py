"""Pictures of dense trajectories."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from sweep.faults import fault_of
from sweep.grid import SAMPLE, Array
from sweep.kernels.status import SETTLED
from sweep.models.general import rigid_body
from sweep.models.general.surfaces import ELLIPSOID, SURFACES
from sweep.plots import labels, theory
from sweep.plots.figure import Sheet, is_column, panel_width, zero_line
from sweep.results import kind
from sweep.results.dataset import SERIES, TRAJECTORIES, along_one
from sweep.results.kind import is_of_own_body, parameters

# Titles, and the series drawn together; panels are in pairs.
_PANELS: tuple[tuple[str, dict[str, str]], ...] = (
    ("contact point along x", {"contact_x": "x"}),
    ("contact point along y", {"contact_y": "y"}),
    ("normal coordinate X", {"mode_1": "X"}),
    ("normal coordinate Y", {"mode_2": "Y"}),
    ("amplitude A of the first mode", {"amplitude_1": "A"}),
    ("amplitude B of the second mode", {"amplitude_2": "B"}),
    ("acceleration along x", {"v0_rate_1": "of rolling", "slip_rate_1": "of slip"}),
    ("acceleration along y", {"v0_rate_2": "of rolling", "slip_rate_2": "of slip"}),
    ("normal force R per mass", {"normal_force": "R"}),
    ("energy per mass", {"energy": "above rest", "dissipated": "work against friction"}),
)

_MOST_ENTRIES = 12
"""Largest number of trajectories named in the legend."""

_SHADES = (0.55, 1.0)
"""Opacity of the first and of the second series of a panel."""

_STILL = 0.05
"""Share of the range of a series below which a change does not count as an event."""

_WHILE = 1.4
"""End of the time axis, relative to the time of the last event."""

_ENDLESS = ("heading", "table_x", "table_y")
"""Series that keep changing while a body spins steadily."""


def draw(dataset: xr.Dataset, variable: str | None = None) -> Sheet:
    """Draw the spin with its reversals and critical values over time, and below it the other series of the dataset.

    The time axis ends a while after the last event (`lively_until`).  In a column of text, only the spin is drawn.

    Parameters
    ----------
    variable : the series to draw alone

    Raises
    ------
    InputError
        if there is no such series.
    """
    dataset = along_one(dataset)
    series = [str(name) for name, v in dataset.data_vars.items() if "time" in v.dims]
    if variable is not None and variable not in series:
        raise fault_of(f"there is no series {variable}; choose {', '.join(series)}", "variable")
    alone = variable is not None or SAMPLE in dataset.coords or is_column()
    panels = [panel for panel in _PANELS if not panel[1].keys() - dataset.data_vars.keys() and not alone]
    if not alone:
        known = {"spin", "ripple_free_spin", *(name for _, names in _PANELS for name in names)}
        further = [name for name in series if name not in known and (is_of_own_body(dataset) or name in SERIES)]
        panels += [(labels.words(dataset, name), {name: name}) for name in further]
    rows = -(-len(panels) // 2)
    figure = Sheet(constants_apart(dataset), panel_width(1, 11, 0), 4.2 + 1.9 * rows)
    grid = figure.add_gridspec(1 + rows, 2, height_ratios=[2] + [1] * rows)
    first = figure.add_subplot(grid[0, :])
    only = {} if variable in (None, "spin") else {variable: labels.words(dataset, variable)}
    entries = _series(first, dataset, only) if only else _spin(first, dataset)
    first.set_xlim(0, lively_until(dataset) or None)  # a body may fail at its first instant
    odd = len(panels) % 2  # the last of an odd number of panels is as wide as the spin
    places = [grid[1 + k // 2, k % 2 if k + odd < len(panels) else slice(None)] for k in range(len(panels))]
    below = [figure.add_subplot(place, sharex=first) for place in places]
    for axes, (title, names) in zip(below, panels, strict=True):
        _series(axes, dataset, names)
        axes.set_title(title, loc="left")
    lowest = (below or [first])[-1 if odd else -2 :]
    for axes in (first, *below):
        axes.tick_params(labelbottom=axes in lowest or axes is first)
    for axes in lowest:
        axes.set_xlabel(labels.label(dataset, "time"))
    figure.explain(entries)
    return figure


def draw_spin(axes: Axes, dataset: xr.Dataset, critical: bool = True) -> None:
    """n(t) of each trajectory with its reversals as dots, and the critical spins of each body as lines."""
    dataset = along_one(dataset)
    axes.legend(handles=_spin(axes, dataset, critical), fontsize="x-small")
    axes.set_xlabel(labels.label(dataset, "time"))


def _spin(axes: Axes, dataset: xr.Dataset, critical: bool = True) -> list[Artist]:
    """Draw the spins; returns the entries for the legend."""
    for i, times in enumerate(map(reversal_times, each(dataset))):
        axes.plot(times, np.zeros(len(times)), "o", color=f"C{i}", markersize=4)
    entries = _series(axes, dataset, {"spin": "spin n"})
    zero_line(axes)
    entries.append(Line2D([], [], linestyle="none", marker="o", color="0.4", markersize=4, label="reversal"))
    # Each sample may be a different body.
    return entries + (_critical_spins(axes, dataset) if critical and SAMPLE not in dataset.coords else [])


def _series(axes: Axes, dataset: xr.Dataset, names: dict[str, str]) -> list[Artist]:
    """Draw series of all trajectories, in their colours; returns the entries of the trajectories for the legend."""
    first = next(iter(names))
    axes.set_ylabel(labels.with_unit(names[first] if len(names) == 1 else "", labels.unit(dataset, first)))
    entries: list[Artist] = []
    # Oscillations are so dense that an opaque curve would hide those below it.
    alone = dataset.sizes[TRAJECTORIES] == 1 or "spin" in names
    shades = _SHADES if len(names) > 1 else (1.0 if alone else 0.7,)
    for i, one in enumerate(each(dataset)):
        for shade, name in zip(shades, names, strict=True):
            (line,) = axes.plot(one["time"], one[name], linewidth=0.8, color=f"C{i}", alpha=shade)
            line.set(label=label(dataset, i), gid=name, rasterized=one.sizes[one[name].dims[0]] > 5000)
        if i < _MOST_ENTRIES:
            entries.append(Line2D([], [], color=f"C{i}", label=label(dataset, i)))
    if (more := dataset.sizes[TRAJECTORIES] - _MOST_ENTRIES) > 0:
        entries.append(Line2D([], [], linestyle="none", label=f"and {more} more"))
    if len(names) > 1:
        named = zip(shades, names.values(), strict=True)
        styles = [Line2D([], [], color=mpl.rcParams["text.color"], alpha=shade, label=words) for shade, words in named]
        axes.legend(
            handles=styles, ncols=2, frameon=False, loc="lower right", bbox_to_anchor=(1, 0.98),
            borderaxespad=0.2,
        )  # fmt: skip
    return entries


def _critical_spins(axes: Axes, dataset: xr.Dataset) -> list[Artist]:
    """Draw lines at the critical spins of each body; among several bodies, in the colour of its first trajectory."""
    bodies: dict[tuple[tuple[str, str, float, str], ...], int] = {}
    for i, one in enumerate(each(dataset)):
        bodies.setdefault(tuple(theory.levels(one)), i)
    entries: dict[str, Line2D] = {}
    for body, i in bodies.items():
        colour = "0.4" if len(bodies) == 1 else f"C{i}"
        for name, _, at, source in body:
            style: Any = {"linestyle": theory.OVER_TIME[name], "linewidth": 0.9}
            axes.axhline(at, color=colour, gid=name, **style)
            words = theory.words(name, source, over_n0=True)
            entries[name] = Line2D([], [], color=mpl.rcParams["text.color"], label=words, **style)
    return list(entries.values())


def lively_until(dataset: xr.Dataset) -> float:
    """Return the end of a time axis: a while after the last event, but not beyond the end of the series.

    The last event of a body that has settled is its last reversal.  For any other body it is the last notable change
    of a series other than heading and path, which change for ever.
    """
    last = max(_last_event(one) for one in each(dataset))
    end = float(dataset["time"].max())
    return min(_WHILE * last, end) if last else end


def each(dataset: xr.Dataset) -> list[xr.Dataset]:
    """Return the trajectories of a dataset, in the order of time."""
    listed = along_one(dataset).sortby("time")
    return [listed.isel({TRAJECTORIES: i}) for i in range(listed.sizes[TRAJECTORIES])]


def _last_event(one: xr.Dataset) -> float:
    """The time of the last event of one trajectory, as `lively_until` has it; zero if nothing happens."""
    reversals = reversal_times(one)
    if len(reversals) and "status" in one and one["status"] == SETTLED:
        return float(reversals[-1])
    at, last = one["time"].values, 0.0
    for values in (v.values for name, v in one.data_vars.items() if v.dims == ("time",) and name not in _ENDLESS):
        known = np.isfinite(values)
        change = np.abs(values[known] - values[known][-1:])
        last = max(last, at[known][change > _STILL * change.max(initial=0.0)].max(initial=0.0))
    return float(last)


def reversal_times(one: xr.Dataset) -> Array:
    """Find the times at which the spin of one trajectory changes sign, averaged over a period of the rattle.

    The period of a user-defined model is unknown, and its spin is taken as it is.
    """
    if "ripple_free_spin" not in one:
        return np.array([])
    time, spin = one["time"].values, one["ripple_free_spin"].values
    if not is_of_own_body(one):
        surface = SURFACES[one.attrs.get("surface", ELLIPSOID.name)]
        tau = float(rigid_body.slower_period(kind.body(one), surface)[0])
        total = np.concatenate([[0], np.cumsum(np.diff(time) * (spin[1:] + spin[:-1]) / 2)])
        ends = np.arange(0, time[-1], tau)
        time, spin = ends[:-1] + tau / 2, np.diff(np.interp(ends, time, total)) / tau
    at = np.flatnonzero(spin[1:] * spin[:-1] < 0)
    return np.asarray(time[at] + (time[at + 1] - time[at]) * spin[at] / (spin[at] - spin[at + 1]))


def label(dataset: xr.Dataset, i: int) -> str:
    """Return the name of a trajectory with its number of reversals."""
    counted = "reversals" in dataset and TRAJECTORIES not in dataset.coords
    return name(dataset, i) + (f": {labels.reversals(int(dataset['reversals'][i]))}" if counted else "")


def name(dataset: xr.Dataset, i: int) -> str:
    """Return the name of a trajectory, or the parameters that distinguish it from the others."""
    if TRAJECTORIES in dataset.coords:  # named, such as the film and its fit
        return str(dataset[TRAJECTORIES].values[i])
    names = _varying(dataset) or [name for name in ("n0", "omega3") if name in dataset]
    values = (labels.measured(dataset, name, float(np.ravel(dataset[name].values)[i])) for name in names)
    return ", ".join(values) or labels.words(dataset, "spin")


def constants_apart(dataset: xr.Dataset) -> xr.Dataset:
    """The dataset with the parameters that all trajectories share as scalar coordinates."""
    varying = _varying(dataset)
    names = [name for name in parameters(dataset) if name not in varying]
    shared = {name: ((), np.ravel(dataset[name])[0], dataset[name].attrs) for name in names}
    return dataset.drop_vars(names).assign_coords(shared)


def _varying(dataset: xr.Dataset) -> list[str]:
    """The parameters that differ between trajectories."""
    return [name for name in parameters(dataset) if np.unique(dataset[name]).size > 1]
