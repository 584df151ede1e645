"""Whole runs, from parameters to dataset, beside the kernel inside them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from sweep.bench.section import BenchSection, Spread, colour, curve, marker
from sweep.bench.stopwatch import Place, stopwatch
from sweep.bench.timing import LONGEST, T_END, Effort, in_turn
from sweep.engine import plan
from sweep.engine.plan import Plan
from sweep.engine.run import run
from sweep.engine.whole import Whole
from sweep.kernels import methods
from sweep.kernels.adams import start_up
from sweep.kernels.kernel import Kernel
from sweep.kernels.method import TOLERANCE
from sweep.kernels.methods import AUTO, METHODS
from sweep.kernels.status import TIME_LIMIT
from sweep.models import MODELS
from sweep.report.direct import simulate, standard
from sweep.report.rows import Table

PLACES: dict[Place, str] = {
    (plan, "choose"): "planning",
    (plan, "fill"): "planning",
    (start_up, "start_up"): "start-up",
    (Kernel, "advance"): "kernel",
    **{(kind, "carry"): "carrying" for kind in (Kernel, *Kernel.__subclasses__()) if "carry" in vars(kind)},
    (Plan, "results"): "dataset",
    (Whole, "dataset"): "dataset",
}
"""What is timed inside a run.  The time of the kernel includes that of lanes which wait for the last trajectories."""

COMPARED = 16
"""Cells of a run that are compared with a tight one."""

BASE = {"friction": {"mu": 60.0}}
"""The configuration of all runs, whose other values are the paper's; what differs is given beside it."""

REFERENCE = {"mu": np.linspace(20, 200, 46), "b": np.linspace(1.2, 9.8, 44), "n0": np.array([0.02, 0.05, 0.1])}
"""Axes of `configs/mu_b.yaml`, in their order."""


@dataclass
class WholeRun:
    """Runs of one configuration, and where their time went."""

    settings: dict[str, Any]
    """What replaces values of `BASE`: the axes as arrays, and method and t_end among others."""
    shares: list[dict[str, float]] = field(default_factory=list)
    """Seconds by share, one entry for each run."""
    dataset: xr.Dataset | None = None
    """That of the last run."""

    def __post_init__(self) -> None:
        self.method, self.t_end = self.settings["method"], self.settings["t_end"]
        self.cells = int(np.prod([len(values) for values in self.settings.values() if isinstance(values, np.ndarray)]))
        self.case = f"T = {self.t_end:g}" if self.t_end < LONGEST else "to the end"

    def __call__(self) -> None:
        with stopwatch(PLACES) as seconds:
            self.dataset = run(BASE, **self.settings)
        self.shares.append(seconds)

    def share(self, *names: str) -> Spread:
        return Spread(np.array([sum(seconds[name] for name in names) for seconds in self.shares]))

    def spin_error(self) -> float:
        """Largest error in spin, over some cells that have reached `T_END`; NaN if the run goes further."""
        if self.t_end != T_END or self.dataset is None:
            return np.nan
        cells = self.dataset.stack(cell=("mu", "b"))
        at_end = np.flatnonzero(cells["status"].values == TIME_LIMIT)
        sample = cells.isel(cell=at_end[np.linspace(0, len(at_end) - 1, COMPARED).astype(int)])
        columns = standard(**{name: sample[name].values for name in ("mu", "b")})
        step, _ = methods.automatic_step(methods.PLAIN, MODELS["slip"], columns, 1e-12)
        tight = simulate(columns, T_END, step=step / 2, ranges=False)["spin_final"]
        return float(np.abs(sample["spin_final"].values - tight).max())


def whole(effort: Effort) -> BenchSection:
    """Time of whole runs beside that of their kernels, and what takes the rest."""
    section = BenchSection("Whole runs", name="whole")
    runs = list(_runs(effort))
    some = REFERENCE | {"mu": REFERENCE["mu"][: effort.reference_frictions]}
    reference = WholeRun(some | {"method": AUTO, "t_end": LONGEST})
    for settings in (*({"method": method} for method in METHODS), reference.settings):
        run(BASE, **settings | {"t_end": 1.0})  # compiles the kernels
    times = list(in_turn(dict(enumerate(runs)), effort).values())
    total = in_turn({AUTO: reference}, Effort(repeats=1))[AUTO]
    section.tables += [_beside_kernel(runs, times, section), _by_share(reference, total.median, section)]
    section.panels.append(partial(_draw, runs=runs, times=times))
    return section


