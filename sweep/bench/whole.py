"""Whole runs, from parameters to dataset, beside the kernel inside them."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from sweep.bench.stopwatch import Place, stopwatch
from sweep.bench.timing import COLOURS, MARKERS, T_END, Effort, Measurement, Part, Spread, in_turn
from sweep.engine import plan
from sweep.engine.plan import Plan
from sweep.engine.run import run
from sweep.engine.whole import Whole
from sweep.kernels import methods
from sweep.kernels.adams import start_up
from sweep.kernels.adams.kernel import AdamsKernel
from sweep.kernels.kernel import Kernel
from sweep.kernels.method import TOLERANCE
from sweep.kernels.methods import AUTO, METHODS
from sweep.kernels.status import TIME_LIMIT
from sweep.models import MODELS
from sweep.report.direct import simulate, standard
from sweep.report.rows import Section

PLACES: dict[Place, str] = {
    (plan, "choose"): "planning",
    (plan, "fill"): "planning",
    (start_up, "start_up"): "start-up",
    (Kernel, "advance"): "kernel",
    (Kernel, "carry"): "carrying",
    (AdamsKernel, "carry"): "carrying",
    (Plan, "results"): "dataset",
    (Whole, "dataset"): "dataset",
}
"""What is timed inside a run.  The time of the kernel includes that of lanes which wait for the last trajectories."""

LONGEST = 30_000.0
"""Time limit of the runs to the end."""

COMPARED = 16
"""Cells of a run that are compared with a tight one."""

START = {"a": 10.0, "n0": 0.05}
BASE = f"body: {{a: {START['a']}, b: 3.0}}\nfriction: {{mu: 60.0}}\nstart: {{n0: {START['n0']}}}\n"
"""The configuration of all runs; what differs is given beside it."""

REFERENCE = {"mu": np.linspace(20, 200, 46), "b": np.linspace(1.2, 9.8, 44), "n0": np.array([0.02, 0.05, 0.1])}
"""Axes of `configs/mu_b.yaml`, in their order."""


@dataclass
class Timed:
    """Runs of one configuration, and where their time went."""

    file: Path
    overrides: dict[str, Any]
    shares: list[dict[str, float]] = field(default_factory=list)
    """Seconds by share, one entry for each run."""
    dataset: xr.Dataset | None = None
    """That of the last run."""

    def __call__(self) -> None:
        with stopwatch(PLACES) as seconds:
            self.dataset = run(self.file, **self.overrides)
        self.shares.append(seconds)

    def share(self, *names: str) -> Spread:
        return Spread(tuple(sum(seconds[name] for name in names) for seconds in self.shares))


@dataclass(frozen=True)
class Setting:
    """Which cells are run, how, and how far."""

    method: str
    cells: int
    t_end: float

    @property
    def case(self) -> str:
        return f"T = {self.t_end:g}" if self.t_end < LONGEST else "to the end"

    def overrides(self) -> dict[str, Any]:
        """A square of distinct bodies."""
        side = round(self.cells**0.5)
        b, mu = np.linspace(1.2, 9.8, side), np.linspace(20, 200, side)
        return {"b": b, "mu": mu, "method": self.method, "t_end": self.t_end, "verify": 0.0}


def whole(effort: Effort) -> Part:
    """Time of whole runs beside that of their kernels, and what takes the rest."""
    part = Part(Section("Whole runs"))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "bench.yaml"
        file.write_text(BASE, encoding="utf-8")
        runs = {setting: Timed(file, setting.overrides()) for setting in _settings(effort)}
        reference = Timed(file, _reference_sweep(effort.reference_frictions))
        for overrides in (*({"method": method} for method in METHODS), reference.overrides):
            run(file, **overrides | {"t_end": 1.0})  # compiles the kernels
        times = in_turn(runs, effort)
        total = in_turn({AUTO: reference}, Effort(repeats=1))[AUTO]
    part.section.tables = [_beside_kernel(runs, times, part.measurements), _by_share(reference, total, part)]
    part.panels = [lambda axes: _draw(axes, runs, times)]
    return part


def _settings(effort: Effort) -> Iterator[Setting]:
    for method, properties in METHODS.items():
        for cells in effort.whole_sizes:
            yield Setting(method, cells, T_END)
        # A method whose stability limits the step takes too long for more than a few.
        few = properties.stable_step is not None
        for cells in effort.settled_sizes[: 1 if few else None]:
            yield Setting(method, cells, LONGEST)


def _reference_sweep(frictions: int) -> dict[str, Any]:
    """The first cells of the reference sweep: those of its first `frictions` values of μ."""
    axes = REFERENCE | {"mu": REFERENCE["mu"][:frictions]}
    return {**axes, "method": AUTO, "t_end": LONGEST, "measure": ["reversals", "energy_error"], "verify": 0.0}


def _beside_kernel(
    runs: dict[Setting, Timed], times: dict[Setting, Spread], measurements: list[Measurement]
) -> tuple[str, list[list[str]]]:
    heads = ("seconds", "kernel, s", "start-up, s", "ratio", "trajectories a second", "largest error in spin")
    lines = [["cells", "end", "method", *heads]]
    for setting, timed in runs.items():
        seconds, kernel = times[setting], timed.share("kernel", "start-up")
        ratio = Spread(tuple(w / k for w, k in zip(seconds.values, kernel.values, strict=True)))
        rate = seconds.inverse(setting.cells)
        error = _spin_error(timed, setting)
        quantities = {
            "seconds": seconds,
            "kernel_seconds": timed.share("kernel"),
            "start_up_seconds": timed.share("start-up"),
            "ratio": ratio,
            "trajectories_per_second": rate,
        }
        if np.isfinite(error):
            quantities["spin_error"] = Spread((error,))
        where = ("whole", "slip", setting.method, setting.case, "cells", float(setting.cells))
        measurements += [Measurement(*where, name, spread) for name, spread in quantities.items()]
        shown = [
            f"{seconds:.3g}",
            f"{timed.share('kernel').median:.3g}",
            f"{timed.share('start-up').median:.3g}",
            f"{ratio:.2f}",
            f"{rate.median:.4g}",
            f"{error:.1e}" if np.isfinite(error) else "—",
        ]
        lines.append([str(setting.cells), setting.case, setting.method, *shown])
    caption = (
        "sweep.run from parameters to dataset, warm, without an output folder: distinct bodies (b = 1.2 … 9.8, "
        f"μ = 20 … 200), a = 10, n0 = 0.05, tolerance {TOLERANCE:g}, default measurements. "
        f"To the end: until settled or t = {LONGEST:g}. ratio: the whole run over kernel and start-up together. "
        f"The error is that of up to {COMPARED} cells at t = {T_END:g}, beside {methods.PLAIN} at a tight step"
    )
    return caption, lines


def _spin_error(timed: Timed, setting: Setting) -> float:
    """Largest error in spin, over some cells that have reached `T_END`; NaN if the run goes further."""
    if setting.t_end != T_END or timed.dataset is None:
        return np.nan
    cells = timed.dataset.stack(cell=("mu", "b"))
    at_end = np.flatnonzero(cells["status"].values == TIME_LIMIT)
    sample = cells.isel(cell=at_end[np.linspace(0, len(at_end) - 1, COMPARED).astype(int)])
    columns = standard(**{name: sample[name].values for name in ("mu", "b")}, **START)
    step, _ = methods.automatic_step(methods.PLAIN, MODELS["slip"], columns, 1e-12)
    tight = simulate(columns, T_END, step=step / 2, ranges=False)["spin_final"]
    return float(np.abs(sample["spin_final"].values - tight).max())


def _by_share(timed: Timed, total: Spread, part: Part) -> tuple[str, list[list[str]]]:
    whole = total.median
    seconds = {name: timed.share(name).median for name in dict.fromkeys(PLACES.values())}
    seconds |= {"rest": whole - sum(seconds.values()), "whole": whole}
    cells = int(np.prod([len(timed.overrides[name]) for name in REFERENCE]))
    for name, spent in seconds.items():
        where = ("whole", "slip", AUTO, "reference sweep", "cells", float(cells))
        part.measurements.append(Measurement(*where, f"{name.replace('-', '_')}_seconds", Spread((spent,))))
    caption = (
        f"Where the time of a whole run goes: the first {cells} cells of the reference sweep, method {AUTO}, to the "
        "end, one run. planning: limits, choice of method and step, and images without start-up; "
        "kernel: steps and looks, and lanes that wait for the last trajectories; "
        "carrying: stretches of small rattle; rest: above all reading the configuration"
    )
    lines = [
        ["", *seconds],
        ["seconds", *(f"{spent:.3g}" for spent in seconds.values())],
        ["share", *(f"{spent / whole:.1%}" for spent in seconds.values())],
    ]
    return caption, lines


def _draw(axes: Axes, runs: dict[Setting, Timed], times: dict[Setting, Spread]) -> None:
    for method in METHODS:
        chosen = [setting for setting in runs if setting.method == method and setting.t_end == T_END]
        sizes = [setting.cells for setting in chosen]
        for name, line, face in (("whole run", "-", COLOURS[method]), ("kernel", "--", "white")):
            spreads = [times[s] if name == "whole run" else runs[s].share("kernel", "start-up") for s in chosen]
            each = [1e3 * spread.median / size for spread, size in zip(spreads, sizes, strict=True)]
            axes.loglog(sizes, each, f"{MARKERS[method]}{line}", color=COLOURS[method], markerfacecolor=face,
                        label=f"{method}, {name}")  # fmt: skip
    axes.set(title=f"Whole runs to t = {T_END:g}", xlabel="number of trajectories", ylabel="ms per trajectory")
    axes.legend(fontsize=7)
