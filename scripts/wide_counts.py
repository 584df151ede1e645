"""Certain counts of fresh wide cells, followed to their ends by the Taylor series of `reference_counts_500.py`.

    python scripts/wide_counts.py CELLS SEED [SECONDS]

The cells are those of `estimates.py`; none was looked at before if the seed is fresh.  A cell whose Taylor series would
take longer than about SECONDS (60) is named and not followed: a large μ to a late time.
"""

from __future__ import annotations

import sys
import time

import numpy as np
import reference_counts_500 as reference
import reversals
from estimates import wide

import sweep

STEPS_PER_SECOND = 8e5
"""The product of μ and time that a Taylor series covers in a second."""


def counted(cell: dict[str, float], until: float, series: object) -> set[int]:
    """The counts of a cell by windows from the start, and by windows half a window later."""
    reversals.T_END = reference.T_END = max(1.05 * until, 1000.0)
    run = reference.follow(cell, series, float)
    means = [np.append(cell["n0"], run.averages(shift).astype(float)) for shift in (0, 1)]
    return {int((each[1:] * each[:-1] < 0).sum()) for each in means}


def main(cells: int, seed: int, seconds: float) -> None:
    """Print a line for each cell that differs or is not followed, and the totals."""
    config = wide(cells, seed, slowed=False)
    found, series = sweep.run(config), reference.make_integrator(float, reference.TOLERANCE)
    names = found["status"].attrs["flag_meanings"].split()
    statuses = {name: number for code, name in enumerate(names) if (number := int((found["status"] == code).sum()))}
    print(f"{cells} cells: {statuses}, {int(found['certain'].sum())} certain", flush=True)
    totals = dict.fromkeys(("followed", "false", "not followed"), 0)
    for i in np.flatnonzero(found["certain"].values == 1):
        cell = {name: values[i] for name, values in config["cases"].items()}
        until, count = float(found["t_stop"][i]), int(found["reversals"][i])
        if cell["mu"] * max(until, 1000) > seconds * STEPS_PER_SECOND:
            totals["not followed"] += 1
            continue
        counts = counted(cell, until, series)
        totals["followed"] += 1
        if count not in counts:
            totals["false"] += 1
            print(f"false: {cell}: {count} certain, {counts} by Taylor series", flush=True)
    print(f"{totals}, {time.process_time():.0f} s of processor time")


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]) if sys.argv[3:] else 60.0)
