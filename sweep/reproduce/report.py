"""The report: sections run one after the other, one HTML file that needs no network."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Callable
from pathlib import Path

from matplotlib.figure import Figure

from sweep.reproduce import simulations, theory
from sweep.reproduce.rows import Row, Section
from sweep.store import replacing

SECTIONS: tuple[Callable[[], Section], ...] = (
    theory.formulas,
    theory.consistency,
    simulations.slip_ratio,
    simulations.critical_spins,
    simulations.friction,
    simulations.count_against_friction,
    simulations.count_against_shape,
    simulations.ladder,
)


def reproduce(output: Path, note: Callable[[str], None] = lambda _: None) -> list[Row]:
    """Run all sections, write `output`/reproduce.html, return the rows that do not hold."""
    sections = []
    for make in SECTIONS:
        section = make()
        sections.append(section)
        note(f"\n{section.title}")
        for row in section.rows:
            note(f"  {'ok  ' if row.holds else 'FAIL'} {row.what}: {row.found} (expected: {row.expected}) {row.remark}")
        for caption, lines in section.tables:
            note("\n".join([f"  {caption}", *("  " + " | ".join(line) for line in lines)]))
    output.mkdir(parents=True, exist_ok=True)
    with replacing(output / "reproduce.html") as temporary:
        temporary.write_text(_page(sections), encoding="utf-8")
    return [row for section in sections for row in section.rows if not row.holds]


_HEAD = """<!doctype html><html lang="en"><meta charset="utf-8"><title>Takano (2011), reproduced</title>
<style>body{font:15px/1.5 system-ui,sans-serif;max-width:75em;margin:2em auto;padding:0 1em}
table{border-collapse:collapse;width:100%;font-size:13px}td,th{border:1px solid #ccc;padding:.3em .5em;text-align:left;
vertical-align:top}.no{background:#fdd}.ok td:last-child{color:#060}.no td:last-child{color:#a00}
figure{margin:1.5em 0}img{max-width:100%}figcaption{color:#555}</style>"""


def _page(sections: list[Section]) -> str:
    rows = [row for section in sections for row in section.rows]
    parts = [
        _HEAD,
        "<h1>Takano (2011), “Spin reversal of a rattleback with viscous friction”, reproduced</h1>",
        f"<p>{sum(row.holds for row in rows)} of {len(rows)} rows hold. All figures are computed in this run.</p>",
    ]
    for section in sections:
        parts.append(f"<h2>{html.escape(section.title)}</h2>")
        if section.rows:
            parts.append(_table(section.rows))
        for caption, lines in section.tables:
            parts.append(_plain_table(caption, lines))
        parts += [_figure(caption, figure) for caption, figure in section.figures]
    return "\n".join(parts)


def _table(rows: list[Row]) -> str:
    head = ("what", "source", "paper", "ours", "difference", "tolerance", "why", "what was found", "verdict")
    lines = ["<table><tr>" + "".join(f"<th>{name}</th>" for name in head) + "</tr>"]
    for row in rows:
        cells = (row.what, row.source, row.expected, row.found, row.difference, row.tolerance, row.why, row.remark)
        verdict = "holds" if row.holds else "does not hold"
        shown = "".join(f"<td>{html.escape(cell)}</td>" for cell in (*cells, verdict))
        lines.append(f'<tr class="{"ok" if row.holds else "no"}">{shown}</tr>')
    return "\n".join([*lines, "</table>"])


def _plain_table(caption: str, lines: list[list[str]]) -> str:
    head, *body = lines
    shown = ["<tr>" + "".join(f"<th>{html.escape(cell)}</th>" for cell in head) + "</tr>"]
    shown += ["<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in line) + "</tr>" for line in body]
    return f"<table><caption>{html.escape(caption)}</caption>{''.join(shown)}</table>"


def _figure(caption: str, figure: Figure) -> str:
    stream = io.BytesIO()
    figure.savefig(stream, format="png")
    picture = base64.b64encode(stream.getvalue()).decode()
    text = html.escape(caption)
    return f'<figure><img alt="{text}" src="data:image/png;base64,{picture}"><figcaption>{text}</figcaption></figure>'
