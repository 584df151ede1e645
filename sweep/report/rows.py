"""Defines rows of a report: statements, our results, and whether the two agree."""

from __future__ import annotations

from dataclasses import dataclass, field

from matplotlib.figure import Figure

Table = tuple[str, list[list[str]]]
"""Caption and lines; the first line is the head."""


@dataclass(frozen=True)
class Row:
    what: str
    source: str
    """Equation, figure, section or method being tested."""
    expected: str
    found: str
    difference: str
    tolerance: str
    why: str
    """The reason for the tolerance."""
    holds: bool
    remark: str = ""
    """Our result where the source is wrong or silent."""


@dataclass
class Section:
    """Rows, figures and tables under one heading."""

    title: str
    rows: list[Row] = field(default_factory=list)
    figures: list[tuple[str, Figure]] = field(default_factory=list)
    """Caption and figure."""
    tables: list[Table] = field(default_factory=list)


def against(what: str, source: str, expected: float, found: float, tolerance: float, why: str, remark: str = "") -> Row:
    """Compare a number with the expected one to an absolute tolerance."""
    numbers = (f"{expected:.6g}", f"{found:.6g}", f"{found - expected:.2g}", f"{tolerance:.2g}")
    return Row(what, source, *numbers, why, abs(found - expected) <= tolerance, remark)


def below(what: str, source: str, found: float, bound: float, why: str) -> Row:
    """Check that a number stays below a bound."""
    return Row(what, source, f"< {bound:g}", f"{found:.3g}", "", f"{bound:g}", why, found < bound)


def states(
    what: str, source: str, expected: str, found: str, holds: bool, remark: str = "", why: str = "a statement"
) -> Row:
    """Record whether a computation confirms a statement in words."""
    return Row(what, source, expected, found, "", "", why, holds, remark)
