"""What processes cost beside threads: the same cells with --workers N and with N threads, in turns.

python scripts/cluster_cost.py [--workers 2] [--rounds 5] [--t-end 300]

Compares the time of the tiles alone; the start of the workers and their first tile, which loads the kernel, are told
apart.  On a machine with other work read the ratios of neighbouring rounds and their spread, not single times.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path
from statistics import median

import numba

from sweep import load_config
from sweep.config import Config
from sweep.engine.cluster import Cluster, connected
from sweep.engine.run import run

ROOT = Path(__file__).parent.parent


def seconds(config: Config, cluster: Cluster | None) -> float:
    began = time.perf_counter()
    run(config, cluster=cluster)
    return time.perf_counter() - began


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--t-end", type=float, default=300.0)
    asked = parser.parse_args()
    axis = {"start": 1.5, "stop": 9.0, "num": 100}
    config = load_config(ROOT / "configs" / "mu_b.yaml", {"t_end": asked.t_end, "b": axis})
    numba.set_num_threads(asked.workers)
    seconds(config, None)  # the kernel's first call
    began = time.perf_counter()
    with connected(asked.workers, None) as cluster:
        start = time.perf_counter() - began
        first = seconds(config, cluster)
        rounds = []
        for _ in range(asked.rounds):
            rounds.append((seconds(config, None), seconds(config, cluster)))
            print(f"threads {rounds[-1][0]:.2f} s, workers {rounds[-1][1]:.2f} s", flush=True)
    ratios = sorted(workers / threads for threads, workers in rounds)
    threads, workers = (median(column) for column in zip(*rounds, strict=True))
    print(f"{asked.workers} workers beside {asked.workers} threads, load {os.getloadavg()[0]:.1f}")
    print(f"start of the workers {start:.1f} s, first round {first - workers:.1f} s longer than the others")
    print(f"medians: threads {threads:.2f} s, workers {workers:.2f} s")
    print(f"workers / threads: median {median(ratios):.3f}, {ratios[0]:.3f} to {ratios[-1]:.3f}")


if __name__ == "__main__":
    main()
