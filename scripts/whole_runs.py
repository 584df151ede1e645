"""Time whole runs of this checkout and of another revision, in turn, warm: from a configuration to a dataset.

    python scripts/whole_runs.py REVISION [--times N] [RUN …]

Each run is timed in a process of its own that has done it once before, so that nothing is compiled or imported.  For
each the smallest time of both is printed, the median, and the ratio of the medians; on a machine that does other things
only the ratio counts.  Then the share of full lanes: the steps that were taken, of those that were computed.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parent.parent

MAP = """{"name": "map", "body": {"a": 10.0, "b": {"start": 1.2, "stop": 9.8, "num": 32}, "delta": 0.03},
    "friction": {"mu": {"start": 20, "stop": 200, "num": 32}}, "start": {"n0": 0.05, "x0": 0.01, "y0": 0.01}}"""

RUNS = {
    "map": f"sweep.run({MAP})",
    "quick": "sweep.run('configs/quick.yaml')",
    "finger": "sweep.run('configs/finger.yaml')",
    "kane_levinson_coulomb": "sweep.run('configs/kane_levinson_coulomb.yaml')",
    "boundaries": "sweep.boundaries('configs/quick.yaml')",
    "fit": "sweep.fit('configs/wooden.yaml', 'configs/wooden_film.csv', ['mu', 'sigma', 'n0', 'x0', 'y0'])",
    "mu_b": "sweep.run('configs/mu_b.yaml')",
}
"""What is timed, by name; `map` has 1024 cells."""

TIMED = "import sweep, time\n{0}\nbegan = time.perf_counter()\n{0}\nprint(time.perf_counter() - began)"

LANES = """
import numpy as np, sweep
from sweep.jit import threads
from sweep.kernels.kernel import Kernel
from sweep.kernels.layout import BLOCK, LANES, PACK
taken, computed, plain = 0.0, 0.0, Kernel.advance
def advance(kernel, images, cells, *rest):
    global taken, computed
    before = kernel.table(images)["done"][cells].sum()
    blocks = plain(kernel, images, cells, *rest)
    taken += kernel.table(images)["done"][cells].sum() - before
    lanes = min(LANES, PACK * np.ceil(np.ceil(len(cells) / threads()) / PACK))
    computed += blocks * BLOCK * lanes
    return blocks
Kernel.advance = advance
{0}
print(taken / computed if computed else 1.0)
"""
"""Prints the share of full lanes in a run, 1 where it has none; a leap counts as its steps, of which there are few."""


def number(checkout: Path, code: str, run: str) -> float:
    """The number that `code` prints of a run of a checkout."""
    command = [sys.executable, "-c", code.format(run)]
    return float(subprocess.run(command, cwd=checkout, check=True, capture_output=True, text=True).stdout)


def main() -> None:
    """Time, and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("revision")
    parser.add_argument("runs", nargs="*", default=[*RUNS], metavar="RUN", help=f"out of {', '.join(RUNS)}")
    parser.add_argument("--times", type=int, default=3, metavar="N")
    asked = parser.parse_intermixed_args()
    with tempfile.TemporaryDirectory() as folder:
        other = Path(folder) / "other"
        subprocess.run(["git", "clone", "-q", str(ROOT), str(other)], check=True)
        subprocess.run(["git", "-C", str(other), "checkout", "-q", asked.revision], check=True)
        for name in asked.runs:
            both = [(number(other, TIMED, RUNS[name]), number(ROOT, TIMED, RUNS[name])) for _ in range(asked.times)]
            theirs, ours = zip(*both, strict=True)
            least = f"{min(theirs):.2f} and {min(ours):.2f} s"
            before, now = statistics.median(theirs), statistics.median(ours)
            print(f"{name}: {least} at least; median {before:.2f} and {now:.2f} s, {before / now:.2f} times as fast;",
                  f"lanes {number(ROOT, LANES, RUNS[name]):.0%} full", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
