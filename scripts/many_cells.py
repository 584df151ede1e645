"""Processor time and memory of whole runs, pictures included, from 10³ cells on: `data/many_cells.csv` and its picture.

    python scripts/many_cells.py [LARGEST]

LARGEST is the number of cells of the last run, by default 10⁷.  A cell is cheap, so that what is measured is what goes
on around the kernel: dopri5 to t = 2, reversals alone, no second run for the error, and no look at what comes after.
"""

from __future__ import annotations

import csv
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parent.parent
TABLE, PICTURE = ROOT / "data" / "many_cells.csv", ROOT / "docs" / "_static" / "many_cells.png"
CONFIG = """\
name: cells
friction: {{mu: {{start: 20, stop: 200, num: {frictions}}}}}
start: {{n0: {{start: 0.02, stop: 0.1, num: {spins}}}}}
measure: [reversals]
integrator: {{method: dopri5, t_end: 2, estimate_errors: false, stop_when_settled: false}}
"""


def measured(frictions: int, spins: int) -> tuple[float, float]:
    """Processor time in s of a run in a process of its own, and its largest memory in MiB."""
    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder) / "cells.yaml"
        config.write_text(CONFIG.format(frictions=frictions, spins=spins), encoding="utf-8")
        command = [sys.executable, "-m", "sweep", "run", str(config), "--output", folder, "--quiet"]
        _, status, used = os.wait4(subprocess.Popen(command, cwd=ROOT).pid, 0)
        if status:
            raise RuntimeError(f"{frictions} × {spins} cells: the run ended with status {status}")
        return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def draw(rows: list[dict[str, float]]) -> None:
    """Draw processor time a cell and largest memory over the number of cells."""
    from matplotlib.figure import Figure

    figure = Figure((7.5, 3.2), dpi=110, layout="constrained")
    names = {"microseconds_per_cell": "processor time per cell, µs", "mebibytes": "largest memory, MiB"}
    for axes, (name, label) in zip(figure.subplots(1, 2), names.items(), strict=True):
        axes.loglog([row["cells"] for row in rows], [row[name] for row in rows], "o-")
        axes.set(xlabel="cells", ylabel=label)
        axes.grid(alpha=0.3)
    axes.axhline(2048, color="grey", linestyle="--")
    figure.savefig(PICTURE)


def main(largest: float = 1e7) -> None:
    measured(10, 10)  # compiles
    rows, spins = list[dict[str, float]](), 10
    while (cells := 100 * spins) <= largest:
        seconds, memory = measured(100, spins)
        rows.append({"cells": cells, "seconds": round(seconds, 2), "mebibytes": round(memory),
                     "microseconds_per_cell": round(1e6 * seconds / cells, 2)})  # fmt: skip
        print(rows[-1], flush=True)
        with TABLE.open("w", newline="", encoding="utf-8") as stream:
            writer = csv.DictWriter(stream, list(rows[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
        draw(rows)
        spins *= 10


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
