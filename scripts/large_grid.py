"""Peak memory and time of large sweeps: of whole runs of the cheap models, and of --dry-run.

python scripts/large_grid.py [--cells 10000000] [--dry 100000000]

Each in a process of its own, whose children (a compiler) are counted too.  Exits 1 beyond the bound.
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

BOUND = 2.0
"""GiB."""

RUNS = {
    "analytic": "model: analytic\n",
    "averaged": "model: averaged\nintegrator: {t_end: 20}\n",
}


def configuration(head: str, cells: int) -> str:
    """About so many cells: friction × shape, three start spins."""
    n = math.isqrt(cells // 3) + 1
    return (
        f"name: large\n{head}body: {{b: {{start: 1.5, stop: 9, num: {n}}}}}\n"
        f"friction: {{mu: {{start: 20, stop: 200, num: {n}}}}}\nstart: {{n0: [0.02, 0.05, 0.1]}}\n"
    )


def measure(text: str, *arguments: str) -> tuple[float, float]:
    """Peak memory in GiB and seconds of `sweep run`."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "large.yaml"
        file.write_text(text, encoding="utf-8")
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
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=10_000_000)
    parser.add_argument("--dry", type=int, default=100_000_000)
    asked = parser.parse_args()
    within = True
    for name, head in RUNS.items():
        for cells, arguments in ((asked.dry, ["--dry-run"]), (asked.cells, [])):
            peak, seconds = measure(configuration(head, cells), *arguments)
            within &= peak < BOUND
            print(f"{name} {' '.join(arguments)}, {cells:.0e} cells: {peak:.2f} GiB, {seconds:.0f} s", flush=True)
    sys.exit(0 if within else 1)


if __name__ == "__main__":
    main()
