"""Which features have met: of several draws, the machine takes the one whose features have met least."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any

Features = frozenset[str]
"""What a draw consists of: parameters that vary, settings that differ from their defaults, words of a command."""


class Meetings:
    """The pairs of features that a machine has had together.

    Rare features would otherwise hardly ever meet: two of which each is in one draw of 50 meet in one of 2,500.
    """

    def __init__(self) -> None:
        self._known: set[tuple[str, str]] = set()
        self._taken: dict[str, int] = {}

    def newest(self, draws: Sequence[Any], features: Sequence[Features]) -> Any:
        """Return the draw with the largest share of new pairs; the same one whenever the same are offered.

        Hypothesis repeats an example that fails, and shrinks it.
        """
        key = repr([sorted(each) for each in features])
        if key not in self._taken:
            pairs = [{*combinations(sorted(each), 2)} for each in features]
            shares = [len(some - self._known) / max(len(some), 1) for some in pairs]
            self._taken[key] = shares.index(max(shares))
            self._known |= pairs[self._taken[key]]
        return draws[self._taken[key]]


def features(defaults: dict[str, Any], flat: dict[str, Any]) -> Features:
    """Return what a configuration has that the paper's has not: keys, with what is varied or chosen."""
    found = set()
    for path, value in flat.items():
        if isinstance(value, dict):  # a range, a distribution or a table
            found.add(f"{path}: {','.join(sorted(value))}")
        elif isinstance(value, list):
            found |= {f"{path}: {each}" if isinstance(each, str) else f"{path}: list" for each in value}
        elif defaults.get(path) != value:
            found.add(f"{path}: {value}" if isinstance(value, str | bool) else path)
    return frozenset(found)
