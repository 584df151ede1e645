"""A statement of the paper, what we find, and whether the two agree."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from sweep.config import document
from sweep.store import StoreError

DATA = Path(__file__).parents[2] / "data" / "takano2011.yaml"


@dataclass(frozen=True)
class Row:
    what: str
    source: str
    """Label of the equation or figure, or the section."""
    expected: str
    found: str
    difference: str
    tolerance: str
    why: str
    """Where the tolerance comes from."""
    holds: bool
    remark: str = ""
    """What was found where the paper is wrong or silent."""


@dataclass
class Section:
    """Rows, figures and tables under one heading of the report."""

    title: str
    rows: list[Row] = field(default_factory=list)
    figures: list[tuple[str, Figure]] = field(default_factory=list)
    """Caption and figure."""
    tables: list[tuple[str, list[list[str]]]] = field(default_factory=list)
    """Caption and lines, the first of them the head."""


@cache
def published() -> dict[str, dict[str, Any]]:
    """The paper's numbers, from `data/takano2011.yaml`."""
    if not DATA.exists():
        raise StoreError(f"{DATA}: no such file; reproduce runs from a checkout of the project (pip install -e)")
    return dict(document.read(DATA).values)


def against_paper(key: str, what: str, found: float, remark: str = "") -> Row:
    """A number of the paper's, by its name in `data/takano2011.yaml`."""
    entry = published()[key]
    return against(what, entry["source"], entry["value"], found, entry["tolerance"], entry["why"], remark)


def against(what: str, source: str, expected: float, found: float, tolerance: float, why: str, remark: str = "") -> Row:
    difference = found - expected
    holds = abs(difference) <= tolerance
    return Row(
        what, source, f"{expected:.6g}", f"{found:.6g}", f"{difference:.2g}", f"{tolerance:.2g}", why, holds, remark
    )


def below(what: str, source: str, found: float, bound: float, why: str, remark: str = "") -> Row:
    """Something that must not exceed a bound."""
    return Row(what, source, f"< {bound:g}", f"{found:.3g}", "", f"{bound:g}", why, found < bound, remark)


def states(what: str, source: str, expected: str, found: str, holds: bool, remark: str = "") -> Row:
    """A statement in words that a computation confirms or not."""
    return Row(what, source, expected, found, "", "", "a statement", holds, remark)
