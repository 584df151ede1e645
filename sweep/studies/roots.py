"""Narrows brackets around the roots of functions that simulations evaluate, for many roots at once.

What counts is only the sign.  The value proposes where to look next: near a root it is smooth, so that interpolation
through the nearest values finds it within a few evaluations (inverse interpolation; Brent 1973, chapter 4).  Once the
proposals hardly differ, or have been followed a few times, the next two places are just below and above the proposed
one, so that both ends of the bracket close in.  Where that fails, the bracket is cut into equal parts.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import prod

import numpy as np

# Half the distance of the last two places, in widths: a little less than the half.
_HALF = 0.45

# How far on each side of a proposed root the next places are, in units of its uncertainty; and the factor by which they
# are farther in each round after the root was on neither side.
_BESIDE, _FARTHER = 2.0, 10.0

# The most proposals that are followed one by one.  With pairs from the start it takes one evaluation more.
_ALONE = 3

# Equal parts into which a bracket is cut where no value tells better.
_PARTS = 4

# Uncertainty of the first proposal, from the two ends alone, relative to their distance.
_FIRST = 0.05


@dataclass
class Root:
    """A search: two places with values of opposite sign, which close in on a root."""

    low: float
    high: float
    width: float
    """The distance of the two at which the search ends."""
    values: dict[float, float]
    """What is known: the function by place."""
    smooth: dict[float, float]
    """Of these, the values that belong to the one smooth function that passes through the root."""
    roughly: bool = False
    """It may end where the values tell the root within the width, without a bracket as narrow."""
    blank: list[float] = field(default_factory=list)
    """The places at which it has no value."""
    _pair: list[float] = field(default_factory=list)
    """The places proposed last around a root; empty if the bracket was cut."""
    _alone: int = 0
    """Places proposed one by one since the last pair."""
    _missed: int = 0
    """Rounds since the root was last between these."""

    @property
    def ended(self) -> bool:
        rounding = 4 * float(np.spacing(max(abs(self.low), abs(self.high))))
        return self.unknown or self.high - self.low <= max(self.width, rounding) or self._known

    @property
    def unknown(self) -> bool:
        """True if the function has no value somewhere in the bracket; that ends the search."""
        return any(self.low < place < self.high for place in self.blank)

    @property
    def expected(self) -> float:
        """The place in the bracket where the root is, as far as the values tell."""
        return min(max(self._proposed()[0], self.low), self.high)

    def wanted(self) -> list[float]:
        """The places to evaluate next."""
        inside = not self._pair or (self._pair[0] <= self.low and self.high <= self._pair[-1])
        self._missed = 0 if inside else self._missed + 1
        root, off = self._proposed()
        off, aside = _BESIDE * _FARTHER**self._missed * off, _HALF * self.width
        far, self._pair = max(off, aside), []
        if not self.low < root < self.high or _PARTS * far >= self.high - self.low:
            self._alone = 0
            return [self.low + (self.high - self.low) * part / _PARTS for part in range(1, _PARTS)]
        if off > aside and not self._missed and self._alone < _ALONE:
            self._alone += 1
            # It may stay an end of the bracket, and is not to be so near the root that its sign is in doubt.
            return [root + aside if self.high - root > root - self.low else root - aside]
        self._alone = 0
        self._pair = [place for place in (root - far, root + far) if self.low < place < self.high]
        return self._pair

    def learn(self, place: float, value: float, *, smooth: bool) -> None:
        """Take in the value at a place; NaN where there is none."""
        if np.isnan(value):
            self.blank.append(place)
            return
        self.values[place] = value
        if smooth:
            self.smooth[place] = value
        if not self.low < place < self.high:
            return
        if (value > 0) == (self.values[self.low] > 0):
            self.low = place
        else:
            self.high = place

    @property
    def _known(self) -> bool:
        """True if the values tell the root within the width, and that is enough."""
        if not self.roughly or len(self.smooth) < 3:
            return False
        root, off = self._proposed()
        return self.low <= root <= self.high and _BESIDE * off <= _HALF * self.width

    def _proposed(self) -> tuple[float, float]:
        """Where the root is, as far as the values tell, and how uncertain that is."""
        distinct = {value: (place, value) for place, value in self.smooth.items()}
        known = sorted(distinct.values(), key=lambda pair: abs(pair[1]))[:4]
        if len(known) < 2:
            return self._secant(), _FIRST * (self.high - self.low)
        best = [_inverse(known[:n]) for n in range(2, len(known) + 1)]
        off = abs(best[-1] - best[-2]) if len(best) > 1 else _FIRST * (self.high - self.low)
        return best[-1], off

    def _secant(self) -> float:
        """The root of the straight line between the ends."""
        low, high = self.values[self.low], self.values[self.high]
        return self.low - low * (self.high - self.low) / (high - low)


def _inverse(known: list[tuple[float, float]]) -> float:
    """The place at which the polynomial place(value) has the value zero."""
    found = 0.0
    for i, (place, value) in enumerate(known):
        found += place * prod(other / (other - value) for j, (_, other) in enumerate(known) if j != i)
    return found
