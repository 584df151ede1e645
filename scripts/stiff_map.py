"""The map μ × b at n0 = 0.05, 100 × 100 cells to the end, beside plain dopri5 on a random sample of it.

    python scripts/stiff_map.py [--method adams] [--tolerance 1e-6] [--sample 200] [--repeats 3]

Both methods run the same sample in turn, warm, on all threads: medians with the smallest and largest.
Counts that differ are listed with what the runs say of them.  The map's time is that of the whole
command less compilation: planning, simulation, dataset.
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from pathlib import Path

import numpy as np
import xarray as xr

import sweep

N = 100
CONFIG = f"""\
name: stiff_map
body: {{a: 10.0, b: {{start: 1.2, stop: 9.8, num: {N}}}, delta: 0.03}}
friction: {{mu: {{start: 20, stop: 200, num: {N}}}}}
start: {{n0: 0.05, x0: 0.01, y0: 0.01}}
"""
SAMPLE = "body: {a: 10.0, delta: 0.03}\nstart: {n0: 0.05, x0: 0.01, y0: 0.01}\ncases: sample.csv\n"


def timed(path: Path, **overrides: object) -> tuple[float, xr.Dataset]:
    began = time.perf_counter()
    result = sweep.run(path, **overrides)
    return time.perf_counter() - began, result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--method", default="adams")
    parser.add_argument("--tolerance", type=float, default=1e-6)
    parser.add_argument("--sample", type=int, default=200)
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    fast = {"method": options.method, "tolerance": options.tolerance}
    with tempfile.TemporaryDirectory() as folder:
        whole, sample = Path(folder) / "map.yaml", Path(folder) / "sample.yaml"
        whole.write_text(CONFIG)
        sample.write_text(SAMPLE)
        drawn = np.random.default_rng(0).choice(N * N, options.sample, replace=False)
        cells = np.column_stack([np.linspace(20, 200, N)[drawn // N], np.linspace(1.2, 9.8, N)[drawn % N]])
        table = Path(folder) / "sample.csv"
        np.savetxt(table, cells, delimiter=",", header="mu,b", comments="", fmt="%.17g")
        for settings in ({"method": "dopri5"}, fast):
            sweep.run(sample, t_end=1.0, **settings)
        times: dict[str, list[float]] = {"dopri5": [], options.method: []}
        for _ in range(options.repeats):
            seconds, plain = timed(sample, method="dopri5")
            times["dopri5"].append(seconds)
            seconds, ours = timed(sample, **fast)
            times[options.method].append(seconds)
        for name, found in times.items():
            print(f"{name:8} {statistics.median(found):7.2f} s ({min(found):.2f} … {max(found):.2f}) the sample")
        ratio = statistics.median(times["dopri5"]) / statistics.median(times[options.method])
        print(f"{ratio:.1f} times faster on {options.sample} cells")
        report(plain, ours, cells)
        seconds, maps = timed(whole, **fast)
        failed = int((maps["status"] > 2).sum())
        print(f"the map: {seconds:.1f} s for {N * N} cells, {failed} failed, counts 0 … {int(maps['reversals'].max())}")


def report(plain: xr.Dataset, ours: xr.Dataset, cells: np.ndarray) -> None:
    """Equal counts, and those that are not."""
    different = np.flatnonzero(plain["reversals"].values != ours["reversals"].values)
    print(f"equal counts: {1 - len(different) / len(cells):.2%}")
    for i in different:
        said = [
            f"{int(run['reversals'][i])} (last at {float(run['t_last_reversal'][i]):.0f}"
            f"{', noise_limited' if int(run['noise_limited'][i]) else ''})"
            for run in (plain, ours)
        ]
        print(f"  μ = {cells[i, 0]:.2f}, b = {cells[i, 1]:.3f}: dopri5 {said[0]}, other {said[1]}")


if __name__ == "__main__":
    main()
