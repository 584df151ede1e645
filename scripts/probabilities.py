"""Compares probabilities of 10^5 samples with those of 10^7 starts that NumPy draws by chance.

    python scripts/probabilities.py [MILLIONS]

Both are of one scene, whose start spin and contact point are uncertain.  Ten million starts take half an hour on two
cores.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import numpy as np

import sweep
from sweep.engine import executor
from sweep.engine.plan import kernel_of
from sweep.kernels.methods import PLAIN
from sweep.kernels.status import FAILURES
from sweep.results.dataset import measured

SCENE: dict[str, Any] = {
    "body": {"a": 10, "b": 3, "delta": 0.1}, "friction": {"mu": 5}, "measure": ["reversals"],
    "integrator": {"method": "dopri5", "tolerance": 1e-6, "t_end": 40, "estimate_errors": False},
}  # fmt: skip
MILLION, BATCH, STEP = 1_000_000, 100_000, 0.01


def by_chance(millions: int) -> tuple[np.ndarray, int]:
    """How many of the starts reverse so often or more, from once on, and how many did not fail; by the kernel alone."""
    config = sweep.load_config({**SCENE, "start": {"n0": 0.3, "x0": 0.2, "y0": 0.1}})
    kernel, one = kernel_of(PLAIN, config), config.grid.columns()
    random, beyond, valid, began = np.random.default_rng(1), np.zeros(8, np.int64), 0, time.perf_counter()
    for number in range(millions * MILLION // BATCH):
        columns = {name: np.full(BATCH, value[0]) for name, value in one.items()} | {
            "n0": random.normal(0.3, 0.1, BATCH), "x0": random.uniform(0.2, 1.5, BATCH),
            "y0": random.uniform(-0.3, 0.3, BATCH),
        }  # fmt: skip
        t_end = np.full(BATCH, config.integrator.t_end)
        images = kernel.images(columns, np.full(BATCH, STEP), t_end)
        executor.execute(kernel, images, stop_when_settled=False)
        found = measured(kernel, images, t_end)
        counts = np.where(np.isin(found["status"], FAILURES), -1, found["reversals"])
        valid += int((counts >= 0).sum())
        beyond += np.array([(counts >= k).sum() for k in range(1, 9)])
        if number % 10 == 9:
            print(f"{(number + 1) * BATCH / MILLION:g} million: {time.perf_counter() - began:.0f} s", flush=True)
    return beyond, valid


def main(millions: int = 10) -> None:
    """Print both, a line for each number of reversals."""
    began = time.perf_counter()
    start = {"n0": {"normal": [0.3, 0.1]}, "x0": {"uniform": [0.2, 1.5]}, "y0": {"uniform": [-0.3, 0.3]}}
    found = sweep.run({**SCENE, "start": start, "samples": 100_000}, progress=False)
    print(f"10^5 samples: {time.perf_counter() - began:.0f} s")
    beyond, starts = by_chance(millions)
    for k, probability, low, high in zip(
        found["count"].values, found["probability"].values, found["probability_low"].values,
        found["probability_high"].values, strict=True,
    ):  # fmt: skip
        chance = beyond[k - 1] / starts
        error = np.sqrt(chance * (1 - chance) / starts)
        print(f"P(n >= {k}): {probability:.5f} ({low:.5f} to {high:.5f}); by chance {chance:.5f} ± {error:.5f}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
