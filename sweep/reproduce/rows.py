"""Makes the paper's numbers rows of the report."""

from __future__ import annotations

from functools import cache
from importlib import resources
from typing import Any

from sweep.config import document
from sweep.report.rows import Row, against


@cache
def published() -> dict[str, dict[str, Any]]:
    """Return the paper's numbers by name, from `data/takano2011.yaml` in this package."""
    with resources.as_file(resources.files("sweep.reproduce") / "data" / "takano2011.yaml") as path:
        return dict(document.read(path).values)


def against_paper(key: str, what: str, found: float, remark: str = "") -> Row:
    """Compare `found` with the paper's number of the name `key`."""
    entry = published()[key]
    return against(what, entry["source"], entry["value"], found, entry["tolerance"], entry["why"], remark)
