"""The picture of a dataset, from the dataset alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import xarray as xr
from matplotlib.figure import Figure

from sweep.plots import beside, critical, curves, maps, panels, scales, trajectories
from sweep.plots.quantities import subject
from sweep.plots.scales import Limits
from sweep.results.kind import CRITICAL, TRAJECTORY, kind
from sweep.results.netcdf import open_dataset
from sweep.results.writing import replacing

FORMATS = ("png", "pdf", "svg")
"""Formats that a figure can be saved in, each named by the suffix of the file."""

ALLOWED = f"a file that ends in .{', .'.join(FORMATS)}"

_NO_DATE: dict[str, dict[str, Any]] = {"png": {}, "pdf": {"CreationDate": None}, "svg": {"Date": None}}
_DPI = 110


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
    """Draw a dataset of a sweep, of single trajectories or of critical spins.

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
    The figure.  Critical spins and trajectories of which no `variable` is named have figures of their own, as the
    commands draw them that find them.

    Raises
    ------
    ValueError
        if the dataset has no such variable or axis, would need too many panels, or there is no such format.
    StoreError
        if the file is not a dataset, or `output` cannot be written.
    """
    if output is not None and suffix(Path(output)) not in FORMATS:
        raise ValueError(f"output: {output}: unknown format; allowed: {ALLOWED}")
    several = [dataset] if isinstance(dataset, Source) else dataset
    opened = [each if isinstance(each, xr.Dataset) else open_dataset(Path(each)) for each in several]
    figure = draw(opened, variable, x=x, y=y, sel=sel, limits=limits, cmap=cmap)
    if output is not None:
        save(figure, Path(output))
    return figure


def draw(
    dataset: xr.Dataset | Sequence[xr.Dataset],
    variable: str | None = None,
    *,
    x: str | None = None,
    y: str | None = None,
    sel: Mapping[str, float] | None = None,
    limits: Limits | None = None,
    cmap: str | None = None,
) -> Figure:
    """The figure of a dataset, or of several; parameters and errors as of `plot`."""
    if limits is not None and not limits[0] < limits[1]:
        raise ValueError(f"limits: {limits[0]:g}..{limits[1]:g}; allowed: a lower and a higher number")
    if cmap is not None:
        scales.colour_map(cmap)  # raises if there is none
    if not isinstance(dataset, xr.Dataset):
        if len(dataset) != 1:
            return _beside(dataset, variable, limits, cmap, x=x, y=y, sel=sel)
        (dataset,) = dataset
    found = kind(dataset)
    if found == TRAJECTORY or (found == CRITICAL and variable is None):
        given = {"x": x, "y": y, "limits": limits, "cmap": cmap, "sel": sel or None}
        if beyond := [name for name, value in given.items() if value is not None]:
            raise ValueError(f"{beyond[0]}: not for a figure of {found}; allowed: maps of a run")
        return trajectories.draw(dataset, variable) if found == TRAJECTORY else critical.draw(dataset)
    chosen = panels.choose(dataset, variable, x=x, y=y, sel=sel)
    return maps.draw(chosen, limits, cmap) if len(chosen.across) == 2 else curves.draw(chosen, limits)


def _beside(
    datasets: Sequence[xr.Dataset], variable: str | None, limits: Limits | None, cmap: str | None, **axes: Any
) -> Figure:
    """The figure of several datasets."""
    if not datasets or any(kind(each) in (CRITICAL, TRAJECTORY) for each in datasets):
        raise ValueError("several datasets; allowed: side by side, those of runs")
    common = variable or subject(datasets[0])
    return beside.draw([panels.choose(each, common, **axes) for each in datasets], limits, cmap)


def suffix(path: Path) -> str:
    """The format that a file's suffix names."""
    return path.suffix.removeprefix(".").lower()


def save(figure: Figure, path: Path) -> None:
    """Write a figure in the format that the suffix names; the same figure gives the same bytes."""
    form = suffix(path)
    with replacing(path) as temporary, mpl.rc_context({"svg.hashsalt": "sweep"}):
        dpi = _DPI if form == "png" else 2 * _DPI
        figure.savefig(temporary, format=form, dpi=dpi, metadata=_NO_DATE[form])
