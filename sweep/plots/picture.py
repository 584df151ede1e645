"""The picture of a dataset, from the dataset alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import isfinite
from pathlib import Path
from typing import Any, cast

import matplotlib as mpl
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.config.document import is_number, plain_data
from sweep.faults import fault_of, local_path, refusal
from sweep.plots import (
    boundaries,
    critical,
    curves,
    fit,
    labels,
    maps,
    panels,
    scales,
    trajectories,
)
from sweep.plots.figure import Sheet, drawing, framed, is_column, style
from sweep.plots.formats import A_PICTURE, SUFFIXES, suffix
from sweep.plots.pictures import PICTURES
from sweep.plots.scales import Limits
from sweep.results.dataset import VARIABLES
from sweep.results.kind import (
    ATTRIBUTE,
    BOUNDARIES,
    CRITICAL,
    FIT,
    RUN,
    TRAJECTORY,
    Kind,
    kind,
    require_whole,
)
from sweep.results.netcdf import open_dataset
from sweep.results.writing import replacing
from sweep.units import LENGTH, quantity

_NO_DATE: dict[str, dict[str, Any]] = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}

_NARROWEST, _WIDEST = 0.05, 1.0
"""Largest width of a figure in metres."""

_OWN: dict[Kind, Callable[[xr.Dataset], Sheet]] = {
    TRAJECTORY: trajectories.draw,
    CRITICAL: critical.draw,
    BOUNDARIES: boundaries.draw,
    FIT: fit.draw,
}
"""Functions that draw the kinds of dataset other than maps and curves of a run."""


def plot(
    dataset: xr.Dataset | xr.DataArray | str | Path,
    variable: str | None = None,
    *,
    x: str | None = None,
    y: str | None = None,
    at: Mapping[str, float] | None = None,
    vmin: float | None = None,
    vmax: float | None = None,
    cmap: str | None = None,
    width: str | None = None,
    title: str | None = None,
    ax: Axes | None = None,
    output: str | Path | None = None,
) -> Figure:
    """Draw a dataset of a sweep, of single trajectories, of critical spins, of boundaries or of a fit.

    Parameters
    ----------
    dataset : a dataset, the path of its file, or one of its variables, whose cells then have no marks
    variable : a variable of the dataset, or one of `sweep.plots.pictures.PICTURES`.  A comparison of two variables is
        drawn next to both, except in a figure as narrow as a column of text.  The default is the first one that the
        configuration names under `picture`, or else the reversals, compared with the prediction if there is one
    x, y : the horizontal and the vertical axis; by default the first two with more than four values.  Every combination
        of the values of other axes gets a panel, up to eight
    at : values by axis, such as ``{"n0": 0.05}``; the nearest one in the dataset is drawn
    vmin, vmax : lowest and highest value of the scale, or of the vertical axis of curves; by default those drawn
    cmap : name of a colour map of matplotlib
    width : width of a figure for print, such as "85mm": no text is smaller than 6 points, except subscripts,
        and panels have letters.  By default the figure is for a screen, or as wide as your own `figure.figsize` of
        matplotlib.  The height follows from the panels
    title : title of the figure, "" for none; by default the title of the dataset
    ax : axes to draw one map or curve into, without title and legend.  Only `variable` is drawn, a map with a bar
    output : file to write; its suffix names the format: png, pdf or svg

    Returns
    -------
    The figure.  Boundaries and fits are drawn as by the commands that find them; so are critical spins and
    trajectories, if no `variable` is named.

    Raises
    ------
    InputError
        if the dataset has no such variable or axis, the format or the width is unknown, there are too many panels (with
        `ax`, more than one), or the figure is too narrow for them.
    FileError
        if the file is not a dataset, the dataset lacks what its figure needs, or `output` cannot be written.

    Examples
    --------
    >>> maps = sweep.predict({"friction": {"mu": [20, 60, 130, 160, 200]}})
    >>> sweep.plot(maps, width="85mm", output="column.pdf").get_size_inches()[0] * 25.4
    np.float64(85.0)
    """
    if output is not None and suffix(local_path(output)) not in SUFFIXES:
        raise fault_of(f"{output}: unknown format; write a {A_PICTURE}", "output")
    low, high = _limit(vmin, "vmin"), _limit(vmax, "vmax")
    if low is not None and high is not None and not low < high:
        raise fault_of(f"{high:g} is not above vmin, {low:g}; give a larger number", "vmax")
    if ax is not None and width is not None:
        raise fault_of("the given axes have their own size; leave it out", "width")
    if at is not None and not isinstance(at, Mapping):
        raise fault_of(refusal(at, "values by axis, such as {'n0': 0.05}"), "at")
    if title is not None and not isinstance(title, str):
        raise fault_of(refusal(title, "a text, or '' for none"), "title")
    if cmap is not None:
        scales.colour_map(cmap)  # raises if there is none
    if variable is None and isinstance(dataset, xr.DataArray):
        variable = str(dataset.name)
    opened = labels.escaped(_opened(dataset))
    axes, how = {"x": x, "y": y, "at": at}, {"limits": (low, high), "cmap": cmap}
    if ax is not None:
        _draw_in(ax, opened, variable, axes, how)
        figure = cast(Figure, ax.get_figure(root=True))
    else:
        across = inches(width) if width is not None else None
        with mpl.rc_context(style(across)):
            drawn = _drawn(opened, variable, axes, how)
            if across:
                drawn.letter()
            if title is not None:
                drawn.name(title)
        figure = drawn
    if output is not None:
        save(figure, local_path(output))
    return figure


def _opened(source: xr.Dataset | xr.DataArray | str | Path) -> xr.Dataset:
    """Return the dataset that is given, or read it; a variable brings its coordinates along."""
    if isinstance(source, xr.DataArray):
        if source.name not in {*VARIABLES, *PICTURES}:
            raise fault_of(f"{source.name or 'an array without a name'} is not a variable of a run; pass the dataset")
        return source.to_dataset().assign_attrs({ATTRIBUTE: RUN.name})
    if isinstance(source, xr.Dataset):
        return source
    return open_dataset(local_path(source, "dataset", "a dataset or the path of its file"))


def _drawn(dataset: xr.Dataset, variable: str | None, axes: dict[str, Any], how: dict[str, Any]) -> Sheet:
    """Draw a dataset of any kind."""
    of_kind = kind(dataset)
    if of_kind and of_kind in _OWN and (of_kind != CRITICAL or variable is None):
        low, high = how["limits"]
        options = {"variable": variable if of_kind != TRAJECTORY else None, **axes, "cmap": how["cmap"]}
        if given := [name for name, value in {**options, "vmin": low, "vmax": high}.items() if value not in (None, {})]:
            raise fault_of(f"not for a figure of {of_kind.words}; leave it out", given[0])
        require_whole(dataset)
        return _OWN[of_kind](dataset) if variable is None else trajectories.draw(dataset, variable)
    chosen = panels.choose(dataset, variable, **axes, alone=is_column())
    _require_scale(chosen, **how)
    if len(chosen.across) == 2:
        return maps.draw(chosen, **how)
    figure, frames = framed(chosen.dataset, chosen.each, next(iter(chosen.across), ""))
    figure.explain(curves.draw(chosen, frames, how["limits"]))
    return figure


def _draw_in(ax: Axes, dataset: xr.Dataset, variable: str | None, axes: dict[str, Any], how: dict[str, Any]) -> None:
    """Draw one map or curve into the user's axes."""
    if kind(dataset) not in (RUN, None):
        raise fault_of("only a map or a curve of a run is drawn into given axes", "ax")
    chosen = panels.choose(dataset, variable, **axes, alone=True)
    if len(chosen.each) > 1:
        raise fault_of(f"{chosen.names[0]} needs more than one panel; select a value of each other axis", "ax")
    _require_scale(chosen, **how)
    if len(chosen.across) == 2:
        maps.draw_in(ax, chosen, **how)
        return
    ax.set_xlabel(labels.label(chosen.dataset, chosen.across[0]) if chosen.across else "")
    curves.draw(chosen, [(ax, chosen.dataset.isel(chosen.each[0]))], how["limits"])


