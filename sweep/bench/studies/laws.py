"""Speed and error of the equations of real bodies, law by law, beside those of the paper's models.

One body, the paper's standard one, runs to t = 400 with every law, as many trajectories with start spins up to a
thousandth apart, by dopri5 at its automatic step, on one thread.  Runs take turns; times are medians, and of the
processor, which other work on the machine disturbs least.  The coefficients of Coulomb's laws are such that a tiny
rattle meets the friction of the viscous law.  The error in spin is the largest over some of the trajectories, against
steps of a sixteenth; those of an eighth tell how far that may be off.  The time of compilation is that of a process
that compiles the kernel alone, into an empty cache, its imports included.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from statistics import median

import numba
import numpy as np

from sweep.bench.timing import T_END, Spread, Work, spread_out
from sweep.grid import Array
from sweep.kernels import methods
from sweep.models import find
from sweep.models.model import Columns
from sweep.report.cells import make_kernel, standard

MU, SPEED = 60.0, 5e-3
COULOMB = {"mu": MU * SPEED, "speed": SPEED}
STRIBECK = {"mu": 0.3, "mu_static": 0.4, "speed": 0.02, "speed_stick": SPEED, "mu_viscous": 1.0}
SIGMA = {"sigma": 1e-3}
CONTENSOU = COULOMB | {"radius_contact": 0.05}
ROLLING = {"mu_rolling": 1e-3, "radius": 0.1, "speed_rolling": 0.5}
SPINNING = {"mu_spinning": 1e-3, "radius_spinning": 0.1, "speed_spinning": 0.02}

SCENES: dict[str, dict[str, float]] = {
    "slip": {"mu": MU},
    "slip+viscous": {"mu": MU},
    "slip+coulomb-sqrt": COULOMB,
    "slip+coulomb-tanh": COULOMB,
    "slip+coulomb-cubic": COULOMB,
    "slip+stribeck": STRIBECK,
    "slip+contensou": CONTENSOU,
    "slip+none": {},
    "slip+viscous+sigma": {"mu": MU} | SIGMA,
    "slip+viscous+rolling": {"mu": MU} | ROLLING,
    "slip+viscous+spinning": {"mu": MU} | SPINNING,
    "slip+viscous+sigma+rolling": {"mu": MU} | SIGMA | ROLLING,
    "noslip": {},
    "noslip+solid": {},
    "noslip+solid+sigma": SIGMA,
    "noslip+solid+rolling": ROLLING,
}
"""Models, and their parameters beside those of the standard body."""

COMPARED = 16
"""Trajectories whose error is measured."""


@dataclass(frozen=True)
class Scene:
    """Trajectories of one model, and how they are run."""

    name: str
    columns: Columns
    step: float
    work: Work

    @property
    def steps(self) -> float:
        return T_END / self.step

    def spins(self, share: float) -> Array:
        """Spins at the end, at this share of the step, shape (COMPARED,)."""
        kernel, few = (
            self.work.kernel,
            {name: values[:: len(values) // COMPARED] for name, values in self.columns.items()},
        )
        images = Work(kernel, few, np.full(len(few["a"]), self.step * share))()
        return np.asarray(kernel.model.energy(*kernel.unpack(images))[0])

    def error(self) -> tuple[float, float]:
        """The largest error in spin, and how far the reference may itself be off."""
        tight, tighter = self.spins(1 / 8), self.spins(1 / 16)
        return float(np.abs(self.spins(1) - tighter).max()), float(np.abs(tight - tighter).max())


def scene(name: str, count: int) -> Scene:
    columns = spread_out(standard(), count)
    columns = {n: v for n, v in columns.items() if n != "mu"} | {n: np.full(count, v) for n, v in SCENES[name].items()}
    model = find(name)
    step = float(methods.automatic_step(methods.PLAIN, model, columns)[0].min())
    return Scene(name, columns, step, Work(make_kernel(methods.PLAIN, model, ()), columns, np.full(count, step)))


def compilation(name: str) -> float:
    """Processor seconds of a process that compiles the kernel of a run without measurements."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "sweep.kernels.build", "kernel", methods.PLAIN, name]
        environment = os.environ | {"NUMBA_CACHE_DIR": folder}
        with subprocess.Popen(command, stdin=subprocess.PIPE, env=environment) as process:  # it ends when stdin closes
            _, status, used = os.wait4(process.pid, 0)
            process.returncode = status
        if status:
            sys.exit(f"failed: {' '.join(command)}")
        return used.ru_utime + used.ru_stime


def processor_seconds(scenes: Mapping[str, Scene], rounds: int) -> dict[str, Spread]:
    """Processor time of each work, in turn."""
    times: dict[str, list[float]] = {name: [] for name in scenes}
    for _ in range(rounds):
        for name, each in scenes.items():
            began = time.process_time()
            each.work()
            times[name].append(time.process_time() - began)
    return {name: Spread(tuple(values)) for name, values in times.items()}


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m sweep.bench.studies.laws", description=__doc__)
    parser.add_argument("--count", type=int, default=256, help="trajectories (default 256)")
    parser.add_argument("--rounds", type=int, default=5, help="runs of each model (default 5)")
    options = parser.parse_args()
    compiling = {name: compilation(name) for name in SCENES}
    scenes = {name: scene(name, options.count) for name in SCENES}
    numba.set_num_threads(1)
    times = processor_seconds(scenes, options.rounds)
    lane = {name: times[name].times(1e9 / options.count / each.steps) for name, each in scenes.items()}
    print("model | ns a step | of slip's | steps | trajectories a second | error in spin | reference | compilation, s")
    for name, each in scenes.items():
        ratios = Spread(tuple(t / s for t, s in zip(lane[name].values, lane["slip"].values, strict=True)))
        error, uncertain = each.error()
        rate = options.count / median(times[name].values)
        row = (
            f"{lane[name]:.1f}",
            f"{ratios:.2f}",
            f"{each.steps:.0f}",
            f"{rate:.0f}",
            f"{error:.1e}",
            f"{uncertain:.0e}",
        )
        print(" | ".join((name, *row, f"{compiling[name]:.0f}")), flush=True)
    print(f"{options.count} trajectories, one thread, load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
