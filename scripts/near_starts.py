"""Tells how many counts of random cells of the wide domain a start 1e-10 apart changes, and how many of them said so.

python scripts/near_starts.py CELLS SEED
"""

from __future__ import annotations

import csv
import sys
import tempfile
from pathlib import Path

import numpy as np
import reference_wide
import xarray as xr

import sweep
from sweep.kernels.status import SETTLED, TIME_LIMIT
from sweep.parameters import START

NUDGE = 1 + 1e-10


def run(cells: list[reference_wide.Cell]) -> xr.Dataset:
    """Run the cells as a user would, to the end of all reversals."""
    with tempfile.TemporaryDirectory() as folder:
        with (Path(folder) / "cells.csv").open("w", newline="", encoding="utf-8") as stream:
            writer = csv.DictWriter(stream, list(cells[0]))
            writer.writeheader()
            writer.writerows(cells)
        (Path(folder) / "cells.yaml").write_text("name: cells\ncases: cells.csv\n", encoding="utf-8")
        return sweep.run(Path(folder) / "cells.yaml", verify=0.0)


def main(count: int, seed: int) -> None:
    """Run all cells twice."""
    drawn: list[reference_wide.Cell] = []
    while len(drawn) < count:
        drawn += reference_wide.draw(seed)
        seed += 1
    drawn = drawn[:count]
    first = run(drawn)
    near = run([{name: value * NUDGE if name in START else value for name, value in cell.items()} for cell in drawn])
    sound = np.isin(first.status, (SETTLED, TIME_LIMIT)) & np.isin(near.status, (SETTLED, TIME_LIMIT))
    changed = sound & (first.reversals != near.reversals).values
    said = (first.sensitive == 1).values
    words = {"sensitive": said, "missed": (first.step_rule == 4).values}
    words |= {"noise_limited": (first.noise_limited == 1).values, "at the limit": (first.status == TIME_LIMIT).values}
    words |= {"window_dependent": (first.window_dependent == 1).values}
    any_ = np.any(list(words.values()), axis=0)
    print(f"{sound.sum()} sound cells; {changed.sum()} counts change, {(changed & said).sum()} of them sensitive")
    print(", ".join(f"{name}: {(changed & flag).sum()} of {(sound & flag).sum()}" for name, flag in words.items()))
    print(f"none of these words: {(changed & ~any_).sum()}")


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