def _require_scale(chosen: panels.Panels, limits: Limits, cmap: str | None) -> None:
    """Raise an `InputError` for limits or a colour map that the chosen panels have no scale for."""
    name = chosen.names[0]
    if limits != scales.AUTO and labels.flag_words(chosen.dataset, name):
        option = "vmax" if limits[0] is None else "vmin"
        raise fault_of(f"{name} is drawn as categories, which have no scale; leave it out", option)
    if cmap is not None and len(chosen.across) < 2:
        raise fault_of(f"{name} is drawn as a curve, which has no colour scale; leave it out", "cmap")


def _limit(given: Any, option: str) -> float | None:
    """Return an end of the scale; None if it is not given."""
    if given is None:
        return None
    end = plain_data(given)
    if not (is_number(end) and isfinite(end)):
        raise fault_of(refusal(given, "a finite number"), option)
    if abs(end) > scales.LARGEST:
        raise fault_of(f"{end:g}; give a number from {-scales.LARGEST:g} to {scales.LARGEST:g}", option)
    return float(end)


def inches(width: str) -> float:
    """Return a length such as "85mm" in inches; `InputError` if it is not a length that a figure can have."""
    length, error = quantity(str(width), LENGTH) or (0.0, 0.0)
    if error or not _NARROWEST <= length <= _WIDEST:
        span = f"between {_NARROWEST * 1e3:g} and {_WIDEST * 1e3:g} mm"
        raise fault_of(f"{width}; give a length {span} with its unit, such as 85mm, 8.5cm or 3.3in", "width")
    return length / 0.0254


def save(figure: Figure, path: Path) -> None:
    """Write a figure in the format that the suffix names; the same figure gives the same bytes."""
    form = suffix(path)
    with replacing(path) as temporary, drawing():
        dpi = figure.dpi * (1 if form == "png" else 2)
        figure.savefig(temporary, format=form, dpi=dpi, metadata=_NO_DATE.get(form))
