"""Compares the estimated errors of spins with true ones, over tables made by `scripts/reference_wide.py`.

    python scripts/spin_errors.py adams 1e-6,1e-8,1e-10 data/reference_wide.csv [TABLE …]

A cell counts where the reference is sharp to a tenth of the tolerance; it says that it misses where its estimate is
above the tolerance.
"""

from __future__ import annotations

import csv
import sys
import time
from pathlib import Path

import comparison
import numpy as np

import sweep
from sweep.kernels.status import TIME_LIMIT
from sweep.parameters import PAPER_PARAMETERS


def compare(method: str, tolerance: float, table: Path) -> str:
    """Run the cells of a table, and tell how many keep the tolerance, and how near the estimates are."""
    with table.open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    names = [name for name in PAPER_PARAMETERS if name in rows[0]]
    began = time.perf_counter()
    found = sweep.run(
        comparison.table({name: row[name] for name in names} for row in rows), method=method, tolerance=tolerance,
        t_end=400.0, stop_when_settled=False,
    )  # fmt: skip
    seconds = time.perf_counter() - began
    true, known = (np.array([float(row[name]) for row in rows]) for name in ("spin_400", "uncertainty_400"))
    error, told = np.abs(found["spin_final"].values - true), found["spin_error"].values
    sharp = (found["status"].values == TIME_LIMIT) & (known < tolerance / 10)
    steps = np.mean(400 / found["step"].values[sharp])
    said = comparison.words(error, told, tolerance, sharp)
    return f"{table.name} {method} {tolerance:g}: {said}; {steps:.0f} steps a cell, {seconds:.1f} s"


if __name__ == "__main__":
    for path in sys.argv[3:]:
        for asked in sys.argv[2].split(","):
            print(compare(sys.argv[1], float(asked), Path(path)), flush=True)
