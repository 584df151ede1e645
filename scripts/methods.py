"""The stiff method beside dopri5 at equal spin error: time of whole runs, measured in turn.

    python scripts/methods.py [--trajectories 512] [--t-end 400] [--bound 1e-6] [--repeats 5]

Each method takes the longest of its steps whose largest spin error stays under the bound; dopri5 cannot
use a step beyond its stability limit, so its error is often far below.  Times hold start-up and steps,
without measurements and compilation, on two threads; medians with the smallest and largest.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable

import numpy as np

from sweep.kernels.lanes import Kernel
from sweep.kernels.methods import STABILITY_SHARE, make_kernel
from sweep.kernels.tableau import DOPRI5
from sweep.models import MODELS, slip
from sweep.models.coefficients import rattle_period

SLIP = MODELS["slip"]
ADAMS_STEPS = (0.15, 0.125, 0.11, 0.1, 0.09, 0.08, 0.0667, 0.05, 0.04)


def columns(mu: float, cells: int) -> dict[str, np.ndarray]:
    values = {"a": 10.0, "b": 3.0, "c": 1.0, "delta": 0.03, "mu": mu, "x0": 0.01, "y0": 0.01}
    start = {"n0": 0.05 * (1 + 1e-3 * np.arange(cells) / cells)}
    return {name: np.full(cells, value) for name, value in values.items()} | start


def run(kernel: Kernel, body: dict[str, np.ndarray], step: float, t_end: float) -> np.ndarray:
    """Spins at `t_end`; NaN where the run failed."""
    cells = len(body["mu"])
    images = kernel.images(body, np.full(cells, step), t_end, np.full((6, cells), np.nan), rattle_period(body))
    kernel.advance(images, np.arange(cells), 10**9, False)
    n = len(kernel.model.states)
    spin = kernel.model.energy(images[:, :n].T, images[:, n : kernel.row("step")].T)[0]
    return np.where(images[:, kernel.row("done")] == images[:, kernel.row("goal")], spin, np.nan)


def longest_step(
    kernel: Kernel, mu: float, steps: tuple[float, ...], t_end: float, bound: float
) -> tuple[float, float]:
    """The longest of `steps` under the bound, and its error on sixteen trajectories."""
    body = columns(mu, 16)
    exact = run(make_kernel("dopri5", SLIP, ()), body, min(0.005, 0.3 / mu), t_end)
    for step in steps:
        error = float(np.abs(run(kernel, body, step, t_end) - exact).max())
        if error <= bound:
            return step, error
    raise SystemExit(f"no step of {steps} keeps {bound:g} at μ = {mu:g}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trajectories", type=int, default=512)
    parser.add_argument("--t-end", type=float, default=400.0)
    parser.add_argument("--bound", type=float, default=1e-6)
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    kernels = {name: make_kernel(name, SLIP, ()) for name in ("dopri5", "adams")}
    print(f"{options.trajectories} trajectories to t = {options.t_end:g}, spin error <= {options.bound:g}")
    print("μ        method   step      error    ms a trajectory            speed over dopri5")
    for mu in (60.0, 100.0, 200.0, 1000.0, 1e4, 1e5):
        body = columns(mu, options.trajectories)
        limit = float(STABILITY_SHARE * DOPRI5.real_stability / slip.fastest_decay(body)[0])
        # Beyond 1000 dopri5 is left out: it takes as long as μ is large.
        methods = {"adams": ADAMS_STEPS} | ({"dopri5": (limit,)} if mu <= 1000 else {})
        works: dict[str, Callable[[], np.ndarray]] = {}
        chosen = {}
        for name, steps in methods.items():
            chosen[name] = longest_step(kernels[name], mu, steps, options.t_end, options.bound)
            works[name] = lambda k=kernels[name], h=chosen[name][0], b=body: run(k, b, h, options.t_end)
        times: dict[str, list[float]] = {name: [] for name in works}
        for _ in range(options.repeats):
            for name, work in works.items():
                began = time.perf_counter()
                work()
                times[name].append((time.perf_counter() - began) / options.trajectories * 1e3)
        for name in works:
            median = statistics.median(times[name])
            ratio = f"{statistics.median(times['dopri5']) / median:.1f}" if "dopri5" in times else ""
            spread = f"{median:.4f} ({min(times[name]):.4f} … {max(times[name]):.4f})"
            print(f"{mu:<8g} {name:8} {chosen[name][0]:<9.4g} {chosen[name][1]:.1e}  {spread:26} {ratio}")


if __name__ == "__main__":
    main()
