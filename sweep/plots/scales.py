"""Colour scales: the colours of values, and the ticks of a colour bar.

All maps get steadily lighter or, about zero, steadily darker on both sides, so that they can be read in grey.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import count, pairwise
from math import exp, log
from typing import Literal

import matplotlib as mpl
import numpy as np
from matplotlib.colors import BoundaryNorm, Colormap, ListedColormap, LogNorm, Normalize

from sweep.faults import brief, fault_of
from sweep.grid import Array

Limits = tuple[float | None, float | None]
"""The lowest and the highest value of a scale; the values determine an end that is None."""

AUTO: Limits = (None, None)

Arrows = Literal["both", "min", "max", "neither"]

SEQUENTIAL, DIVERGING = "viridis", "PuOr_r"

_MAX_COUNTS = 24
"""Largest number of colours of a scale of counts; with more, neighbours would look the same."""

_MAX_DIFFERENCES = 10
"""Number of colours on each side of zero of a scale of differences."""

_MAX_RATIO = 2.0
"""Ratios beyond this, or below its inverse, share the last colours."""

_MAX_TICKS = 12

LARGEST = 10**15
"""Largest limit: up to this size a float holds every count."""


@dataclass(frozen=True)
class Scale:
    """A mapping from values to colours."""

    colours: Colormap
    norm: Normalize
    ticks: dict[float, str] | None = None
    """Labels of the bar, by value; None leaves them to the library that draws."""
    arrows: Arrows = "neither"
    """Ends of the bar that values exceed."""

    def rgba(self, values: Array) -> Array:
        return np.asarray(self.colours(self.norm(values)))

    def lightness(self, values: Array) -> Array:
        """Luma of the colour of each value, from 0 to 1."""
        return np.asarray(self.rgba(values)[..., :3] @ [0.299, 0.587, 0.114])


def colour_map(name: str) -> Colormap:
    """Look up a colour map of matplotlib; `InputError` if the name is unknown."""
    if not isinstance(name, str) or name not in mpl.colormaps:
        raise fault_of(
            f"there is no colour map {brief(str(name))}; choose one of matplotlib's, such as viridis or cividis", "cmap"
        )
    return mpl.colormaps[name]


def ends(limits: Limits, low: float, high: float) -> tuple[float, float]:
    """Return the ends of a scale, of which values from `low` to `high` determine those without a limit.

    Raises
    ------
    InputError
        if the only limit is beyond all values.
    """
    first, last = limits
    first, last = float(low if first is None else first), float(high if last is None else last)
    if first > last:
        option, value, other = ("vmin", first, "vmax") if limits[1] is None else ("vmax", last, "vmin")
        raise fault_of(f"{value:g} is beyond all values, {low:g} to {high:g}; give {other} too", option)
    return first, last


def counts(values: Array, limits: Limits = AUTO, name: str | None = None) -> Scale:
    """A colour for each count; where there are many, the higher ones share colours, in ranges of round numbers.

    Parameters
    ----------
    values : integers
    limits : lowest and highest count with their own colours; all counts beyond share one colour on either side
    """
    low, high = map(round, ends(limits, values.min(), values.max()))
    return _stepped(low + _steps(high - low, _MAX_COUNTS), values, name or SEQUENTIAL)


def differences(values: Array, limits: Limits = AUTO, name: str | None = None) -> Scale:
    """A diverging scale of integers, whose colours are as strong on both sides of zero, which has its own.

    It ends where the values do.  Mean differences have a `continuous` scale.
    """
    if values.dtype.kind not in "iu":
        return continuous(values, limits, name)
    low, high = map(round, ends(limits, min(values.min(initial=0), 0), max(values.max(initial=0), 0)))
    side = _steps(max(-low, high, 1), _MAX_DIFFERENCES + 1)[1:]
    steps = np.concatenate([1 - side[::-1], side])
    first, last = np.searchsorted(steps, [low, high], side="right")
    return _stepped(steps, values, name or DIVERGING, slice(first - 1, last + 1))


def continuous(values: Array, limits: Limits = AUTO, name: str | None = None) -> Scale:
    """A scale of real numbers: about zero if they have both signs, logarithmic if they span orders of magnitude."""
    finite = values[np.isfinite(values)]
    low, high = ends(limits, *((finite.min(), finite.max()) if len(finite) else (0.0, 1.0)))
    if low == high:
        low, high = low - 0.1 * (abs(low) or 1.0), high + 0.1 * (abs(high) or 1.0)
    if low < 0 < high:  # as strong on both sides of zero
        top = max(-low, high)
        part = ((1 + low / top) / 2, (1 + high / top) / 2)
        return _smooth(finite, Normalize(low, high), colour_map(name or DIVERGING), part)
    norm = LogNorm(low, high) if low > 0 and high > 100 * low else Normalize(low, high)
    return _smooth(finite, norm, colour_map(name or SEQUENTIAL))


def ratios(values: Array, limits: Limits = AUTO, name: str | None = None) -> Scale:
    """A diverging scale of positive numbers, logarithmic and the same on both sides of one.

    Raises
    ------
    InputError
        if a limit is not positive.
    """
    for option, end in zip(("vmin", "vmax"), limits, strict=True):
        if end is not None and end <= 0:
            raise fault_of(f"{end:g}; give a number above zero for a ratio", option)
    finite = values[np.isfinite(values) & (values > 0)]
    most = float(np.abs(np.log(finite)).max(initial=0.01))
    given = np.abs(np.log(_given(limits)))
    top = given.max() if given.size else min(most, log(_MAX_RATIO))
    return _smooth(finite, LogNorm(exp(-top), exp(top)), colour_map(name or DIVERGING))


def flags(words: dict[int, str], name: str | None = None) -> Scale:
    """A colour for each of the values in `words`, which are in increasing order, from light to dark."""
    values = list(words)
    shades = colour_map(name or SEQUENTIAL)(np.linspace(0.95, 0.05, len(values)))
    bounds = [values[0] - 0.5, *((a + b) / 2 for a, b in pairwise(values)), values[-1] + 0.5]
    return Scale(ListedColormap(shades), BoundaryNorm(bounds, len(values)), {float(v): words[v] for v in values})


def _given(limits: Limits) -> list[float]:
    return [end for end in limits if end is not None]


def _smooth(values: Array, norm: Normalize, colours: Colormap, part: tuple[float, float] = (0.0, 1.0)) -> Scale:
    """A continuous scale, with arrows where values lie beyond it, of the colours between the ends `part` of 0 to 1."""
    if part != (0.0, 1.0):
        colours = ListedColormap(colours(np.linspace(*part, 256)))
    low, high = norm.vmin or 0.0, norm.vmax or 0.0
    arrows = _arrows(values, low, high)
    short = isinstance(norm, LogNorm) and 0.1 < low < high < 10  # without a power of ten
    ticks = {float(tick): f"{tick:.2g}" for tick in np.geomspace(low, high, 5)} if short else None
    return Scale(colours, norm, ticks, arrows)


def _arrows(values: Array, low: float, high: float) -> Arrows:
    """The ends of a scale that values exceed."""
    slack = 1e-9 * max(abs(low), abs(high))
    below, above = (values < low - slack).any(), (values > high + slack).any()
    return "both" if below and above else "min" if below else "max" if above else "neither"


def _steps(top: int, most: int) -> Array:
    """The beginnings of at most `most` ranges of the counts 0 to `top`, and the end of the last one.

    Each ends at a multiple of its width, which is 1, 2, 5, 10, 20 and so on, and no less than that of the range below.
    """
    for percent in count():
        steps = [0]
        while steps[-1] <= top and len(steps) <= most:
            width = _round(steps[-1] * percent // 100)
            steps.append((steps[-1] // width + 1) * width)
        if steps[-1] > top:
            break
    return np.array(steps)


def _round(number: int) -> int:
    """The largest of 1, 2, 5, 10, 20 and so on that is no larger than a number, or 1."""
    first, others = int(str(number)[0]), len(str(number)) - 1
    return max(n for n in (1, 2, 5) if n <= max(first, 1)) * int(10**others)


def _stepped(steps: Array, values: Array, name: str, shown: slice = slice(None)) -> Scale:
    """A colour for each of the ranges of integers that begin at `steps`; the scale has the part `shown` of them.

    A range of several integers is labelled with both its ends, so that a bar shows where ranges grow.
    """
    part = steps[shown]
    arrows = _arrows(values, part[0], part[-1] - 1)
    below, above = arrows in ("both", "min"), arrows in ("both", "max")
    shades = colour_map(name)(np.linspace(0, 1, len(steps) - 1 + 2 * (below or above)))
    begin = shown.indices(len(steps))[0] + (below or above) - below
    colours = ListedColormap(shades[begin : begin + below + len(part) - 1 + above])
    norm = BoundaryNorm(part - 0.5, colours.N, extend=arrows)
    ticks = {(low + high - 1) / 2: _range(low, high - 1) for low, high in pairwise(part.tolist())}
    return Scale(colours, norm, thinned(ticks, _MAX_TICKS), arrows)


def _range(low: int, high: int) -> str:
    """The words for the integers from `low` to `high`."""
    ends = [f"{low}", f"{high}"] if low < high else [f"{low}"]
    return ("–" if low >= 0 else " to ").join(ends).replace("-", "−")


def thinned(ticks: dict[float, str], most: int) -> dict[float, str]:
    """Choose at most `most` ticks, evenly spaced and including zero."""
    every = -(-len(ticks) // max(most, 1))
    start = list(ticks).index(0) % every if 0 in ticks else 0
    return dict(list(ticks.items())[start::every])
