"""Legends below a figure, never over its data."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.artist import Artist
from matplotlib.figure import Figure

_LETTER, _HANDLE = 0.062, 0.75
"""Inches that a letter, and the rest of an entry, take at this size of letters."""


def below(figure: Figure, handles: Sequence[Artist]) -> None:
    """Explain `handles` below the figure, in as many columns as fit."""
    if not handles:
        return
    longest = max(len(str(handle.get_label())) for handle in handles)
    columns = max(1, int(figure.get_figwidth() / (longest * _LETTER + _HANDLE)))
    figure.legend(
        handles=list(handles), loc="outside lower center", fontsize=8, frameon=False, handlelength=3,
        ncols=min(columns, len(handles)),
    )  # fmt: skip
