"""Narrows brackets around the roots of functions that simulations evaluate, for many roots at once.

Only the sign counts. The value proposes where to look next: near a root it is smooth, so that interpolation through the
nearest values finds it within a few evaluations (inverse interpolation; Brent 1973, chapter 4). Once the proposals
hardly differ, or a few have been followed, the next two places are just below and above the proposed one, so that both
ends of the bracket close in. If that fails, the bracket is divided into equal parts.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import prod

import numpy as np

# Half the distance between the last two places, in widths: a little less than a half.
_HALF = 0.45

# Distance of the next places on each side of a proposed root, in units of its uncertainty; and the factor by which it
# grows in each round in which the root was on neither side.
_BESIDE, _FARTHER = 2.0, 10.0

# Most proposals that are followed one by one. Starting with pairs takes one more evaluation.
_ALONE = 3

# Number of equal parts into which a bracket is divided where the values give no better proposal.
_PARTS = 4

CLOSER = 5
"""Times that a bracket with uncertain cells is narrowed from outside, each time halving the way to the nearest one."""

# Uncertainty of the first proposal, from the two ends alone, relative to their distance.
_FIRST = 0.05


@dataclass
class Root:
    """A search: two places with values of opposite sign, which close in on a root."""

    low: float
    high: float
    width: float
    """Distance between the two places at which the search ends."""
    values: dict[float, float]
    """Known values of the function, by place."""
    smooth: dict[float, float]
    """Known values on the smooth branch that passes through the root."""
    roughly: bool = False
    """Whether the search may end once the values locate the root within the width, without a bracket that narrow."""
    closer: int = 0
    """Times that a bracket with a place without a value may still be narrowed from outside."""
    blank: list[float] = field(default_factory=list)
    """Places where the function has no value."""
    _pair: list[float] = field(default_factory=list)
    """Places last proposed around a root; empty if the bracket was divided."""
    _alone: int = 0
    """Number of places proposed one by one since the last pair."""
    _missed: int = 0
    """Rounds since the root last lay between these."""

    @property
    def ended(self) -> bool:
        if self.unknown:
            return not self.closer
        rounding = 4 * float(np.spacing(max(abs(self.low), abs(self.high))))
        return self.high - self.low <= max(self.width, rounding) or self._known

    @property
    def unknown(self) -> bool:
        """Return whether the function has no value somewhere in the bracket."""
        return any(self.low < place < self.high for place in self.blank)

    @property
    def expected(self) -> float:
        """Return the place in the bracket where the values locate the root."""
        return min(max(self._proposed()[0], self.low), self.high)

    def wanted(self) -> list[float]:
        """Return the places to evaluate next; if one has no value, those halfway between each end and the nearest."""
        if self.unknown:
            self.closer -= 1
            blank = [place for place in self.blank if self.low < place < self.high]
            return [(self.low + min(blank)) / 2, (max(blank) + self.high) / 2]
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
            # It may remain an end of the bracket, so it must not be so near the root that its sign is in doubt.
            return [root + aside if self.high - root > root - self.low else root - aside]
        self._alone = 0
        self._pair = [place for place in (root - far, root + far) if self.low < place < self.high]
        return self._pair

    def learn(self, place: float, value: float, *, smooth: bool) -> None:
        """Record the value at a place; NaN where there is none."""
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
        """Return whether the values locate the root within the width, and that is enough."""
        if not self.roughly or len(self.smooth) < 3:
            return False
        root, off = self._proposed()
        return self.low <= root <= self.high and _BESIDE * off <= _HALF * self.width

    def _proposed(self) -> tuple[float, float]:
        """Return the place of the root according to the values, and its uncertainty."""
        distinct = {value: (place, value) for place, value in self.smooth.items()}
        known = sorted(distinct.values(), key=lambda pair: abs(pair[1]))[:4]
        if len(known) < 2:
            return self._secant(), _FIRST * (self.high - self.low)
        best = [_inverse(known[:n]) for n in range(2, len(known) + 1)]
        off = abs(best[-1] - best[-2]) if len(best) > 1 else _FIRST * (self.high - self.low)
        return best[-1], off

    def _secant(self) -> float:
        """Return the root of the straight line between the ends."""
        low, high = self.values[self.low], self.values[self.high]
        return self.low - low * (self.high - self.low) / (high - low)


def _inverse(known: list[tuple[float, float]]) -> float:
    """Return the place at which the polynomial place(value) has the value zero."""
    found = 0.0
    for i, (place, value) in enumerate(known):
        found += place * prod(other / (other - value) for j, (_, other) in enumerate(known) if j != i)
    return found
