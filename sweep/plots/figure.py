"""A figure of matplotlib: its style and layout, its axes, and its legend below."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from math import ceil, log
from string import ascii_lowercase
from textwrap import fill
from typing import Any, Literal
from warnings import catch_warnings, filterwarnings

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter

from sweep.axis import Axis
from sweep.faults import brief, fault_of
from sweep.grid import Array
from sweep.plots import labels
from sweep.plots.panels import MAX_PANELS, Panel, title

TEXT = 9.0
"""Text size in points for which lengths here are given in inches: a figure with smaller text is smaller."""

RATIO = 0.78
"""Height of a map relative to its width."""

_WIDE, _SHAPE = 15.2, 2.0
"""Width in inches of a page whose size the user has not set, and its width relative to its height."""

_STYLE: dict[Any, Any] = {
    "font.size": TEXT, "axes.titlesize": "medium", "xtick.labelsize": "small", "ytick.labelsize": "small",
    "legend.fontsize": "small", "legend.title_fontsize": "small", "hatch.linewidth": 0.7,
    "axes.formatter.limits": [-4, 6], "axes.formatter.use_mathtext": True,
    "figure.dpi": 110, "pdf.fonttype": 42, "svg.hashsalt": "sweep",
}  # fmt: skip
"""Settings of matplotlib that the user has not changed."""

_PRINT: dict[Any, Any] = {"font.size": 7.5, "figure.dpi": 300}
"""Settings for print that replace these, so that no text is too small."""

_LETTER, _HANDLE, _LINE, _LINES = 0.058, 0.71, 0.17, 4
"""Inches per letter, entry and line of a legend, and the number of lines for which figures have room."""

_OF_TITLE = 0.09
"""Largest width in inches of a letter of a title."""

_OF_LABEL = 0.085
"""Inches per letter in the label of an axis, with some room, since axes are laid out later."""

_OF_CONSTANTS, _LONGEST = 1 / 13, 90
"""Inches per letter of the constant parameters, and the largest number of letters in a line."""

_UNIT, _PARAMETER = r"(?m)(?:(?<!\S)\S{1,2} |(?<= ))\(.*\)$|\S+ = \S+", "[^, ][^,]*"
"""Patterns kept on one line: the unit at the end of a label with its symbol, a value; a constant with its unit."""

_LEAST = 1.2
"""Smallest width of a map in inches."""

_COLUMN, _OF_COLUMN = 6.0, 3
"""Largest width in inches of a column of text, and the largest number of panels in a row there."""

_NARROWEST = 0.25
"""Smallest width of a panel in inches, for which a page must have room."""


def style(width: float | None) -> dict[Any, Any]:
    """Return the settings of matplotlib for a figure: ours, except where the user has changed matplotlib's.

    Parameters
    ----------
    width : width in inches of a figure for print; None for the user's setting, or for a screen
    """
    ours = _STYLE | (_PRINT if width else {})
    unchanged = {name: v for name, v in ours.items() if mpl.rcParams[name] == mpl.rcParamsDefault[name]}
    # The panels set the height; this one only keeps the size from being taken for matplotlib's default.
    return unchanged | ({"figure.figsize": [width, width / 2]} if width else {})


class Sheet(Figure):
    """A figure that a notebook shows as the value of a cell, even before pyplot has drawn anything.

    Before that, IPython has no way to show a figure of matplotlib, and prints its name.  It keeps the style in which it
    was made: matplotlib makes ticks and looks up fonts only when it draws.

    Parameters
    ----------
    dataset : gives the title, and the constant parameters, which are written above the legend
    width, height : in inches, for text of `TEXT` points
    constants : whether the constant parameters are written
    """

    def __init__(self, dataset: xr.Dataset, width: float, height: float, *, constants: bool = True) -> None:
        scale = mpl.rcParams["font.size"] / TEXT
        words = fill(dataset.attrs.get("title", ""), max(1, int(width / _OF_TITLE)))
        height += _LINE * words.count("\n")
        super().__init__((width * scale, height * scale), layout="constrained")
        self._width, self._height = width, height
        self._constants = constants_in_lines(labels.constants(dataset), width) if constants else ""
        self._style: dict[Any, Any] = {name: mpl.rcParams[name] for name in _STYLE}
        if words:
            self.suptitle(words)

    def draw(self, renderer: RendererBase) -> None:
        with mpl.rc_context(self._style):
            super().draw(renderer)

    def savefig(self, *args: Any, **kwargs: Any) -> None:
        """Save it as any figure of matplotlib, in the style in which it was drawn."""
        with mpl.rc_context(self._style):
            super().savefig(*args, **kwargs)

    def _repr_png_(self) -> bytes:
        stream = BytesIO()
        self.savefig(stream, format="png")
        return stream.getvalue()

    def panels(self, rows: int, columns: int, count: int, **shared: Any) -> list[Axes]:
        """Make a grid of axes, whose last row may have fewer."""
        grid = self.subplots(rows, columns, squeeze=False, **shared).ravel()
        for axes in grid[count:]:
            axes.remove()
        return list(grid[:count])

    @property
    def _panels(self) -> list[Axes]:
        """All axes except bars and second axes, which have labels."""
        return [axes for axes in self.axes if not axes.get_label()]

    def explain(self, handles: Sequence[Artist], panels: int = 0, notes: Iterable[str] = ()) -> None:
        """Add a legend below the panels, in as many columns as fit, headed by the constants and by `notes`.

        Parameters
        ----------
        panels : how many there would be, if the figure may hold fewer
        """
        self._wrap_labels()
        if panels > MAX_PANELS:
            handles = [*handles, Line2D([], [], color="none", label=f"the first {MAX_PANELS} of {panels} panels")]
        head = "\n".join(filter(None, [self._constants, *(constants_in_lines(note, self._width) for note in notes)]))
        if not handles and not head:
            return
        room = max(1, int((self._width - _HANDLE) / _LETTER))
        words = [fill(str(handle.get_label()), room, break_long_words=False) for handle in handles]
        columns = _columns(words, self._width)
        self.legend(
            list(handles), [labels.in_maths(each) for each in words], loc="outside lower center", frameon=False,
            handlelength=4, columnspacing=1.3, ncols=len(columns), title=head or None,
            alignment="left" if len(columns) == 1 else "center",
        )  # fmt: skip
        lines = max(sum(each.count("\n") + 1 for each in column) for column in columns)
        lines += head.count("\n") + 1
        more = max(0, lines - _LINES) * _LINE
        self.set_figheight(self.get_figheight() * (1 + more / self._height))

    def _wrap_labels(self) -> None:
        """Break the titles and labels of panels and bars that are longer than their axes."""
        for axes in self.axes:
            letter = _OF_LABEL * self.dpi * self.get_figwidth() / self._width
            across, up = axes.bbox.size
            for text, length in ((axes.title, across), (axes.xaxis.label, across), (axes.yaxis.label, up)):
                text.set_text(_wrapped(text.get_text(), int(length / letter), _UNIT))

    def name(self, title: str) -> None:
        """Give the figure a title; without one, a single panel has none either."""
        self.suptitle(title)
        for axes in self._panels if not title and len(self._panels) == 1 else []:
            axes.set_title("")

    def letter(self) -> None:
        """Letters a, b, c at the panels, if there are several."""
        for letter, axes in zip(ascii_lowercase, self._panels if len(self._panels) > 1 else [], strict=False):
            axes.annotate(letter, (0, 1), xycoords="axes fraction", xytext=(-4, 4), textcoords="offset points",
                          ha="right", va="bottom", weight="bold")  # fmt: skip


@contextmanager
def drawing() -> Iterator[None]:
    """Turn whatever keeps matplotlib from drawing, such as a setting or a text, into an `InputError`."""
    with catch_warnings():
        filterwarnings("error", "constrained_layout not applied")
        try:
            yield
        except OSError:  # of the file
            raise
        except UserWarning:
            words = "its words leave no room for the panels; give a larger width, or choose a smaller text"
            raise fault_of(words, "width") from None
        except Exception as error:
            words = f"matplotlib cannot draw this figure: {brief(f'{type(error).__name__}: {error}')}"
            raise fault_of(f"{words}; check its settings, such as text.usetex") from error


def _columns(entries: list[str], width: float) -> list[list[str]]:
    """Share the entries of a legend among as many columns as fit in this width in inches, as matplotlib does."""
    for count in range(len(entries), 0, -1):
        columns = [list(map(str, column)) for column in np.array_split(entries, count)]
        longest = [max(len(line) for entry in column for line in entry.split("\n")) for column in columns]
        if sum(longest) * _LETTER + count * _HANDLE <= width:
            return columns
    return [entries]


def constants_in_lines(constants: str, width: float) -> str:
    """Wrap the constant parameters into lines, for a figure of this width in inches."""
    return _wrapped(constants, min(_LONGEST, int(width / _OF_CONSTANTS)), _PARAMETER)


def _wrapped(words: str, room: int, whole: str) -> str:
    """Break words into lines of at most `room` letters, but never within a match of the pattern `whole`."""
    space = "\N{NO-BREAK SPACE}"
    joined = re.sub(whole, lambda match: match[0].replace(" ", space), words)
    lines = [fill(line, max(room, 1), break_long_words=False, break_on_hyphens=False) for line in joined.split("\n")]
    return "\n".join(lines).replace(space, " ")


def write_words(axes: Axes, words: str) -> None:
    """Write words in the middle of axes without curves."""
    axes.text(0.5, 0.5, words, transform=axes.transAxes, ha="center", va="center", wrap=True)


def zero_line(axes: Axes) -> None:
    """Draw a line at zero."""
    axes.axhline(0, color=mpl.rcParams["text.color"], linewidth=0.5)


def page() -> float:
    """Return the width of a page in inches, for text of `TEXT` points: the user's setting, or that of a screen."""
    return float(mpl.rcParams["figure.figsize"][0] * TEXT / mpl.rcParams["font.size"]) if is_asked() else _WIDE