def _runs(effort: Effort) -> Iterator[WholeRun]:
    """Runs of squares of distinct bodies, to `T_END` and to the end."""
    for name, method in METHODS.items():
        # A method whose stability limits the step takes too long for more than a few to the end.
        few = effort.settled_sizes[: 1 if method.stable_step else None]
        for t_end, sizes in ((T_END, effort.whole_sizes), (LONGEST, few)):
            for cells in sizes:
                side = round(cells**0.5)
                mu, b = np.linspace(20, 200, side), np.linspace(1.2, 9.8, side)
                yield WholeRun({"mu": mu, "b": b, "method": name, "t_end": t_end})


def _beside_kernel(runs: list[WholeRun], times: list[Spread], section: BenchSection) -> Table:
    heads = ("seconds", "kernel, s", "start-up, s", "ratio", "trajectories a second", "largest error in spin")
    lines = [["cells", "end", "method", *heads]]
    for one, seconds in zip(runs, times, strict=True):
        kernel, start = one.share("kernel"), one.share("start-up")
        ratio = Spread(seconds.values / (kernel.values + start.values))
        rate, error = Spread(one.cells / seconds.values), one.spin_error()
        section.add(
            "slip", one.method, one.case, "cells", one.cells, seconds=seconds, kernel_seconds=kernel,
            start_up_seconds=start, ratio=ratio, trajectories_per_second=rate, spin_error=error,
        )  # fmt: skip
        shown = (f"{seconds:.3g}", f"{kernel.median:.3g}", f"{start.median:.3g}", f"{ratio:.2f}", f"{rate.median:.4g}")
        lines.append([str(one.cells), one.case, one.method, *shown, "—" if np.isnan(error) else f"{error:.1e}"])
    caption = (
        "sweep.run from parameters to dataset, warm, without an output folder: distinct bodies (b = 1.2 … 9.8, "
        f"μ = 20 … 200), a = 10, n0 = 0.05, tolerance {TOLERANCE:g}, default measurements. "
        f"To the end: until settled or t = {LONGEST:g}. ratio: the whole run over kernel and start-up together. "
        f"The error is that of up to {COMPARED} cells at t = {T_END:g}, beside {methods.PLAIN} at a tight step"
    )
    return caption, lines


def _by_share(reference: WholeRun, whole: float, section: BenchSection) -> Table:
    seconds = {name: reference.share(name).median for name in dict.fromkeys(PLACES.values())}
    seconds |= {"rest": whole - sum(seconds.values()), "whole": whole}
    quantities = {f"{name.replace('-', '_')}_seconds": spent for name, spent in seconds.items()}
    section.add("slip", AUTO, "reference sweep", "cells", reference.cells, **quantities)
    caption = (
        f"Where the time of a whole run goes: the first {reference.cells} cells of the reference sweep, method {AUTO}, "
        "to the end, one run. planning: limits, choice of method and step, and images without start-up; "
        "kernel: steps and looks, and lanes that wait for the last trajectories; "
        "carrying: stretches of small rattle; rest: above all reading the configuration"
    )
    lines = [
        ["", *seconds],
        ["seconds", *(f"{spent:.3g}" for spent in seconds.values())],
        ["share", *(f"{spent / whole:.1%}" for spent in seconds.values())],
    ]
    return caption, lines


def _draw(axes: Axes, runs: list[WholeRun], times: list[Spread]) -> None:
    for method in METHODS:
        chosen = [(run, spread) for run, spread in zip(runs, times, strict=True)
                  if (run.method, run.t_end) == (method, T_END)]  # fmt: skip
        sizes = [run.cells for run, _ in chosen]
        for name, line, face in (("whole run", "-", colour(method)), ("kernel", "--", "white")):
            spreads = [spread if name == "whole run" else run.share("kernel", "start-up") for run, spread in chosen]
            each = [Spread(1e3 / size * spread.values) for spread, size in zip(spreads, sizes, strict=True)]
            curve(axes, sizes, each, fmt=f"{marker(method)}{line}", color=colour(method), markerfacecolor=face,
                  label=f"{method}, {name}")  # fmt: skip
    axes.set(title=f"Whole runs to t = {T_END:g}", xlabel="number of trajectories", ylabel="ms per trajectory")
