"""Colours of a map: a scale for its kind of values, and ticks for its bar.

Safe for the colour-blind: viridis and a diverging purple to orange that turns about a near-white zero, both with a
lightness that tells values apart, and the eight colours of Okabe and Ito for flags and curves.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from bokeh.palettes import PuOr11, Viridis256, interp_palette

from sweep.explore.slices import Slice
from sweep.grid import Array
from sweep.plots import labels, scales

CURVES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#8a6d00")
_FLAGS = ("#bbbbbb", "#0072b2", "#e69f00", "#d55e00", "#cc79a7", "#000000", "#009e73", "#56b4e9", "#f0e442")

_MOST = 40
"""Counts that have a colour of their own."""

_SHARE = 0.995
"""Share of the cells within the scale: the rare few beyond it share its last colour."""


@dataclass(frozen=True)
class Scale:
    """How values become colours."""

    palette: Sequence[str]
    low: float
    high: float
    logarithmic: bool = False
    ticks: list[float] | None = None
    """On the bar; chosen by Bokeh if None."""
    words: dict[float, str] = field(default_factory=dict)
    """What the ticks say instead of their numbers."""
    beyond: str = ""
    """What lies beyond the scale, if something does."""


def scale(part: Slice) -> Scale:
    """The scale of a slice, from the cells that have a value."""
    shown = part.shown
    flags = labels.flag_words(part.dataset, part.name)
    if flags:
        return _flags(flags)
    if not shown.size:
        return Scale(Viridis256, 0, 1)
    whole = shown.dtype.kind in "iu"
    if part.name == "ratio":
        return _ratios(shown)
    if part.name == "difference" or (shown.min() < 0 < shown.max()):
        return _diverging(shown, whole)
    return _counts(shown) if whole else _numbers(shown)


def _flags(words: dict[int, str]) -> Scale:
    low, high = min(words), max(words)
    palette = [_FLAGS[i % len(_FLAGS)] for i in range(high - low + 1)]
    ticks = [float(v) for v in words]
    return Scale(palette, low - 0.5, high + 0.5, ticks=ticks, words=dict(zip(ticks, words.values(), strict=True)))


def _diverging(shown: Array, whole: bool) -> Scale:
    top = float(np.quantile(np.abs(shown), _SHARE))
    most = float(np.abs(shown).max())
    if not whole:
        return Scale(interp_palette(PuOr11, 255), -top or -1, top or 1)
    top = max(math.ceil(top), 1)
    palette = interp_palette(PuOr11, 2 * top + 1) if top <= _MOST else interp_palette(PuOr11, 255)
    ticks = _whole_ticks(-top, top)
    beyond = f"the last colours also stand for differences up to {most:g}" if most > top else ""
    words = {t: f"{t:+g}" if t else "0" for t in ticks}
    return Scale(palette, -top - 0.5, top + 0.5, ticks=ticks, words=words, beyond=beyond)


def _ratios(shown: Array) -> Scale:
    """As pictures have it."""
    norm = scales.ratios(shown).norm
    low, high = float(norm.vmin or 1), float(norm.vmax or 1)
    ticks = [float(t) for t in np.geomspace(low, high, 5)]
    least, most = float(shown.min()), float(shown.max())
    ends = {f"down to {least:.2g}": least < low * (1 - 1e-9), f"up to {most:.2g}": most > high * (1 + 1e-9)}
    outside = " and ".join(words for words, there in ends.items() if there)
    beyond = f"the last colours also stand for ratios {outside}" if outside else ""
    words = {t: f"{t:.2g}" for t in ticks}
    return Scale(interp_palette(PuOr11, 255), low, high, logarithmic=True, ticks=ticks, words=words, beyond=beyond)


def _counts(shown: Array) -> Scale:
    low, most = int(shown.min()), int(shown.max())
    top = max(math.ceil(np.quantile(shown, _SHARE)), low + 1)
    many = top - low + 1
    palette = interp_palette(Viridis256, many) if many <= _MOST else Viridis256
    beyond = f"the last colour also stands for counts up to {most}" if most > top else ""
    return Scale(palette, low - 0.5, top + 0.5, ticks=_whole_ticks(low, top), beyond=beyond)


def _numbers(shown: Array) -> Scale:
    low, high = float(shown.min()), float(shown.max())
    if low == high:
        low, high = low - (abs(low) or 1) * 1e-3, high + (abs(high) or 1) * 1e-3
    return Scale(Viridis256, low, high, logarithmic=low > 0 and high > 100 * low)


def _whole_ticks(low: int, high: int) -> list[float]:
    """Whole numbers from low to high, zero among them where it lies between, about a dozen at most."""
    step = -(-(high - low + 1) // 12)
    return [float(t) for t in range(math.ceil(low / step) * step, high + 1, step)]
