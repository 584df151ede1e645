"""A figure that notebooks show."""

from __future__ import annotations

from io import BytesIO

from matplotlib.figure import Figure


class Picture(Figure):
    """A figure that is shown as the value of a notebook's cell, also where pyplot has drawn nothing yet.

    Before that, IPython has no way to show a figure of matplotlib, and prints its name.
    """

    def _repr_png_(self) -> bytes:
        stream = BytesIO()
        self.savefig(stream, format="png")
        return stream.getvalue()
