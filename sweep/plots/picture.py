"""The picture of a dataset, from the dataset alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import xarray as xr
from matplotlib.figure import Figure

from sweep.plots import boundaries, critical, curves, fit, indices, maps, panels, probabilities, scales, trajectories
from sweep.plots.formats import A_PICTURE, PICTURES, suffix
from sweep.plots.quantities import subject
from sweep.plots.scales import Limits
from sweep.results.kind import BOUNDARIES, CRITICAL, FIT, INDICES, RUN, TRAJECTORY, kind
from sweep.results.netcdf import open_dataset
from sweep.results.writing import replacing

_NO_DATE: dict[str, dict[str, Any]] = {"png": {}, "pdf": {"CreationDate": None}, "svg": {"Date": None}}
_DPI = 110


_OWN = {BOUNDARIES: boundaries.draw, FIT: fit.draw, INDICES: indices.draw}
"""Kinds of dataset that have one picture each."""

Source = xr.Dataset | str | Path
"""A dataset, or the path of its file."""


def plot(
    dataset: Source | Sequence[Source],
    variable: str | None = None,
    *,
    x: str | None = None,
    y: str | None = None,
    sel: Mapping[str, float] | None = None,
    limits: Limits | None = None,
    cmap: str | None = None,
    output: str | Path | None = None,
) -> Figure:
    """Draw a dataset of a sweep, of single trajectories, of critical spins, of boundaries or of a fit.

    Parameters
    ----------
    dataset : a dataset, or the path of its file.  Of several, maps of one variable are drawn side by side, with one
        scale
    variable : of the dataset, or one of `sweep.plots.quantities.DERIVED`; by default what the run's `measure` names
        first, or else the reversals.  Beside these and beside `t_first_reversal` stand their prediction and how the
        two compare: the `difference` or the `ratio`
    x, y : the axes drawn across and upwards; by default the first two of more than four values.  Every combination of
        the values of the other axes gets a panel, up to eight
    sel : values by axis, such as ``{"n0": 0.05}``; the nearest one that the dataset has is drawn
    limits : lowest and highest value of the scale
    cmap : name of a colour map of matplotlib
    output : file to write; its suffix names the format: png, pdf or svg

    Returns
    -------
    The figure.  Boundaries and fits have figures of their own, as the command draws them that finds them, and so have
    critical spins and trajectories of which no `variable` is named.

    Raises
    ------
    ValueError
        if the dataset has no such variable or axis, would need too many panels, or there is no such format.
    StoreError
        if the file is not a dataset, or `output` cannot be written.
    """
    if output is not None and suffix(Path(output)) not in PICTURES:
        raise ValueError(f"output: {output}: unknown format; write a {A_PICTURE}")
    if limits is not None and not limits[0] < limits[1]:
        raise ValueError(f"limits: {limits[0]:g}..{limits[1]:g}; give a lower and a higher number")
    if cmap is not None:
        scales.colour_map(cmap)  # raises if there is none
    several = [dataset] if isinstance(dataset, Source) else dataset
    opened = [each if isinstance(each, xr.Dataset) else open_dataset(Path(each)) for each in several]
    figure = _drawn(opened, variable, {"x": x, "y": y, "sel": sel}, {"limits": limits, "cmap": cmap})
    if output is not None:
        save(figure, Path(output))
    return figure


def _drawn(datasets: list[xr.Dataset], variable: str | None, axes: dict[str, Any], colours: dict[str, Any]) -> Figure:
    """The figure of datasets, of whatever kind they are."""
    kinds = {kind(each) for each in datasets}
    if len(datasets) != 1:
        if kinds != {RUN}:
            raise ValueError("several datasets can be drawn side by side only if each is of a run")
        common = variable or subject(datasets[0])
        return maps.draw_beside([panels.choose(each, common, **axes) for each in datasets], **colours)
    (dataset,), (found,) = datasets, kinds
    if found in _OWN and variable is not None:
        raise ValueError(f"variable: not for a figure of {found}, which draws what it is; leave it out")
    if found in (TRAJECTORY, *_OWN) or (found == CRITICAL and variable is None):
        if given := [name for name, value in {**axes, **colours}.items() if value]:
            raise ValueError(f"{given[0]}: not for a figure of {found}; name it for the maps of a run alone")
        if found == TRAJECTORY:
            return trajectories.draw(dataset, variable)
        return {**_OWN, CRITICAL: critical.draw}[found](dataset)
    chosen = panels.choose(dataset, variable, **axes)
    if chosen.names == ["probability"] and len(chosen.across) < 2:
        return probabilities.draw(chosen)
    return maps.draw(chosen, **colours) if len(chosen.across) == 2 else curves.draw(chosen, colours["limits"])


def save(figure: Figure, path: Path) -> None:
    """Write a figure in the format that the suffix names; the same figure gives the same bytes."""
    form = suffix(path)
    with replacing(path) as temporary, mpl.rc_context({"svg.hashsalt": "sweep"}):
        dpi = _DPI if form == "png" else 2 * _DPI
        figure.savefig(temporary, format=form, dpi=dpi, metadata=_NO_DATE[form])
