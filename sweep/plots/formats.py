"""The formats that `plot` writes, each named by the suffix of the file."""

from __future__ import annotations

from pathlib import Path

SUFFIXES = ("png", "pdf", "svg")
A_PICTURE = "png, pdf or svg"
"""`SUFFIXES` in words, for messages."""


def suffix(path: Path) -> str:
    """The format that a file's suffix names."""
    return path.suffix.removeprefix(".").lower()
