"""The report: all parts in order, then raw figures, picture and page."""

from __future__ import annotations

import csv
import os
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import llvmlite.binding
import numba
from matplotlib.figure import Figure

from sweep.bench.cost import cost
from sweep.bench.counts import wrong_counts
from sweep.bench.hard import hard_cases
from sweep.bench.peak import peak
from sweep.bench.precision import work_precision
from sweep.bench.timing import Effort, Measurement, Part
from sweep.bench.tolerance import tolerance
from sweep.bench.whole import whole
from sweep.kernels import methods
from sweep.models import MODELS
from sweep.report import page
from sweep.report.direct import MEASURE, simulate, standard
from sweep.report.rows import Row, Section
from sweep.results.writing import replacing

PARTS: tuple[Callable[[Effort], Part], ...] = (work_precision, tolerance, wrong_counts, peak, cost, whole)

COLUMNS = 3
"""Number of panels side by side."""


def bench(output: Path, note: Callable[[str], None] = lambda _: None, effort: Effort | None = None) -> list[Row]:
    """Measure everything, write bench.csv, .png and .html to `output`, and return the hard cases that do not hold."""
    began = time.perf_counter()
    output.mkdir(parents=True, exist_ok=True)
    compile_kernels()
    ready = time.perf_counter()
    note(f"kernels compiled or loaded in {ready - began:.1f} s, which no time below includes")
    parts = []
    for measure in PARTS:
        parts.append(measure(effort or Effort()))
        note(page.text(parts[-1].section))
    parts.append(Part(hard_cases()))
    note(page.text(parts[-1].section))
    write_csv(output / "bench.csv", [m for part in parts for m in part.measurements])
    figure = draw(parts)
    with replacing(output / "bench.png") as temporary:
        figure.savefig(temporary, format="png")
    _write_page(output / "bench.html", parts, figure, time.perf_counter() - began)
    return [row for part in parts for row in part.section.rows if not row.holds]


def compile_kernels() -> None:
    """Compile all that the parts run, so that no time includes a compilation."""
    for name, model in MODELS.items():
        for method in methods.allowed(model):
            for measure in ((), MEASURE):
                simulate(standard(), 1.0, model=name, method=method, measure=measure)


def draw(parts: list[Part]) -> Figure:
    """All panels in one figure."""
    panels = [panel for part in parts for panel in part.panels]
    lines = -(-len(panels) // COLUMNS)
    figure = Figure(figsize=(6 * COLUMNS, 4.6 * lines), dpi=90, layout="constrained")
    grid = figure.subplots(lines, COLUMNS, squeeze=False).ravel()
    for axes, panel in zip(grid, panels, strict=False):
        panel(axes)
        axes.grid(which="major", alpha=0.3)
    for axes in grid[len(panels) :]:
        axes.set_axis_off()
    return figure


def write_csv(path: Path, measurements: list[Measurement]) -> None:
    """Write the raw figures, one per line."""
    head = (
        "section",
        "model",
        "method",
        "case",
        "setting",
        "at",
        "quantity",
        "median",
        "smallest",
        "largest",
        "repeats",
    )
    with replacing(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(head)
        for m in measurements:
            values = m.spread.values
            figures = [f"{v:.6g}" for v in (statistics.median(values), min(values), max(values))]
            writer.writerow(
                [m.section, m.model, m.method, m.case, m.setting, f"{m.at:.8g}", m.quantity, *figures, len(values)]
            )


def _write_page(path: Path, parts: list[Part], figure: Figure, seconds: float) -> None:
    about = (
        f"Measured in {seconds:.0f} s on {numba.get_num_threads()} threads of {os.cpu_count()} "
        f"({llvmlite.binding.get_host_cpu_name()}), load {os.getloadavg()[0]:.1f} at the end. Raw figures: bench.csv."
    )
    sections = [
        Section("Overview", figures=[("speed, error and cost", figure)]),
        *(part.section for part in parts),
    ]
    page.write(path, "sweep: speed against error", about, sections, ("method", "expected", "found"))
