"""The page around the figures, live or as one file that needs neither server nor network."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Any

import xarray as xr
from bokeh.document import Document
from bokeh.embed import file_html
from bokeh.models import Column, Div
from bokeh.resources import INLINE
from jinja2 import Environment

from sweep.explorer import figure, state, style
from sweep.explorer.slices import Source
from sweep.plots import labels
from sweep.plots.description import Map
from sweep.plots.scales import Scale
from sweep.results.writing import replacing


def _text(name: str) -> str:
    return files("sweep.explorer").joinpath(name).read_text(encoding="utf-8")


PARTS: Any = Environment(autoescape=True).from_string(_text("page.parts.html")).module
"""Functions that make HTML: `cell`, `empty`, `hint`, `legend` and `notice`."""


def dress(document: Document, source: Source, query: str | None = None) -> None:
    """Give a document the page of the explorer; `query` is the address of a live one."""
    document.title = str(source.dataset.attrs.get("title", Path(source.name).name))
    document.template = _text("page.html")
    document.template_variables.update(
        css=_text("page.css"), js=_text("page.js"), live=query is not None, query=query, heading=document.title,
        constants=labels.constants(source.dataset),
    )  # fmt: skip


def legend(part: Map, scale: Scale) -> str:
    """The patterns and lines that occur in a map, and what lies beyond its scale, as HTML."""
    items = [(style.swatch(kind), words) for kind, words in part.legend.items()]
    lines = {line.words: figure.LINES[line.name] for line in part.lines}
    items += [(f"border-top:{2 * width}px {dash} currentColor", words) for words, (dash, width) in lines.items()]
    return str(PARTS.legend(items, style.beyond(part, scale)))


def save_html(
    dataset: xr.Dataset, path: Path, variable: str | None = None, x: str | None = None, y: str | None = None,
    at: dict[str, float] | None = None,
) -> None:  # fmt: skip
    """Write the map of a variable as one file that opens without network, with all values under the pointer.

    Parameters
    ----------
    variable : by default what the dataset is about
    x, y : axes; by default the two longest
    at : values on the other axes; by default the first

    Raises
    ------
    ValueError
        if there is no such variable, axis or value.
    StoreError
        if the dataset has no axis, or the file cannot be written.
    """
    source = Source(dataset)
    query = {"show": variable, "x": x, "y": y, **{d: f"{v!r}" for d, v in (at or {}).items()}}
    shown, faults = state.read({k: [v] for k, v in query.items() if v}, source, {})
    if faults:
        raise ValueError("; ".join(faults))
    drawn = figure.MapFigure(source, shown.x, shown.y)
    part, scale = drawn.show(shown)
    document = Document()
    document.add_root(Column(drawn.figure, drawn.cuts, sizing_mode="stretch_width", name="map"))
    document.add_root(Div(text=legend(part, scale), sizing_mode="stretch_width", name="legend"))
    dress(document, source)
    variables = document.template_variables
    rest = {*source.dims_of(shown.show), *source.dims} - {shown.x, shown.y}
    fixed = [labels.measured(source.dataset, d, source.axes[d].values[i]) for d, i in shown.at.items() if d in rest]
    variables["constants"] = ", ".join(filter(None, [*fixed, variables["constants"]]))
    html = file_html(document, INLINE, document.title, template=document.template, template_variables=variables)
    with replacing(path) as temporary:
        temporary.write_text(html, encoding="utf-8")
