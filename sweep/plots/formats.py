"""The formats that `plot` writes, each named by the suffix of the file."""

from __future__ import annotations

from pathlib import Path

PICTURES = ("png", "pdf", "svg", "eps")
PAGE = "html"
"""A map as a page of its own, from the command alone; the explorer writes it."""

A_PICTURE, ANY = "png, pdf, svg or eps", "png, pdf, svg, eps or html"
"""The same in words."""


def suffix(path: Path) -> str:
    """The format that a file's suffix names."""
    return path.suffix.removeprefix(".").lower()
