"""The report: all sections in order, then raw figures, picture and page."""

from __future__ import annotations

import csv
import os
import time
from collections.abc import Callable
from pathlib import Path

import llvmlite.binding
import numba
from matplotlib.figure import Figure

from sweep.bench.cost import cost, kernels, step_times
from sweep.bench.hard import hard_cases
from sweep.bench.precision import work_precision
from sweep.bench.section import LINE, BenchSection
from sweep.bench.timing import Effort
from sweep.bench.tolerance import tolerance
from sweep.bench.whole import whole
from sweep.report import page
from sweep.report.rows import Row, Section
from sweep.results.writing import replacing

SECTIONS: tuple[Callable[[Effort], BenchSection], ...] = (
    work_precision, tolerance, step_times, cost, whole, hard_cases,
)  # fmt: skip

COLUMNS = 3
"""Number of panels side by side."""


def bench(output: Path, note: Callable[[str], None] = lambda _: None, effort: Effort | None = None) -> list[Row]:
    """Measure everything, write bench.csv, .png and .html to `output`, and return the hard cases that do not hold."""
    began = time.perf_counter()
    output.mkdir(parents=True, exist_ok=True)
    list(kernels())  # compiles
    note(f"kernels compiled or loaded in {time.perf_counter() - began:.1f} s, which no time below includes")
    sections = []
    for measure in SECTIONS:
        sections.append(measure(effort or Effort()))
        note(page.text(sections[-1]))
    with replacing(output / "bench.csv") as temporary, temporary.open("w", newline="", encoding="utf-8") as stream:
        lines = csv.writer(stream, lineterminator="\n")
        lines.writerow(LINE)
        lines.writerows(line for section in sections for line in section.readings)
    figure = draw(sections)
    with replacing(output / "bench.png") as temporary:
        figure.savefig(temporary, format="png")
    about = (
        f"Measured in {time.perf_counter() - began:.0f} s on {numba.get_num_threads()} threads of {os.cpu_count()} "
        f"({llvmlite.binding.get_host_cpu_name()}), load {os.getloadavg()[0]:.1f} at the end. Raw figures: bench.csv."
    )
    overview = Section("Overview", figures=[("speed, error and cost", figure)])
    heads = ("method", "expected", "found")
    page.write(output / "bench.html", "sweep: speed against error", about, [overview, *sections], heads)
    return [row for section in sections for row in section.rows if not row.holds]


def draw(sections: list[BenchSection]) -> Figure:
    """All panels in one figure."""
    panels = [panel for section in sections for panel in section.panels]
    lines = -(-len(panels) // COLUMNS)
    figure = Figure(figsize=(6 * COLUMNS, 4.6 * lines), dpi=90, layout="constrained")
    grid = figure.subplots(lines, COLUMNS, squeeze=False).ravel()
    for axes, panel in zip(grid, panels, strict=False):
        panel(axes)
        axes.grid(which="major", alpha=0.3)
        if axes.get_legend_handles_labels()[1]:
            axes.legend(fontsize=7)
    for axes in grid[len(panels) :]:
        axes.set_axis_off()
    return figure
