"""Renders sections of a report as text for the terminal, and as one HTML page that needs no network."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterable
from pathlib import Path

from jinja2 import Environment, PackageLoader
from matplotlib.figure import Figure

from sweep.report.rows import Section
from sweep.results.writing import replacing


def text(section: Section) -> str:
    """Return a section as text for the terminal."""
    lines = [f"\n{section.title}"]
    for row in section.rows:
        verdict, expected = "ok  " if row.holds else "FAIL", f"(expected: {row.expected})"
        lines.append(f"  {verdict} {row.what} [{row.source}]: {row.found} {expected} {row.remark}".rstrip())
    for caption, table in section.tables:
        widths = [max(map(len, column)) for column in zip(*table, strict=True)]
        lines.append(f"  {caption}")
        lines += ["  " + "  ".join(map(str.ljust, line, widths)).rstrip() for line in table]
    return "\n".join(lines)


def write(path: Path, title: str, about: str, sections: Iterable[Section], heads: tuple[str, str, str]) -> None:
    """Write the sections as one HTML page.

    Parameters
    ----------
    about : a line for the top of the page, after the number of rows that hold
    heads : column headings for the rows' source, expected and found
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    sections = list(sections)
    holding = [row.holds for section in sections for row in section.rows]
    page = Environment(loader=PackageLoader("sweep.report", ""), autoescape=True, trim_blocks=True, lstrip_blocks=True)
    html = page.get_template("page.html").render(
        title=title, about=about, sections=sections, holding=sum(holding), rows=len(holding), png=_png,
        heads=("quantity", *heads, "difference", "tolerance", "reason for the tolerance", "remark", "verdict"),
    )  # fmt: skip
    with replacing(path) as temporary:
        temporary.write_text(html, encoding="utf-8")


def _png(figure: Figure) -> str:
    """Return the figure as a PNG in base64."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png")
    return base64.b64encode(stream.getvalue()).decode()
