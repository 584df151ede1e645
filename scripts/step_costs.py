"""What a step costs in each scene, compared with the paper's: python scripts/step_costs.py [METHOD [MODEL …]]

The scenes are models of `sweep.models.variants`, run on the paper's standard body with all that is named set to a small
value, in lanes that are always full, on one thread.  Rounds alternate between the models, so that the ratios hold on a
machine that is shared; times are processor times.
"""

from __future__ import annotations

import os

os.environ["NUMBA_NUM_THREADS"] = "1"

import sys
import time
from collections.abc import Callable

import numpy as np

from sweep.kernels.layout import BLOCK, LANES
from sweep.kernels.measures import default
from sweep.kernels.methods import make_kernel
from sweep.models import find
from sweep.models.ladder import slip
from sweep.models.model import ENERGY

SCENES = (
    "slip", "slip+viscous+gravity", "slip+viscous+offset", "slip+viscous+skew", "slip+viscous+offset+skew+gravity",
    "slip+viscous+sigma", "slip+viscous+rolling", "slip+viscous+spinning", "slip+viscous+paraboloid",
    "slip+coulomb-sqrt", "slip+coulomb-tanh", "slip+coulomb-cubic", "slip+stribeck", "slip+contensou", "slip+none",
    "noslip", "noslip+solid+offset+skew+gravity", "noslip+solid+sigma", "noslip+solid+rolling",
)  # fmt: skip
BODY = {
    "a": 10.0, "b": 3.0, "c": 1.0, "delta": 0.03, "mu": 60.0, "n0": 0.05, "x0": 0.01, "y0": 0.01, "mass": 1.0,
    "gravity": 1.0, "sigma": 1e-5, "mu_rolling": 1e-5, "radius": 1.0, "speed_rolling": 1.0, "mu_spinning": 1e-5,
    "radius_spinning": 1.0, "speed_spinning": 1.0,
}  # fmt: skip
FRICTION = {"mu": 0.6, "speed": 0.01, "mu_static": 0.7, "speed_stick": 0.02, "mu_viscous": 0.1, "radius_contact": 0.1}
BOWL = {"a": 1 / 200, "b": 1 / 18, "Ixx": 2.0, "Iyy": 20.2, "Izz": 21.8, "Ixy": 0.5}
STEP, BLOCKS, ROUNDS = 0.005, 300, 15  # a step that is stable with every law


def run_of(method: str, name: str) -> Callable[[], float]:
    """A function that returns the nanoseconds of a step and lane."""
    model = find(name)
    law = {} if model.variant.law in (None, slip.VISCOUS) else FRICTION
    body = BODY | law | (BOWL if name.endswith("paraboloid") else {})
    columns = {each: np.full(LANES, value) for each, value in body.items()}
    measure = [each for each in default(find("slip")) if each not in ("noise_limited", "resting_spin")]
    kernel = make_kernel(method, model, measure if ENERGY in model.offers else ["reversals"])
    images = kernel.images(columns, np.full(LANES, STEP), 1e6)
    if "quiet_energy" in kernel.layout:
        kernel.table(images)["quiet_energy"] = -1.0
    cells = np.arange(LANES)
    kernel.advance(images.copy(), cells, 1)

    def once() -> float:
        part, begin = images.copy(), time.process_time()
        kernel.advance(part, cells, BLOCKS)
        spent = time.process_time() - begin
        return 1e9 * spent / float((kernel.table(part)["done"] - kernel.table(images)["done"]).sum())

    return once


def main(method: str = "dopri5", *names: str) -> None:
    """Print a line for each scene: the median of its times, and that of their ratios to the first, with quartiles."""
    runs = {name: run_of(method, name) for name in names or SCENES}
    times = np.array([[once() for once in runs.values()] for _ in range(ROUNDS)])
    ratios = times / times[:, :1]
    print(f"{method}, {BLOCK * BLOCKS} steps of {LANES} lanes, {ROUNDS} rounds")
    for name, own, ratio in zip(runs, times.T, ratios.T, strict=True):
        low, middle, high = np.percentile(ratio, [25, 50, 75])
        print(f"{name:32} {np.median(own):6.2f} ns  {middle:.3f} ({low:.3f} … {high:.3f})")


if __name__ == "__main__":
    main(*sys.argv[1:])
