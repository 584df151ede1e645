"""Brackets the first spin, outwards from zero, at which something happens: for many searches at once."""

from __future__ import annotations

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

# Spins simulated at once, of each search: on the way outwards, and inside a bracket.  One by one, a few searches would
# leave most lanes of the kernels idle.
_OUTWARDS, _INSIDE = 4, 3

Ask = Callable[[Array, Array], Array]
"""(indices of searches, a |spin| for each) -> what the simulations say, all of shape (simulations,)."""


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


def search(ask: Ask, begin: Array, limit: Array | float, width: float) -> Bracket:
    """Go outwards from |spin| = `begin` by factors of `RATIO`, then narrow the bracket.

    The way outwards ends at the first spin at which it happens, and also where a simulation fails, because it might
    have happened there.  A simulation that reaches its time limit is passed over.

    Parameters
    ----------
    begin : shape (searches,)
    limit : largest |spin| to examine, a number or of shape (searches,)
    width : of the brackets, relative to their outer ends
    """
    inner, outer = np.full((2, len(begin)), np.nan)
    at_inner, at_outer = np.full((2, len(begin)), NOT_YET)
    limit = np.broadcast_to(limit, begin.shape)

    def follow(which: Array, spins: Array) -> None:
        """Move the ends of the brackets `which` to those of `spins`, of shape (searches, spins), that say most."""
        outcomes = ask(np.repeat(which, spins.shape[1]), spins.ravel()).reshape(spins.shape)
        # How many spins there are before the first one that ends the way outwards.
        before = (~np.logical_or.accumulate(np.isin(outcomes, (HAPPENS, FAILED)), axis=1)).sum(axis=1)
        for end, code, place in ((inner, at_inner, before - 1), (outer, at_outer, before)):
            row = np.flatnonzero((place >= 0) & (place < spins.shape[1]))
            end[which[row]], code[which[row]] = spins[row, place[row]], outcomes[row, place[row]]

    walking, steps = np.arange(len(begin)), np.arange(_OUTWARDS)
    while len(walking):
        follow(walking, np.minimum(begin[walking, None] * RATIO**steps, limit[walking, None]))
        walking = walking[np.isnan(outer[walking]) & (inner[walking] < limit[walking])]
        steps += _OUTWARDS
    while len(wide := np.flatnonzero((at_outer == HAPPENS) & (outer - inner > width * outer))):
        follow(wide, np.linspace(inner[wide], outer[wide], _INSIDE + 2, axis=-1)[:, 1:-1])

    outcome = np.where((at_outer == HAPPENS) & np.isnan(inner), AT_ONCE, at_outer)
    outcome[np.isin(outcome, (HAPPENS, NOT_YET)) & (at_inner == UNDECIDED)] = UNDECIDED
    inner[outcome != HAPPENS] = np.nan
    outer[at_outer != HAPPENS] = np.nan
    return Bracket(inner, outer, outcome)
