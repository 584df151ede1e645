"""Time of a step, and of whole runs against the number of trajectories, t_end, friction and the number of threads."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numba
import numpy as np
from matplotlib.axes import Axes

from sweep.bench.section import BenchSection, Spread, colour, curve, marker
from sweep.bench.timing import T_END, Effort, Work, in_turn, runs_at, spread_out
from sweep.kernels.kernel import Kernel
from sweep.kernels.layout import LANES
from sweep.kernels.method import TOLERANCE
from sweep.kernels.methods import METHODS, allowed, automatic_step
from sweep.models import MODELS
from sweep.report.direct import make_kernel, standard

MU = 60.0

STEP = 0.02
"""Step whose time is measured, in sqrt(c/g): short enough for every method at `MU`."""

AXES = {"trajectories": "number of trajectories", "t_end": "t_end", "mu": "μ"}
"""What is varied and drawn, with its label; threads appear in the table only."""

Key = tuple[str, float, str]
"""What is varied, to which value, and the method."""


def kernels() -> Iterator[tuple[str, str, Kernel]]:
    """Compile each method of each model, alone and with measurements: all that the sections run."""
    for name, model in MODELS.items():
        for method in allowed(model):
            for measure in ((), None):
                yield name, method, make_kernel(method, model, measure)


def step_times(effort: Effort) -> BenchSection:
    """Time of a step of one trajectory, by each method of each model, alone and with measurements."""
    threads, section = numba.get_num_threads(), BenchSection("Time of a step", name="steps")
    works, cells = {}, LANES * threads
    for name, method, kernel in kernels():
        what = " and ".join(kernel.measure) or "nothing"
        works[name, method, what] = Work(kernel, standard(mu=np.full(cells, MU)), np.full(cells, STEP))
    # These works are short, so they are repeated more often: some turns escape the machine's other work.
    times = in_turn(works, replace(effort, repeats=5 * effort.repeats))
    lines = [["model", "method", "measuring", "ns per step and trajectory"]]
    for key, spread in times.items():
        each = Spread(1e9 * STEP / T_END / cells * spread.values)
        lines.append([*key, f"{each:.2f}"])
        section.add(*key, "threads", threads, ns_per_step=each)
    caption = f"Runs to t = {T_END:g} in steps of {STEP:g}, start-up included: {cells} trajectories, {threads} threads"
    section.tables.append((f"{caption}, μ = {MU:g}", lines))
    return section


def cost(effort: Effort) -> BenchSection:
    """Time of whole runs of the slip model, with one quantity varied."""
    threads, section = numba.get_num_threads(), BenchSection("Cost", name="cost")
    works = dict(_works(effort, threads))
    threaded = {key: partial(_on, key[1] if key[0] == "threads" else threads, work) for key, work in works.items()}
    try:
        times = in_turn(threaded, effort)
    finally:
        numba.set_num_threads(threads)
    each = {key: Spread(1e3 / len(works[key]) * spread.values) for key, spread in times.items()}
    for (setting, at, method), spread in each.items():
        case = f"{len(works[setting, at, method])} trajectories"
        section.add("slip", method, case, setting, at, ms_per_trajectory=spread)
    lines = [["varied", "value", *(f"{method}, ms per trajectory" for method in METHODS), "trajectories"]]
    for setting, at in dict.fromkeys((setting, at) for setting, at, _ in works):
        keys = [(setting, at, method) for method in METHODS]
        shown = [f"{each[key]:.3g}" if key in each else "—" for key in keys]
        sizes = dict.fromkeys(str(len(works[key])) for key in keys if key in works)
        lines.append([setting, f"{at:g}", *shown, " and ".join(sizes)])
    caption = (
        f"The slip model at the automatic step for tolerance {TOLERANCE:g}, start-up included. Unless varied: "
        f"{effort.trajectories} trajectories, {threads} threads, t_end = {T_END:g}, μ = {MU:g}"
    )
    section.tables.append((caption, lines))
    section.panels += [partial(_draw, each=each, setting=setting) for setting in AXES]
    return section


def _works(effort: Effort, threads: int) -> Iterator[tuple[Key, Work]]:
    count = effort.trajectories
    for method in METHODS:
        for size in effort.sizes:
            yield ("trajectories", size, method), _work(method, size)
        for number in sorted({1, threads}):
            yield ("threads", number, method), _work(method, count)
        for t_end in effort.ends:
            yield ("t_end", t_end, method), _work(method, count, t_end=t_end)
        for mu in effort.frictions:
            if runs_at(method, mu):
                yield ("mu", mu, method), _work(method, count, mu=mu).affordable(effort)


def _work(method: str, count: int, t_end: float = T_END, mu: float = MU) -> Work:
    body = standard(mu=mu)
    step, _ = automatic_step(method, MODELS["slip"], body)
    return Work(make_kernel(method, MODELS["slip"], ()), spread_out(body, count), np.resize(step, count), t_end)


def _on(threads: float, work: Work) -> None:
    numba.set_num_threads(int(threads))
    work()


def _draw(axes: Axes, each: dict[Key, Spread], setting: str) -> None:
    for method in METHODS:
        points = {at: spread for (varied, at, by), spread in each.items() if (varied, by) == (setting, method)}
        curve(axes, list(points), list(points.values()), fmt=f"{marker(method)}-", color=colour(method), label=method)
    axes.set(xlabel=AXES[setting], ylabel="ms per trajectory", title=f"Cost against {AXES[setting]}")
