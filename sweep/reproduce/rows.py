"""The paper's numbers, as rows of the report."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from sweep.config import document
from sweep.report.rows import Row, against
from sweep.results.store import StoreError

DATA = Path(__file__).parents[2] / "data" / "takano2011.yaml"


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
