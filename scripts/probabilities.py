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

SCENE: dict[str, Any] = {
    "body": {"a": 10, "b": 3, "delta": 0.1}, "friction": {"mu": 20}, "measure": ["reversals"], "verify": 0,
    "integrator": {"method": "dopri5", "tolerance": 1e-6, "t_end": 40, "estimate_errors": False},
}  # fmt: skip
MILLION = 1_000_000


def by_chance(millions: int) -> tuple[np.ndarray, int]:
    """How many of the starts reverse so often or more, from once on, and how many there are."""
    random, beyond = np.random.default_rng(1), np.zeros(8, np.int64)
    for number in range(millions):
        began = time.perf_counter()
        starts = {
            "n0": random.normal(0.3, 0.05, MILLION), "x0": random.uniform(0.2, 1.5, MILLION),
            "y0": random.uniform(-0.3, 0.3, MILLION),
        }  # fmt: skip
        counts = sweep.run({**SCENE, "cases": starts}, progress=False)["reversals"].values
        beyond += np.array([(counts >= k).sum() for k in range(1, 9)])
        print(f"million {number + 1}: {time.perf_counter() - began:.0f} s", flush=True)
    return beyond, millions * MILLION


def main(millions: int = 10) -> None:
    """Print both, a line for each number of reversals."""
    began = time.perf_counter()
    start = {"n0": {"normal": [0.3, 0.05]}, "x0": {"uniform": [0.2, 1.5]}, "y0": {"uniform": [-0.3, 0.3]}}
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
