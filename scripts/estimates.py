"""How often the slow equations estimate the count of the full model, and how fast.

    python scripts/estimates.py mu_b               the cells of `configs/mu_b.yaml`
    python scripts/estimates.py wide CELLS SEED    random cells: a/c 1.5 to 50, μ 0.1 to 5000, n0 0.005 to 0.2
    python scripts/estimates.py slowed CELLS SEED  the same with σ from 1e-5 to 0.3

Shares of certain counts that are estimated rightly and within one, by the start spin; of the estimates that are
certain; and the same for the formula of Takano (2011), which has no σ.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import sweep

ROOT = Path(__file__).parents[1]
MEASURE = ["reversals", "margin", "estimate"]


def wide(cells: int, seed: int, slowed: bool) -> dict[str, Any]:
    """Random cells: bodies, friction and starts far beyond the paper's."""
    random = np.random.default_rng(seed)

    def log_uniform(low: Any, high: Any) -> Any:
        return low * (high / low) ** random.random(draws)

    draws = 4 * cells
    c = random.uniform(0.5, 2, draws)
    a = log_uniform(1.5 * c, 50 * np.ones(draws))
    b = log_uniform(1.01 * c, a)
    drawn = {
        "a": a, "b": b, "c": c, "delta": random.uniform(-0.5, 0.5, draws),
        "mu": log_uniform(0.1, 5000), "n0": random.choice([-1, 1], draws) * log_uniform(0.005, 0.2),
        "x0": random.uniform(-a / 10, a / 10), "y0": random.uniform(-b / 10, b / 10),
    }  # fmt: skip
    # The start point lies well within the ellipsoid, along either sense of its turn against the axes of inertia.
    turned = np.array([1, -1])[:, None] * drawn["delta"]
    along = drawn["x0"] * np.cos(turned) + drawn["y0"] * np.sin(turned)
    across = drawn["y0"] * np.cos(turned) - drawn["x0"] * np.sin(turned)
    within = np.flatnonzero(((along / a) ** 2 + (across / b) ** 2 < 0.2).all(axis=0))[:cells]
    table = {name: values[within].tolist() for name, values in drawn.items()}
    if slowed:
        table["sigma"] = (10 ** random.uniform(-5, -0.5, len(within))).tolist()
    return {"cases": table, "measure": MEASURE}


def say(words: str, found: xr.Dataset, where: Any) -> None:
    """Print the shares over the cells `where`."""
    where &= found["certain"].values == 1
    counts, sure = found["reversals"].values.astype(int)[where], found["estimate_certain"].values[where] == 1
    shares = {}
    for name in {"reversals_estimated", "reversals_predicted"} & set(found):
        off = np.abs(found[name].values[where] - counts)
        shares[name] = f"right {np.mean(off == 0):.1%}, within one {np.mean(off <= 1):.1%}"
    right = found["reversals_estimated"].values[where][sure] == counts[sure]
    formula = shares.get("reversals_predicted", "not for these")
    print(
        f"{words}: {where.sum()} cells, {shares['reversals_estimated']} (formula: {formula}); "
        f"sure {np.mean(sure):.1%}, right {np.mean(right):.2%}"
    )


def main(which: str, cells: int = 500, seed: int = 1) -> None:
    config: Any = ROOT / "configs" / "mu_b.yaml" if which == "mu_b" else wide(cells, seed, which == "slowed")
    sweep.predict(config, measure=MEASURE)  # compiles
    began = time.perf_counter()
    size = sweep.predict(config, measure=MEASURE)["reversals_estimated"].size
    print(f"{size / (time.perf_counter() - began):.0f} cells a second")
    found = sweep.run(config, measure=MEASURE)
    n0 = np.abs(xr.broadcast(found["n0"], found["reversals"])[0].transpose(*found["reversals"].dims).values)
    say("all", found, n0 > 0)
    wider = (0, 0.02), (0.02, 0.06), (0.06, 1)
    for low, high in ((0.02, 0.02), (0.05, 0.05), (0.1, 0.1)) if which == "mu_b" else wider:
        say(f"n0 = {low:g}" if low == high else f"n0 {low:g} to {high:g}", found, (low <= n0) & (n0 <= high))


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:]))
