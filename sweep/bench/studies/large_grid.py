"""Peak memory and time of large sweeps: whole runs of the cheap models, and --dry-run.

Each command runs in a process of its own; its children (a compiler) are counted too.  Exits with 1 if one of them
needs more than 2 GiB.
"""

from __future__ import annotations

import argparse
import math
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from sweep.bench.studies.maps import write_map

BOUND = 2.0
"""GiB."""

STARTS = "start: {n0: [0.02, 0.05, 0.1]}\n"
MODELS = {
    "analytic": "model: analytic\n",
    "averaged": "model: averaged\nintegrator: {t_end: 20}\n",
}


def measure(name: str, cells: int, *arguments: str) -> tuple[float, float]:
    """Peak memory in GiB and seconds of `sweep run` on about so many cells: friction × shape, three start spins."""
    side = math.isqrt(cells // 3) + 1
    with tempfile.TemporaryDirectory() as folder:
        file = write_map(Path(folder), "large", (side, side), STARTS + MODELS[name])
        command = [sys.executable, "-m", "sweep", "run", str(file), "--output", f"{folder}/out", *arguments]
        began = time.perf_counter()
        process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
        _, status, used = os.wait4(process.pid, 0)
        if status:
            sys.exit(f"failed: {' '.join(command)}")
        size = sum(path.stat().st_size for path in Path(folder, "out").rglob("*")) if not arguments else 0
    print(f"  {size / 2**20:.0f} MiB written", flush=True)
    return used.ru_maxrss / 2**20, time.perf_counter() - began


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m sweep.bench.studies.large_grid", description=__doc__)
    parser.add_argument("--cells", type=int, default=10_000_000, help="of the whole runs (default 10 million)")
    parser.add_argument("--dry", type=int, default=100_000_000, help="of the dry runs (default 100 million)")
    options = parser.parse_args()
    within = True
    for name in MODELS:
        for cells, arguments in ((options.dry, ["--dry-run"]), (options.cells, [])):
            peak, seconds = measure(name, cells, *arguments)
            within &= peak < BOUND
            print(f"{name} {' '.join(arguments)}, {cells:.0e} cells: {peak:.2f} GiB, {seconds:.0f} s", flush=True)
    sys.exit(0 if within else 1)


if __name__ == "__main__":
    main()
