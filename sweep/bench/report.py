"""Writes the report: speed against error and the hard cases, as a page, a picture and a table of raw figures."""

from __future__ import annotations

import csv
import os
import time
from collections.abc import Callable
from pathlib import Path

import llvmlite.binding
import numba

from sweep.bench import precision
from sweep.bench.hard import hard_cases
from sweep.bench.precision import Effort, Measured
from sweep.report import page
from sweep.report.rows import Row
from sweep.results.writing import replacing

HEAD = ("model", "method", "case", "step", "spin_error", "ms_median", "ms_smallest", "ms_largest", "repeats",
        "trajectories")  # fmt: skip
"""The columns of bench.csv; times are per trajectory."""


def bench(output: Path, note: Callable[[str], None] = lambda _: None, effort: Effort | None = None) -> list[Row]:
    """Measure everything, write bench.csv, .png and .html to `output`, and return the hard cases that fail."""
    began, effort = time.perf_counter(), effort or Effort()
    output.mkdir(parents=True, exist_ok=True)
    found = precision.measure(effort)
    speed = precision.section(found, effort)
    note(page.text(speed))
    hard = hard_cases()
    note(page.text(hard))
    write_table(output / "bench.csv", found)
    with replacing(output / "bench.png") as temporary:
        speed.figures[0][1].savefig(temporary, format="png")
    about = (
        f"Measured in {time.perf_counter() - began:.0f} s on {numba.get_num_threads()} threads of {os.cpu_count()} "
        f"({llvmlite.binding.get_host_cpu_name()}), load {os.getloadavg()[0]:.1f} at the end. Raw figures: bench.csv."
    )
    heads = ("method", "expected", "found")
    page.write(output / "bench.html", "sweep: speed against error", about, [speed, hard], heads)
    return [row for row in hard.rows if not row.holds]


def write_table(path: Path, found: list[Measured]) -> None:
    """Write a line for each step that was measured."""
    with replacing(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as stream:
        lines = csv.writer(stream, lineterminator="\n")
        lines.writerow(HEAD)
        for each in found:
            point, times = each.point, each.cost
            figures = (f"{x:.6g}" for x in (point.step, point.error, times.median, *times.ends))
            lines.writerow([point.model, point.method, point.case, *figures, len(times.values), point.trajectories])
