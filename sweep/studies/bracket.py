"""Brackets the first spin, outwards from zero, at which something happens: for many searches at once.

A search first walks outwards, then narrows the bracket.  It knows of each spin what a simulation said there, and how
far it was from happening (its margin).  The margin falls smoothly to zero where the event begins, so that two spins
just inside and just outside its root usually end the search.  A margin only proposes spins: what counts is what the
simulations say of them, and where a proposal fails the bracket is cut into equal parts.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sweep.grid import Array

NOT_YET, HAPPENS, UNDECIDED, FAILED, AT_ONCE = range(5)
"""What a simulation says of a spin: it does not happen there; it does; or that is not known, because the simulation
reached its time limit, or because it failed.  A search may also end in `AT_ONCE`: it happens where that begins."""

RATIO = 1.25
"""From one spin of the way outwards to the next.  A first range of growth that ends at less than this times its
beginning may be missed; by the eigenvalues, the narrowest of 5932 ended at 1.29 times its beginning (bodies with
a = 1.5 … 50, |δ| <= 0.5, μ = 0.1 … 5000)."""

# Spins of the way outwards that are simulated at once beyond the spin at which the event was expected.
_OUTWARDS = 6

# Equal parts into which a bracket is cut where no margin tells better.
_PARTS = 4

# Half the distance of the two spins proposed by a margin, in widths: a little less than the half.
_HALF = 0.45

# A third spin is proposed at this share of the way back to the inner end, so that a margin is known close to the root
# even where the root itself was missed.
_BACK = 0.2

# Margins in spins fall about as fast as the spin rises.  Two of them tell a better slope if their spins are no farther
# apart than this share: of 32 searches for n_c2 the slope was -0.83 ... -1.0 within 3 % of the root, but -1.26 ... -1.1
# as measured between steps of `RATIO`.
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

A margin is positive where it does not happen and falls to zero where it begins; NaN where it is not known.  Beyond,
it is negative, or NaN; if it is NaN there, margins have to be spins, and fall about as fast as the spin rises."""


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
    limit: Array | float,
    width: float,
    expected: Array,
    *,
    precisely: bool = False,
    settled: Callable[[Array], None] = lambda share: None,  # noqa: ARG005
) -> Bracket:
    """Go outwards from |spin| = `begin` by factors of `RATIO`, then narrow the bracket.

    The way outwards ends at the first spin at which it happens, and also where a simulation fails, because it might
    have happened there.  A simulation that reaches its time limit is passed over.

    Parameters
    ----------
    begin : shape (searches,)
    limit : largest |spin| to examine, a number or of shape (searches,)
    width : of the brackets, relative to their outer ends
    expected : |spin| at which it may begin, shape (searches,).  It decides which spins are simulated first, and so how
        many, not what is found
    precisely : whether that spin is so good a guess that the bracket itself is tried at once
    settled : called before each round of simulations with the share of each search that is done, shape (searches,)
    """
    limits = np.broadcast_to(limit, begin.shape)
    given = zip(begin.tolist(), limits.tolist(), expected.tolist(), strict=True)
    searches = [_Search(first, last, width, guess, precisely) for first, last, guess in given]
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

    def __init__(self, begin: float, limit: float, width: float, expected: float, precisely: bool) -> None:
        self.width = width
        self.known: dict[float, _Answer] = {}
        self._left = _way(begin, limit)
        self._expected = expected if begin < expected < limit else limit
        self._precisely = precisely and self._expected == expected
        self._before = np.inf
        """Width of the bracket when a margin proposed spins last; infinite if none did."""
        self.share = 0.0
        """How much of the search is done."""

    def wanted(self) -> list[tuple[float, bool]]:
        """The spins to simulate next, and whether exactly; none if the search is finished."""
        inner, outer = self._ends()
        if outer is None:
            spins, self.share = self._outwards(), 0.4 if self.known else 0.0
            if not spins:
                self.share = 1.0
            return spins
        ends = [outer] if inner is None or self._at(outer).outcome == FAILED else [inner, outer]
        if len(ends) == 2:
            relative = (outer - ends[0]) / outer
            if relative > self.width:
                self.share = 0.5 + 0.4 * float(np.log(relative / (RATIO - 1)) / np.log(self.width / RATIO))
                return [(spin, True) for spin in self._inside(ends[0], outer)]
        unsure = [(spin, True) for spin in ends if not self._at(spin).exact]
        self.share = 0.95 if unsure else 1.0
        return unsure

    def result(self) -> tuple[float, float, int]:
        """Inner end, outer end and outcome, as in `Bracket`."""
        inner, outer = self._ends()
        before = NOT_YET if inner is None else self._at(inner).outcome
        if outer is None:
            return np.nan, np.nan, before
        if self._at(outer).outcome == FAILED:
            return np.nan, np.nan, FAILED
        if inner is None:
            return np.nan, outer, AT_ONCE
        return (np.nan, outer, UNDECIDED) if before == UNDECIDED else (inner, outer, HAPPENS)

    def _at(self, spin: float) -> _Answer:
        return self.known[spin]

    def _ends(self) -> tuple[float | None, float | None]:
        """The last spin before it happens or a simulation fails, and the first at which; None where there is none."""
        inner = None
        for spin in sorted(self.known):
            if self._at(spin).outcome in (HAPPENS, FAILED):
                return inner, spin
            inner = spin
        return inner, None

    def _outwards(self) -> list[tuple[float, bool]]:
        """The next spins of the way outwards: at first all up to the expected spin."""
        first = bisect_left(self._left, self._expected) + (not self._precisely)
        count = _OUTWARDS if self.known else first
        spins = [(spin, False) for spin in self._left[:count]]
        if not self.known and self._precisely:
            spins += [(spin, True) for spin in self._pair(self._expected)]
        del self._left[:count]
        return spins

    def _pair(self, spin: float) -> list[float]:
        """Two spins that are the ends of a bracket narrow enough, if `spin` is right."""
        return [spin * (1 - _HALF * self.width), spin * (1 + _HALF * self.width)]

    def _inside(self, inner: float, outer: float) -> list[float]:
        """Spins to simulate inside a bracket."""
        root = self._root(inner, outer) if outer - inner <= self._before / _PARTS else None
        self._before = np.inf
        if root is not None:
            pair = self._pair(root)
            back = root - _BACK * (root - inner)
            spins = [spin for spin in ([back] if back < pair[0] else []) + pair if inner < spin < outer]
            if spins:
                self._before = outer - inner
                return spins
        return [inner + (outer - inner) * part / _PARTS for part in range(1, _PARTS)]

    def _root(self, inner: float, outer: float) -> float | None:
        """Where the margin vanishes, as far as it tells."""
        nearest = self._at(inner)
        if nearest.outcome != NOT_YET or not nearest.margin > 0:
            return None
        if self._at(outer).margin < 0:
            return inner + (outer - inner) * nearest.margin / (nearest.margin - self._at(outer).margin)
        slope = 1.0
        farther = [s for s in self.known if (1 - _LOCAL) * inner <= s < inner and self._at(s).margin > nearest.margin]
        if farther:
            slope = (self._at(max(farther)).margin - nearest.margin) / (inner - max(farther))
        root = inner + nearest.margin / slope
        return root if root < outer else None


def _way(begin: float, limit: float) -> list[float]:
    """The spins of the way outwards."""
    spins = [min(begin, limit)]
    while spins[-1] < limit:
        spins.append(min(begin * RATIO ** len(spins), limit))
    return spins
