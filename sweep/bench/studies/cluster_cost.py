"""Time of a run in worker processes beside the same run in as many threads.

The two take turns.  What is compared is the time of the tiles; starting the workers, and their first tile, which loads
the kernel, are given apart.  On a busy machine read the ratios of neighbouring rounds and their spread, not single
times.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from pathlib import Path
from statistics import median

import numba

from sweep.bench.studies.maps import timed_run, write_map
from sweep.config import load_config
from sweep.engine.cluster import connected


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m sweep.bench.studies.cluster_cost", description=__doc__)
    parser.add_argument("--workers", type=int, default=2, help="worker processes, and threads (default 2)")
    parser.add_argument("--rounds", type=int, default=5, help="(default 5)")
    parser.add_argument("--t-end", type=float, default=300.0, help="time limit in sqrt(c/g) (default 300)")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        file = write_map(Path(folder), "cluster_cost", (46, 100), "start: {n0: [0.02, 0.05, 0.1]}\n")
        config = load_config(file, {"t_end": options.t_end})
    numba.set_num_threads(options.workers)
    timed_run(config)  # loads the kernel
    began = time.perf_counter()
    with connected(options.workers, None) as cluster:
        start = time.perf_counter() - began
        first, _ = timed_run(config, cluster=cluster)
        rounds = []
        for _ in range(options.rounds):
            rounds.append((timed_run(config)[0], timed_run(config, cluster=cluster)[0]))
            print(f"threads {rounds[-1][0]:.2f} s, workers {rounds[-1][1]:.2f} s", flush=True)
    ratios = sorted(workers / threads for threads, workers in rounds)
    threads, workers = (median(column) for column in zip(*rounds, strict=True))
    print(f"{options.workers} workers beside {options.workers} threads, load {os.getloadavg()[0]:.1f}")
    print(f"start of the workers {start:.1f} s, first round {first - workers:.1f} s longer than the others")
    print(f"medians: threads {threads:.2f} s, workers {workers:.2f} s")
    print(f"workers / threads: median {median(ratios):.3f}, {ratios[0]:.3f} to {ratios[-1]:.3f}")


if __name__ == "__main__":
    main()
