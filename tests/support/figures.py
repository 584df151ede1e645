"""What can be read in a figure."""

from __future__ import annotations

from matplotlib.figure import Figure


def entries(figure: Figure) -> list[str]:
    """The words of the legends below a figure."""
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


def constants(figure: Figure) -> str:
    """The words over the legend."""
    return figure.legends[0].get_title().get_text()
