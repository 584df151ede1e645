"""Sections of a report as text for the terminal, and as one HTML page that needs no network."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Iterable
from pathlib import Path

from matplotlib.figure import Figure

from sweep.report.rows import Row, Section
from sweep.results.writing import replacing

_HEAD = """<!doctype html><html lang="en"><meta charset="utf-8"><title>{title}</title>
<style>body{{font:15px/1.5 system-ui,sans-serif;max-width:75em;margin:2em auto;padding:0 1em}}
table{{border-collapse:collapse;width:100%;font-size:13px;margin:1em 0}}caption{{text-align:left;color:#555}}
td,th{{border:1px solid #ccc;padding:.3em .5em;text-align:left;vertical-align:top}}
.no{{background:#fdd}}.ok td:last-child{{color:#060}}.no td:last-child{{color:#a00}}
figure{{margin:1.5em 0}}img{{max-width:100%}}figcaption{{color:#555}}</style>"""


def text(section: Section) -> str:
    """A section as text for the terminal."""
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
    heads : column heads for the rows' source, expected and found
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    sections = list(sections)
    rows = [row for section in sections for row in section.rows]
    parts = [
        _HEAD.format(title=html.escape(title)),
        f"<h1>{html.escape(title)}</h1>",
        f"<p>{sum(row.holds for row in rows)} of {len(rows)} rows hold. {html.escape(about)}</p>",
    ]
    for section in sections:
        parts.append(f"<h2>{html.escape(section.title)}</h2>")
        if section.rows:
            parts.append(_rows(section.rows, heads))
        parts += [_table(caption, lines) for caption, lines in section.tables]
        parts += [_figure(caption, figure) for caption, figure in section.figures]
    with replacing(path) as temporary:
        temporary.write_text("\n".join(parts), encoding="utf-8")


def _rows(rows: list[Row], heads: tuple[str, str, str]) -> str:
    head = ("quantity", *heads, "difference", "tolerance", "reason for the tolerance", "remark", "verdict")
    lines = ["<table><tr>" + "".join(f"<th>{name}</th>" for name in head) + "</tr>"]
    for row in rows:
        cells = (row.what, row.source, row.expected, row.found, row.difference, row.tolerance, row.why, row.remark)
        verdict = "holds" if row.holds else "does not hold"
        shown = "".join(f"<td>{html.escape(cell)}</td>" for cell in (*cells, verdict))
        lines.append(f'<tr class="{"ok" if row.holds else "no"}">{shown}</tr>')
    return "\n".join([*lines, "</table>"])


def _table(caption: str, lines: list[list[str]]) -> str:
    head, *body = lines
    shown = ["<tr>" + "".join(f"<th>{html.escape(cell)}</th>" for cell in head) + "</tr>"]
    shown += ["<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in line) + "</tr>" for line in body]
    return f"<table><caption>{html.escape(caption)}</caption>{''.join(shown)}</table>"


def _figure(caption: str, figure: Figure) -> str:
    stream = io.BytesIO()
    figure.savefig(stream, format="png")
    picture = base64.b64encode(stream.getvalue()).decode()
    words = html.escape(caption)
    return f'<figure><img alt="{words}" src="data:image/png;base64,{picture}"><figcaption>{words}</figcaption></figure>'
