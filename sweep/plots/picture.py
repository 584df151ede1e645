"""The picture of a dataset, from the dataset alone."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import matplotlib as mpl
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.plots import (
    boundaries,
    critical,
    curves,
    fit,
    histograms,
    indices,
    labels,
    maps,
    panels,
    probabilities,
    scales,
    trajectories,
)
from sweep.plots.figure import Frames, Picture, framed, style
from sweep.plots.formats import A_PICTURE, PICTURES, suffix
from sweep.plots.quantities import DERIVED, subject
from sweep.plots.scales import Limits
from sweep.results.dataset import VARIABLES
from sweep.results.kind import BOUNDARIES, CRITICAL, FIT, INDICES, RUN, TRAJECTORY, kind
from sweep.results.netcdf import open_dataset
from sweep.results.writing import replacing
from sweep.units import LENGTH, quantity

_NO_DATE: dict[str, dict[str, Any]] = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}

_NARROWEST, _WIDEST = 0.05, 1.0
"""Metres of a figure across."""

_OWN: dict[str | None, Callable[[xr.Dataset], Picture]] = {
    TRAJECTORY: trajectories.draw, CRITICAL: critical.draw, BOUNDARIES: boundaries.draw, FIT: fit.draw,
    INDICES: indices.draw,
}  # fmt: skip
"""Kinds of dataset that have a picture of their own."""

Source = xr.Dataset | xr.DataArray | str | Path
"""A dataset, the path of its file, or a variable of it."""


def plot(
    dataset: Source | Sequence[Source],
    variable: str | None = None,
    *,
    x: str | None = None,
    y: str | None = None,
    sel: Mapping[str, float] | None = None,
    limits: Limits | None = None,
    cmap: str | None = None,
    contours: bool = False,
    histogram: bool = False,
    width: str | None = None,
    figsize: tuple[float, float] | None = None,
    title: bool = True,
    ax: Axes | None = None,
    output: str | Path | None = None,
) -> Figure:
    """Draw a dataset of a sweep, of single trajectories, of critical spins, of boundaries or of a fit.

    Parameters
    ----------
    dataset : a dataset, the path of its file, or one of its variables, whose cells have no marks, since the dataset
        knows of them.  Of several, maps of one variable are drawn side by side, with one scale
    variable : of the dataset, or one of `sweep.plots.quantities.DERIVED`; by default what the run's `measure` names
        first, or else the reversals.  Beside these and beside `t_first_reversal` stand their prediction and how the
        two compare: the `difference` or the `ratio`
    x, y : the axes drawn across and upwards; by default the first two of more than four values.  Every combination of
        the values of the other axes gets a panel, up to eight
    sel : values by axis, such as ``{"n0": 0.05}``; the nearest one that the dataset has is drawn
    limits : lowest and highest value of the scale
    cmap : name of a colour map of matplotlib
    contours : whether maps of real numbers have lines of equal value
    histogram : whether to draw, in place of maps or curves, how many of their cells have each value
    width : of a figure for print, with its unit, such as "85mm": no text is smaller than 6 points, and panels have
        letters.  By default the figure is for a screen, or as wide as matplotlib's `figure.figsize` if that was changed
    figsize : width and height in inches, by default as high as the panels need
    title : whether the figure has one
    ax : axes to draw one map or curve into, without title and legend.  A map is of `variable` alone, with a bar
    output : file to write; its suffix names the format: png, pdf, svg or eps

    Returns
    -------
    The figure.  Boundaries and fits have figures of their own, as the command draws them that finds them, and so have
    critical spins and trajectories of which no `variable` is named.

    Raises
    ------
    ValueError
        if the dataset has no such variable or axis, would need too many panels, or there is no such format or width.
        With `ax`, if there are several panels.
    StoreError
        if the file is not a dataset, or `output` cannot be written.

    Examples
    --------
    >>> maps = sweep.predict({"friction": {"mu": [20, 60, 130, 160, 200]}})
    >>> sweep.plot(maps, width="85mm", output="column.pdf").get_size_inches()[0] * 25.4
    np.float64(85.0)
    """
    if output is not None and suffix(Path(output)) not in PICTURES:
        raise ValueError(f"output: {output}: unknown format; write a {A_PICTURE}")
    if limits is not None and not limits[0] < limits[1]:
        raise ValueError(f"limits: {limits[0]:g}..{limits[1]:g}; give a lower and a higher number")
    if cmap is not None:
        scales.colour_map(cmap)  # raises if there is none
    opened = [_opened(each) for each in ([dataset] if isinstance(dataset, Source) else dataset)]
    if variable is None and isinstance(dataset, xr.DataArray):
        variable = str(dataset.name)
    axes, how = {"x": x, "y": y, "sel": sel}, {"limits": limits, "cmap": cmap, "contours": contours}
    if ax is not None:
        _draw_in(ax, opened, variable, axes, how, histogram=histogram)
        figure = cast(Figure, ax.get_figure(root=True))
    else:
        across = inches(width) if width is not None else None
        with mpl.rc_context(style(figsize[0] if figsize else across, printed=across is not None)):
            figure = _drawn(opened, variable, axes, how, histogram=histogram)
            if across:
                figure.letter()
        if figsize:
            figure.set_size_inches(figsize)
        if not title:
            figure.suptitle("")
    if output is not None:
        save(figure, Path(output))
    return figure


def _opened(source: Source) -> xr.Dataset:
    """A dataset, wherever it is.  A variable of one brings its coordinates along."""
    if isinstance(source, xr.DataArray):
        if source.name not in {*VARIABLES, *DERIVED}:
            raise ValueError(f"{source.name or 'an array without a name'} is no variable of a run; give the dataset")
        return source.to_dataset()
    return source if isinstance(source, xr.Dataset) else open_dataset(Path(source))


def _drawn(
    datasets: list[xr.Dataset], variable: str | None, axes: dict[str, Any], how: dict[str, Any], *, histogram: bool
) -> Picture:
    """The figure of datasets, of whatever kind they are."""
    kinds = {kind(each) for each in datasets}
    if len(datasets) != 1:
        if kinds != {RUN} or histogram:
            raise ValueError("several datasets can be drawn side by side only if each is of a run, and as maps")
        common = variable or subject(datasets[0])
        return maps.draw_beside([panels.choose(each, common, **axes, most=maps.MAX_VALUES) for each in datasets], **how)
    (dataset,), (found,) = datasets, kinds
    if found in _OWN and (found != CRITICAL or variable is None):
        if found != TRAJECTORY and variable is not None:
            raise ValueError(f"variable: not for a figure of {found}, which draws what it is; leave it out")
        if given := [name for name, value in {**axes, **how, "histogram": histogram}.items() if value]:
            raise ValueError(f"{given[0]}: not for a figure of {found}; name it for the maps of a run alone")
        return _OWN[found](dataset) if variable is None else trajectories.draw(dataset, variable)
    chosen = panels.choose(dataset, variable, **axes, most=None if histogram else maps.MAX_VALUES)
    if len(chosen.across) == 2 and not histogram:
        return maps.draw(chosen, **how)
    figure, frames = framed(chosen.dataset, chosen.each, _over(chosen, histogram=histogram))
    figure.explain(_fill(chosen, frames, how["limits"], histogram=histogram))
    return figure


def _draw_in(
    ax: Axes, datasets: list[xr.Dataset], variable: str | None, axes: dict[str, Any], how: dict[str, Any], *,
    histogram: bool,
) -> None:  # fmt: skip
    """Draw one map or curve into axes of the user."""
    if {kind(each) for each in datasets} != {RUN} or len(datasets) > 1:
        raise ValueError("ax: only a map or a curve of one run is drawn into given axes")
    chosen = panels.choose(datasets[0], variable, **axes, most=None if histogram else maps.MAX_VALUES)
    if len(chosen.each) > 1 or (chosen.names == ["probability"] and "count" in chosen.dataset.dims):
        raise ValueError(f"ax: {chosen.names[0]} needs more than one panel; select a value of each other axis")
    if len(chosen.across) == 2 and not histogram:
        maps.draw_in(ax, chosen, **how)
        return
    over = _over(chosen, histogram=histogram)
    ax.set_xlabel(labels.label(chosen.dataset, over) if over else "")
    _fill(chosen, [(ax, chosen.dataset.isel(chosen.each[0]))], how["limits"], histogram=histogram)


def _over(chosen: panels.Panels, *, histogram: bool) -> str:
    """What the axis across shows in a figure without maps."""
    return chosen.names[0] if histogram else next(iter(chosen.across), "")


def _fill(chosen: panels.Panels, frames: Frames, limits: Limits | None, *, histogram: bool) -> list[Artist]:
    """Draw the panels of a run that are no maps; returns the entries for their legend."""
    bars = chosen.names == ["probability"] and len(chosen.across) < 2
    if histogram and bars:
        raise ValueError("histogram: a probability is a share already; name another variable, such as reversals")
    if histogram:
        return histograms.draw(chosen, frames, limits)
    return probabilities.draw(chosen, frames, limits) if bars else curves.draw(chosen, frames, limits)


def inches(width: str) -> float:
    """A length such as "85mm" in inches; `ValueError` if it is none, or none for a figure."""
    length, error = quantity(width, LENGTH) or (0.0, 0.0)
    if error or not _NARROWEST <= length <= _WIDEST:
        span = f"between {_NARROWEST * 1e3:g} and {_WIDEST * 1e3:g} mm"
        raise ValueError(f"width: {width}; give a length {span} with its unit, such as 85mm, 8.5cm or 3.3in")
    return length / 0.0254


def save(figure: Figure, path: Path) -> None:
    """Write a figure in the format that the suffix names; the same figure gives the same bytes."""
    form = suffix(path)
    with replacing(path) as temporary:
        dpi = figure.dpi * (1 if form == "png" else 2)
        figure.savefig(temporary, format=form, dpi=dpi, metadata=_NO_DATE.get(form))
        if form == "eps":
            temporary.write_bytes(re.sub(rb"%%(CreationDate|Title): .*\n", b"", temporary.read_bytes()))
