"""A map of 100 × 100 cells over μ and b, run to the end, beside plain dopri5 on a random sample of it.

Both methods run the sample in turns, with compiled kernels, on all threads; times are medians with the smallest and the
largest.  Cells whose counts differ are listed with what each run says about them.  The map's time is that of the whole
command without compilation: planning, simulation, dataset.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from sweep.bench.studies.maps import draw_cells, timed_run, write_map
from sweep.bench.timing import Spread
from sweep.engine.run import run
from sweep.grid import Array
from sweep.kernels.status import FAILURES

N = 100


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m sweep.bench.studies.stiff_map", description=__doc__)
    parser.add_argument("--method", default="adams", help="method to compare with dopri5 (default adams)")
    parser.add_argument("--tolerance", type=float, default=1e-6, help="its tolerance (default 1e-6)")
    parser.add_argument("--sample", type=int, default=200, help="cells in the sample (default 200)")
    parser.add_argument("--repeats", type=int, default=3, help="runs of each method (default 3)")
    options = parser.parse_args()
    methods: dict[str, dict[str, Any]] = {"dopri5": {"method": "dopri5"}}
    methods[options.method] = {"method": options.method, "tolerance": options.tolerance}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        whole = write_map(folder, "map", (N, N))
        cells = draw_cells(N, options.sample)
        np.savetxt(folder / "sample.csv", cells, delimiter=",", header="mu,b", comments="", fmt="%.17g")
        sample = folder / "sample.yaml"
        sample.write_text("cases: sample.csv\n", encoding="utf-8")
        for settings in methods.values():
            run(sample, t_end=1.0, **settings)  # compiles
        times: dict[str, list[float]] = {method: [] for method in methods}
        found = {}
        for _ in range(options.repeats):
            for method, settings in methods.items():
                seconds, found[method] = timed_run(sample, **settings)
                times[method].append(seconds)
        spreads = {method: Spread(tuple(seconds)) for method, seconds in times.items()}
        for method, spread in spreads.items():
            print(f"{method:8} {spread:.2f} s for the sample")
        ratio = spreads["dopri5"].median / spreads[options.method].median
        print(f"{ratio:.1f} times faster on {options.sample} cells")
        compare(found["dopri5"], found[options.method], cells)
        seconds, maps = timed_run(whole, **methods[options.method])
    failed = int(maps["status"].isin(FAILURES).sum())
    print(f"the map: {seconds:.1f} s for {N * N} cells, {failed} failed, counts 0 … {int(maps['reversals'].max())}")


def compare(plain: xr.Dataset, other: xr.Dataset, cells: Array) -> None:
    """Print the share of equal counts, and the cells that differ."""
    different = np.flatnonzero(plain["reversals"].values != other["reversals"].values)
    print(f"equal counts: {1 - len(different) / len(cells):.2%}")
    for i in different:
        counts = [
            f"{int(result['reversals'][i])} (last at {float(result['t_last_reversal'][i]):.0f}"
            f"{', noise_limited' if int(result['noise_limited'][i]) else ''})"
            for result in (plain, other)
        ]
        print(f"  μ = {cells[i, 0]:.2f}, b = {cells[i, 1]:.3f}: dopri5 {counts[0]}, other {counts[1]}")


if __name__ == "__main__":
    main()
