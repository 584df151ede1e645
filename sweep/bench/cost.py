"""Time of whole runs against the number of trajectories, t_end, friction and the number of threads."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np
from matplotlib.axes import Axes

from sweep.bench.timing import (
    COLOURS,
    MARKERS,
    T_END,
    Effort,
    Measurement,
    Part,
    Spread,
    Work,
    in_turn,
    runs_at,
    spread_out,
)
from sweep.kernels import methods
from sweep.kernels.method import TOLERANCE
from sweep.models import MODELS
from sweep.report.direct import make_kernel, standard
from sweep.report.rows import Section

MU = 60.0

AXES = {"trajectories": "number of trajectories", "t_end": "t_end", "mu": "μ"}
"""What is varied and drawn, with its label; threads appear in the table only."""


@dataclass(frozen=True)
class Run:
    setting: str
    at: float
    method: str
    work: Work
    threads: int

    def __call__(self) -> None:
        numba.set_num_threads(self.threads)
        self.work()


def cost(effort: Effort) -> Part:
    threads = numba.get_num_threads()
    runs = list(_runs(effort, threads))
    try:
        times = in_turn(dict(enumerate(runs)), effort)
    finally:
        numba.set_num_threads(threads)
    spreads = [times[i].times(1e3 / len(run.work)) for i, run in enumerate(runs)]
    part = Part(Section("Cost"))
    lines = [["varied", "value", *(f"{method}, ms per trajectory" for method in methods.METHODS), "trajectories"]]
    for setting, at in dict.fromkeys((run.setting, run.at) for run in runs):
        here = {r.method: (r, s) for r, s in zip(runs, spreads, strict=True) if (r.setting, r.at) == (setting, at)}
        shown = [f"{here[m][1]:.3g}" if m in here else "—" for m in methods.METHODS]
        sizes = " and ".join(dict.fromkeys(str(len(run.work)) for run, _ in here.values()))
        lines.append([setting, f"{at:g}", *shown, sizes])
    part.measurements = [
        Measurement(
            "cost", "slip", run.method, f"{len(run.work)} trajectories", run.setting, run.at, "ms_per_trajectory", s
        )
        for run, s in zip(runs, spreads, strict=True)
    ]
    caption = (
        f"The slip model at the automatic step for tolerance {TOLERANCE:g}, start-up included. Unless varied: "
        f"{effort.trajectories} trajectories, {threads} threads, t_end = {T_END:g}, μ = {MU:g}"
    )
    part.section.tables.append((caption, lines))
    part.panels = [_draw(runs, spreads, setting) for setting in AXES]
    return part


def _runs(effort: Effort, threads: int) -> Iterator[Run]:
    for method in methods.METHODS:
        for size in effort.sizes:
            yield Run("trajectories", size, method, _work(method, count=size), threads)
        for number in sorted({1, threads}):
            yield Run("threads", number, method, _work(method, count=effort.trajectories), number)
        for t_end in effort.ends:
            yield Run("t_end", t_end, method, _work(method, count=effort.trajectories, t_end=t_end), threads)
        for mu in effort.frictions:
            if runs_at(method, mu):
                yield Run("mu", mu, method, _work(method, count=effort.trajectories, mu=mu).affordable(effort), threads)


def _work(method: str, count: int, t_end: float = T_END, mu: float = MU) -> Work:
    body = standard(mu=mu)
    step, _ = methods.automatic_step(method, MODELS["slip"], body)
    return Work(make_kernel(method, MODELS["slip"], ()), spread_out(body, count), np.resize(step, count), t_end)


def _draw(runs: list[Run], spreads: list[Spread], setting: str) -> Callable[[Axes], Any]:
    def draw(axes: Axes) -> None:
        for method in methods.METHODS:
            chosen = [
                (r.at, s) for r, s in zip(runs, spreads, strict=True) if (r.setting, r.method) == (setting, method)
            ]
            at, several = zip(*chosen, strict=True)
            reach = np.transpose([s.reach for s in several])
            axes.errorbar(at, [s.median for s in several], reach, fmt=f"{MARKERS[method]}-", capsize=2,
                          color=COLOURS[method], label=method)  # fmt: skip
        axes.set(xscale="log", yscale="log", xlabel=AXES[setting], ylabel="ms per trajectory",
                 title=f"Cost against {AXES[setting]}")  # fmt: skip
        axes.legend(fontsize=7)

    return draw