def is_asked() -> bool:
    """Return whether the user has set a size."""
    return bool(mpl.rcParams["figure.figsize"] != mpl.rcParamsDefault["figure.figsize"])


def is_column() -> bool:
    """Return whether the page is as narrow as a column of text, where a figure shows a single variable."""
    return page() <= _COLUMN


def panel_width(columns: int, widest: float, around: float) -> float:
    """Return the width of each of several panels in a row, in inches, which fills a page of given size.

    Parameters
    ----------
    widest : width of a panel, at most, on a page whose size is not given
    around : inches across of labels and bars around the panels

    Raises
    ------
    InputError
        if the page is too narrow; the message gives a width that suffices.
    """
    width = (page() - around) / columns
    if width < _NARROWEST:
        needed = ceil(25.4 * (around + columns * _NARROWEST) * mpl.rcParams["font.size"] / TEXT)
        raise fault_of(f"too narrow for this figure; give {needed}mm or more, or choose a smaller text", "width")
    return width if is_asked() else min(width, widest)


Frames = list[tuple[Axes, xr.Dataset]]
"""Axes, and the part of a dataset to draw there."""


def framed(dataset: xr.Dataset, panels: list[Panel], x: str) -> tuple[Sheet, Frames]:
    """Make a figure with axes over `x` for each panel of a dataset, paired with the part to draw there."""
    rows, columns = arrangement(len(panels), 1.5 if is_column() else 2)
    high = 2.8 if dataset.sizes.get(x, 1) > 1 else 0.9  # a single cell is written in words
    figure = Sheet(dataset, panel_width(columns, 7.0, 0) * columns, 1.9 + high * rows)
    frames = list(zip(figure.panels(rows, columns, len(panels), sharex=True), panels, strict=True))
    for k, (axes, panel) in enumerate(frames):
        lowest = k + columns >= len(panels)
        axes.set_title(title(dataset, panel))
        axes.tick_params(labelbottom=lowest)
        if lowest and x:
            axes.set_xlabel(labels.label(dataset, x))
    return figure, [(axes, dataset.isel(panel)) for axes, panel in frames]


def arrangement(panels: int, maps: float) -> tuple[int, int]:
    """Arrange panels of several maps each on a page; returns rows, and panels in a row.

    The figure has about the shape of a screen, with few empty places in its last row.
    """
    most = _OF_COLUMN if is_column() else panels

    def misshapen(groups: int) -> float:
        rows = -(-panels // groups)
        return abs(log(groups * maps / (rows * RATIO) / _SHAPE)) + (rows * groups - panels) / panels

    groups = min((n for n in range(1, most + 1) if n == 1 or n * maps * _LEAST <= page()), key=misshapen)
    return -(-panels // groups), groups


def set_scale(axes: Axes, which: Literal["x", "y"], values: Array) -> None:
    """Make an axis logarithmic if its values, in increasing order, have equal ratios; plain numbers at the ticks."""
    if Axis("", values).spacing != "log" or values[-1] <= 1.5 * values[0]:
        return
    axes.set(**{f"{which}scale": "log"})
    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_major_locator(LogLocator(subs=(1, 2, 5) if values[-1] < 1000 * values[0] else (1,)))
    axis.set_major_formatter(lambda at, _: labels.number(at))
    axis.set_minor_formatter(NullFormatter())
