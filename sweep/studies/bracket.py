"""Brackets the first spin, going outwards, at which something happens: for many searches at once.

A search first walks outwards, then narrows the bracket.  It knows of each spin what a simulation said there, and how
far it was from happening (its margin).  The margin falls smoothly to zero where the event begins, so that two spins
just inside and just outside its root usually end the search.  A margin only proposes spins: what counts is what the
simulations say of them, and where a proposal fails the bracket is cut into equal parts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sweep.grid import Array

NOT_YET, HAPPENS, UNDECIDED, FAILED, AT_ONCE = range(5)
"""What a simulation says of a spin: it does not happen there; it does; or that is not known, because the simulation
reached its time limit, or because it failed.  A search may also end in `AT_ONCE`: it happens where that begins."""

RATIO = 1.25
"""From one spin of the way outwards to the next."""

# Spins of the way outwards that are simulated at once.
_OUTWARDS = 5

# Equal parts into which a bracket is cut where no margin tells better.
_PARTS = 4

# Half the distance of the two spins proposed by a margin, in widths: a little less than the half.
_HALF = 0.45

# A third spin is proposed at this share of the way back to the inner end, so that a margin is known close to the root
# even where the root itself was missed.
_BACK = 0.2

# Margins fall about as fast as the spin rises.  Two of them tell a better slope if their spins are no farther apart
# than this share: of 32 searches for n_c2 the slope was -0.83 ... -1.0 within 3 % of the root, but -1.26 ... -1.1 as
# measured between steps of `RATIO`.
_LOCAL = 0.1


@dataclass(frozen=True)
class Question:
    """Spins to simulate; arrays of shape (simulations,)."""

    search: Array
    """Indices of the searches."""
    size: Array
    """|spin|."""
    exact: Array
    """Whether the answer may become an end of a bracket.  The way outwards may be simulated less accurately, because a
    bracket never ends at a spin that was not simulated exactly."""


Ask = Callable[[Question], tuple[Array, Array]]
"""question -> what the simulations say, and their margins, both of shape (simulations,).

A margin is a spin: positive where it does not happen, it falls to zero where it begins, about as fast as the spin
rises.  NaN where it is not known."""


@dataclass(frozen=True)
class Bracket:
    """Two spins between which something begins to happen; arrays of shape (searches,), NaN where they are not known."""

    inner: Array
    """The end nearer zero, at which it does not happen."""
    outer: Array
    """The far end, at which it happens."""
    outcome: Array
    """`HAPPENS` where both ends are known; `UNDECIDED` where simulations nearer zero than the far end reached their
    time limit; `NOT_YET` where nothing happens up to the limit of the search; `AT_ONCE` or `FAILED`."""


def search(
    ask: Ask,
    begin: Array,
    limit: Array,
    width: float,
    settled: Callable[[Array], None] = lambda share: None,  # noqa: ARG005
) -> Bracket:
    """Go outwards from |spin| = `begin` by factors of `RATIO`, then narrow the bracket.

    The way outwards ends at the first spin at which it happens, and also where a simulation fails, because it might
    have happened there.  A simulation that reaches its time limit is passed over.

    Parameters
    ----------
    begin, limit : smallest and largest |spin| to examine, shape (searches,)
    width : of the brackets, relative to their outer ends
    settled : called before each round of simulations with the share of each search that is done, shape (searches,)
    """
    searches = [_Search(*ends, width) for ends in zip(begin.tolist(), limit.tolist(), strict=True)]
    while True:
        wanted = [(i, *spin) for i, each in enumerate(searches) for spin in each.wanted()]
        settled(np.array([each.share for each in searches]))
        if not wanted:
            break
        which, sizes, exact = zip(*wanted, strict=True)
        outcomes, margins = ask(Question(np.array(which), np.array(sizes), np.array(exact)))
        answers = map(_Answer, outcomes.tolist(), margins.tolist(), exact)
        for i, size, answer in zip(which, sizes, answers, strict=True):
            searches[i].known[size] = answer
    inner, outer, outcome = np.array([each.result() for each in searches]).reshape(-1, 3).T
    return Bracket(inner, outer, outcome.astype(int))


@dataclass(frozen=True)
class _Answer:
    outcome: int
    margin: float
    exact: bool


class _Search:
    """One search: what it knows, and what it wants to know next."""

    def __init__(self, begin: float, limit: float, width: float) -> None:
        self.width = width
        self.known: dict[float, _Answer] = {}
        self._left = [min(begin, limit)]
        while self._left[-1] < limit:
            self._left.append(min(begin * RATIO ** len(self._left), limit))
        self._before = np.inf
        """Width of the bracket when a margin proposed spins last; infinite if none did."""
        self.share = 0.0
        """How much of the search is done."""

    def wanted(self) -> list[tuple[float, bool]]:
        """The spins to simulate next, and whether exactly; none if the search is finished."""
        inner, outer = self._ends()
        if outer is None:
            spins, self._left = self._left[:_OUTWARDS], self._left[_OUTWARDS:]
            self.share = 0.0 if not self.known else 0.4 if spins else 1.0
            return [(spin, False) for spin in spins]
        ends = [outer] if inner is None or self.known[outer].outcome == FAILED else [inner, outer]
        if len(ends) == 2 and (relative := (outer - ends[0]) / outer) > self.width:
            self.share = 0.5 + 0.4 * float(np.log(relative / (RATIO - 1)) / np.log(self.width / RATIO))
            return [(spin, True) for spin in self._inside(ends[0], outer)]
        unsure = [(spin, True) for spin in ends if not self.known[spin].exact]
        self.share = 0.95 if unsure else 1.0
        return unsure

    def result(self) -> tuple[float, float, int]:
        """Inner end, outer end and outcome, as in `Bracket`."""
        inner, outer = self._ends()
        before = NOT_YET if inner is None else self.known[inner].outcome
        if outer is None:
            return np.nan, np.nan, before
        if self.known[outer].outcome == FAILED:
            return np.nan, np.nan, FAILED
        if inner is None:
            return np.nan, outer, AT_ONCE
        return (np.nan, outer, UNDECIDED) if before == UNDECIDED else (inner, outer, HAPPENS)

    def _ends(self) -> tuple[float | None, float | None]:
        """The last spin before it happens or a simulation fails, and the first at which; None where there is none."""
        inner = None
        for spin in sorted(self.known):
            if self.known[spin].outcome in (HAPPENS, FAILED):
                return inner, spin
            inner = spin
        return inner, None

    def _inside(self, inner: float, outer: float) -> list[float]:
        """Spins to simulate inside a bracket."""
        root = self._root(inner) if outer - inner <= self._before / _PARTS else None
        self._before = np.inf
        if root is not None and root < outer:
            pair = [root * (1 - _HALF * self.width), root * (1 + _HALF * self.width)]
            back = root - _BACK * (root - inner)
            spins = [spin for spin in ([back] if back < pair[0] else []) + pair if inner < spin < outer]
            if spins:
                self._before = outer - inner
                return spins
        return [inner + (outer - inner) * part / _PARTS for part in range(1, _PARTS)]

    def _root(self, inner: float) -> float | None:
        """The spin at which the margin vanishes, as far as it tells."""
        nearest = self.known[inner]
        if nearest.outcome != NOT_YET or not nearest.margin > 0:
            return None
        near = [s for s in self.known if (1 - _LOCAL) * inner <= s < inner and self.known[s].margin > nearest.margin]
        if not near:
            return inner + nearest.margin
        return inner + nearest.margin * (inner - max(near)) / (self.known[max(near)].margin - nearest.margin)
