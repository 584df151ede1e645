"""Tells how many counts of random cells of the wide domain a start 1e-10 apart changes, and how many of them said so.

python scripts/near_starts.py CELLS SEED
"""

from __future__ import annotations

import sys

import comparison
import numpy as np
import reference_wide

import sweep
from sweep.kernels.method import MISSED
from sweep.kernels.status import SETTLED, TIME_LIMIT
from sweep.parameters import START

NUDGE = 1 + 1e-10


def main(count: int, seed: int) -> None:
    """Run all cells twice."""
    drawn: list[reference_wide.Cell] = []
    while len(drawn) < count:
        drawn += reference_wide.draw(seed)
        seed += 1
    drawn = drawn[:count]
    first = sweep.run(comparison.table(drawn))
    nudged = [{name: value * NUDGE if name in START else value for name, value in cell.items()} for cell in drawn]
    near = sweep.run(comparison.table(nudged))
    sound = np.isin(first.status, (SETTLED, TIME_LIMIT)) & np.isin(near.status, (SETTLED, TIME_LIMIT))
    changed = sound & (first.reversals != near.reversals).values
    said = (first.sensitive == 1).values
    words = {"sensitive": said, "missed": (first.step_rule == MISSED).values}
    words |= {"noise_limited": (first.noise_limited == 1).values, "at the limit": (first.status == TIME_LIMIT).values}
    words |= {"window_dependent": (first.window_dependent == 1).values}
    any_ = np.any(list(words.values()), axis=0)
    print(f"{sound.sum()} sound cells; {changed.sum()} counts change, {(changed & said).sum()} of them sensitive")
    print(", ".join(f"{name}: {(changed & flag).sum()} of {(sound & flag).sum()}" for name, flag in words.items()))
    print(f"none of these words: {(changed & ~any_).sum()}")


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
