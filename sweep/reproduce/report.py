"""Writes the report: all sections in order, on one page."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from sweep.report import page
from sweep.report.rows import Row, Section
from sweep.reproduce import simulations, theory

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
    """Run all sections, write reproduce.html to `output`, and return the rows that do not agree."""
    sections = []
    for make in SECTIONS:
        sections.append(make())
        note(page.text(sections[-1]))
    page.write(
        output / "reproduce.html",
        "Takano (2011), “Spin reversal of a rattleback with viscous friction”, reproduced",
        "All numbers and figures were computed in this run.",
        sections,
        ("source", "paper", "ours"),
    )
    return [row for section in sections for row in section.rows if not row.holds]
