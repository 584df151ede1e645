"""A statement, what we find, and whether the two agree."""

from __future__ import annotations

from dataclasses import dataclass, field

from matplotlib.figure import Figure


@dataclass(frozen=True)
class Row:
    what: str
    source: str
    """Label of an equation or figure, a section, or the method that is tried."""
    expected: str
    found: str
    difference: str
    tolerance: str
    why: str
    """Where the tolerance comes from."""
    holds: bool
    remark: str = ""
    """What was found where the source is wrong or silent."""


@dataclass
class Section:
    """Rows, figures and tables under one heading of the report."""

    title: str
    rows: list[Row] = field(default_factory=list)
    figures: list[tuple[str, Figure]] = field(default_factory=list)
    """Caption and figure."""
    tables: list[tuple[str, list[list[str]]]] = field(default_factory=list)
    """Caption and lines, the first of them the head."""


def against(what: str, source: str, expected: float, found: float, tolerance: float, why: str, remark: str = "") -> Row:
    difference = found - expected
    holds = abs(difference) <= tolerance
    return Row(
        what, source, f"{expected:.6g}", f"{found:.6g}", f"{difference:.2g}", f"{tolerance:.2g}", why, holds, remark
    )


def below(what: str, source: str, found: float, bound: float, why: str, remark: str = "") -> Row:
    """Something that must not exceed a bound."""
    return Row(what, source, f"< {bound:g}", f"{found:.3g}", "", f"{bound:g}", why, found < bound, remark)


def states(
    what: str, source: str, expected: str, found: str, holds: bool, remark: str = "", why: str = "a statement"
) -> Row:
    """A statement in words that a computation confirms or not."""
    return Row(what, source, expected, found, "", "", why, holds, remark)
