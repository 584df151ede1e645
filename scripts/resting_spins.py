"""Compares `spin_rest` with the spins of runs that go on until nothing changes any more.

    python scripts/resting_spins.py [CELLS]

The cells are those of a coarse `configs/mu_b.yaml` at n0 = 0.05, and CELLS of `data/reference_wide.csv`.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path
from typing import Any

import comparison
import numpy as np

import sweep
from sweep.config import Config
from sweep.kernels.status import SETTLED
from sweep.parameters import PAPER_PARAMETERS

ROOT = Path(__file__).parent.parent
MEASURE = ["reversals", "energy_error", "resting_spin"]
ENDS = (1e5, 1.5e5)
"""Times in sqrt(c/g) between which the spin of a cell that counts changes by less than 1e-5 of itself."""


def compare(name: str, config: Config, **axes: Any) -> str:
    """Tell how far the resting spins of settled cells are off."""
    settings: dict[str, Any] = {"measure": MEASURE, "tolerance": 1e-9, "estimate_errors": False} | axes
    left = sweep.run(config, t_end=30_000.0, **settings)
    first, last = (
        sweep.run(config, t_end=t_end, stop_when_settled=False, **settings).spin_final.values for t_end in ENDS
    )
    settled = (left.status == SETTLED).values
    still = settled & (np.abs(first / last - 1) < 1e-5)
    told = still & np.isfinite(left.spin_rest.values)
    off = np.abs(left.spin_rest.values / last - 1)[told]
    left_off = np.abs(left.spin_final.values / last - 1)[told]
    shares = [f"{np.mean(off > limit):.1%} by more than {limit:.1%}" for limit in (1e-3, 1e-2)]
    return (
        f"{name}: {settled.sum()} settled cells, {still.sum()} of known end, {told.sum()} tell it; "
        f"off by {np.median(off):.1e} (median), {', '.join(shares)}, {off.max():.1%} at most; "
        f"where they were left, the spin was off by {np.median(left_off):.1%} (median)"
    )


def main(count: int = 150) -> None:
    """Print a line for each domain."""
    names = [*PAPER_PARAMETERS]
    with (ROOT / "data" / "reference_wide.csv").open(encoding="utf-8") as stream:
        rows = [{name: row[name] for name in names if name in row} for row in csv.DictReader(stream)]
    axes = {"n0": 0.05, "mu": np.linspace(20, 200, 12), "b": np.linspace(1.2, 8.6, 12)}
    print(compare("mu_b", sweep.load_config(ROOT / "configs" / "mu_b.yaml"), **axes), flush=True)
    print(compare("wide", comparison.table(rows[:count])), flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
