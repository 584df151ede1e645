"""The page around the figures, live or as one file that needs neither server nor network."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import xarray as xr
from bokeh.document import Document
from bokeh.embed import file_html
from bokeh.models import Column, Div
from bokeh.resources import INLINE

from sweep.explore import figure, state
from sweep.explore.colours import Scale
from sweep.explore.controls import escaped
from sweep.explore.lines import Lines, critical_lines
from sweep.explore.slices import Slice, Source
from sweep.plots import labels
from sweep.results.writing import replacing

_MOST_VALUES = 8_000_000
"""Numbers in a page that stands alone, at most: of larger maps it tells only what matters most."""

# Patterns as in page.js, for the legend.
_SWATCHES = {
    "not_run": "#9ea3a8",
    "failed": "repeating-linear-gradient(45deg,#9ea3a8 0 1px,transparent 1px 6px),"
    "repeating-linear-gradient(-45deg,#9ea3a8 0 1px,transparent 1px 6px),#404347",
    "impossible": "repeating-linear-gradient(0deg,#474340 0 1px,transparent 1px 6px),#9ea3a8",
    "no_value": "#9ea3a8",
    "time_limit": "repeating-linear-gradient(45deg,#fff 0 1px,#222 1px 2px,transparent 2px 6px),#21918c",
    "inferred": "radial-gradient(circle at 2px 2px,#fff 1px,transparent 1.4px) 0 0/5px 5px,#21918c",
    "noise_limited": "repeating-linear-gradient(0deg,#fff 0 1px,#222 1px 2px,transparent 2px 6px),#21918c",
    "uncertain": "repeating-linear-gradient(90deg,#fff 0 1px,#222 1px 2px,transparent 2px 6px),#21918c",
}


def _text(name: str) -> str:
    return files("sweep.explore").joinpath(name).read_text(encoding="utf-8")


def dress(document: Document, source: Source, *, live: bool) -> None:
    """Give a document the page of the explorer."""
    heading, constants = headings(source)
    document.title = heading
    document.template = _text("page.html")
    document.template_variables.update(
        css=_text("page.css"), js=_text("page.js"), live=live, heading=heading, constants=constants
    )


def headings(source: Source) -> tuple[str, str]:
    """The title of the page, and under it what is the same in the whole dataset."""
    return str(source.dataset.attrs.get("title", Path(source.name).name)), labels.constants(source.dataset)


def legend(part: Slice, colours: Scale, lines: Sequence[Lines]) -> str:
    """The patterns and lines that occur in a map, and what lies beyond its scale, as HTML."""
    swatch = "display:inline-block;width:26px;height:14px;border:1px solid #8a949e;border-radius:2px;flex:none"
    items = [
        f'<span style="display:inline-flex;gap:7px;align-items:center">'
        f'<i style="{swatch};background:{_SWATCHES[kind]}"></i>{escaped(words)}</span>'
        for kind, words in part.legend.items()
    ]
    for each in lines:
        style = f"width:26px;border-top:2px {figure.DASHES[each.name]} #000;flex:none"
        name = f"n_{each.name[2:]}" if "n0" in (part.x.name, part.y.name) else f"n₀ = n_{each.name[2:]}"
        items.append(
            f'<span style="display:inline-flex;gap:7px;align-items:center"><i style="{style}"></i>'
            f"{name} ({each.source}): {each.words}</span>"
        )
    if colours.beyond:
        items.append(f"<span>{escaped(colours.beyond)}</span>")
    return f'<div style="display:flex;flex-wrap:wrap;gap:4px 18px;font-size:12.5px">{"".join(items)}</div>'


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
    part, columns = _all_values(source, shown)
    lines = critical_lines(source, part, shown.at)
    drawn = figure.Map(source, part.x, part.y)
    colours = drawn.show(part, columns, lines)
    document = Document()
    document.add_root(Column(drawn.figure, sizing_mode="stretch_width", name="map"))
    document.add_root(Div(text=legend(part, colours, lines), sizing_mode="stretch_width", name="legend"))
    dress(document, source, live=False)
    rest = _rest(source, shown)
    fixed = [labels.measured(source.dataset, d, source.axes[d].values[i]) for d, i in shown.at.items() if d in rest]
    document.template_variables["constants"] = ", ".join([*fixed, document.template_variables["constants"]])
    with replacing(path) as temporary:
        temporary.write_text(_html(document), encoding="utf-8")


def _rest(source: Source, shown: state.State) -> set[str]:
    return {*source.dims_of(shown.show), *source.dims} - {shown.x, shown.y}


def _all_values(source: Source, shown: state.State) -> tuple[Slice, dict[str, Any]]:
    """The slice, and the tables of all its variables; of a large map only the counts and how they came about."""
    plain = [n for n in source.variables if source.dims_of(n) <= set(source.dims)]
    cells = len(source.axes[shown.x].values) * (len(source.axes[shown.y].values) if shown.y else 1)
    if cells * len(plain) > _MOST_VALUES:
        plain = [n for n in plain if n in (shown.show, "reversals", "reversals_predicted", "difference", "status")]
    part = source.slice(shown.show, shown.x, shown.y, shown.at, tuple(plain))
    return part, {n: part.dataset[n].values for n in plain}


def _html(document: Document) -> str:
    variables = document.template_variables
    return str(file_html(document, INLINE, document.title, template=_text("page.html"), template_variables=variables))
