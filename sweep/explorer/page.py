"""The page around the figures."""

from __future__ import annotations

import shlex
from importlib.resources import files
from pathlib import Path
from typing import Any

from bokeh.document import Document
from bokeh.themes import Theme
from jinja2 import Environment

from sweep.explorer import figure, style
from sweep.explorer.slices import Source
from sweep.plots import labels
from sweep.plots.description import Map
from sweep.plots.scales import Scale


def _text(name: str) -> str:
    return files("sweep.explorer").joinpath(name).read_text(encoding="utf-8")


PARTS: Any = Environment(autoescape=True).from_string(_text("page.parts.html")).module
"""Functions that make HTML: `cell`, `empty`, `hint`, `legend` and `notice`."""


def dress(document: Document, source: Source, query: str) -> None:
    """Give a document the page of the explorer, whose address shows `query`."""
    document.theme = Theme(Path(__file__).with_name("page.theme.yaml"))
    document.title = str(source.dataset.attrs.get("title", Path(source.name).name))
    document.template = _text("page.html")
    document.template_variables.update(
        css=_text("page.css"), js=_text("page.js"), query=query, heading=document.title,
        constants=labels.constants(source.dataset), command=f"python -m sweep explore {shlex.quote(source.name)}",
    )  # fmt: skip


def legend(part: Map, scale: Scale) -> str:
    """The patterns and lines that occur in a map, and the values beyond its scale, as HTML."""
    items = [(style.swatch(kind), words) for kind, words in part.legend.items()]
    lines = {line.words: figure.LINES[line.name] for line in part.lines}
    items += [(style.line(dash, width), words) for words, (dash, width) in lines.items()]
    return str(PARTS.legend(items, [*part.notes, *filter(None, [style.beyond(part, scale)])]))
