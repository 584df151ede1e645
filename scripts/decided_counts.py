"""Compares the counts of decided cells with those of an independent integrator.

    python scripts/decided_counts.py NEAR WIDE [SEED]

NEAR cells lie beside the boundaries of `configs/mu_b.yaml` at n0 = 0.05, by 1e-4 to 1e-2 of their place; WIDE cells are
drawn from a domain much wider than the paper's.  Counts are those of `scripts/reference_counts_500.py`: Taylor series
of heyoka.py at a tolerance of 1e-13, and reversals as `scripts/reversals.py` defines them.
"""

from __future__ import annotations

import sys
from pathlib import Path

import comparison
import numpy as np
import reference_counts_500 as reference

import sweep
from sweep.grid import Array
from sweep.kernels.status import SETTLED
from sweep.results.margins import FOUND

CONFIG = Path(__file__).parent.parent / "configs" / "mu_b.yaml"
TOLERANCE, MOST_FRICTION = 1e-13, 100.0


def near(random: np.random.Generator, cells: int) -> dict[str, Array]:
    """Cells beside boundaries."""
    mu, b = np.linspace(20, 200, 24), np.linspace(1.2, 9.8, 24)
    found = sweep.boundaries(CONFIG, n0=0.05, bracket=1e-4, progress=False, mu=mu, b=b)
    found = found.isel(point=(found.outcome == FOUND).values)
    at = random.integers(found.sizes["point"], size=cells)
    off = random.choice([-1, 1], cells) * 10 ** random.uniform(-4, -2, cells)
    along = found.bracket.values[at]
    columns = {name: found[name].values[at] * (1 + off * (along == name)) for name in ("mu", "b")}
    rest = {"a": 10.0, "c": 1.0, "delta": 0.03, "n0": 0.05, "x0": 0.01, "y0": 0.01}
    return columns | {name: np.full(cells, value) for name, value in rest.items()}


def wide(random: np.random.Generator, cells: int) -> dict[str, Array]:
    """Cells of any shape; the friction is not so large that Taylor series take minutes for one."""
    a, c = 1.5 * (50 / 1.5) ** random.random(cells), random.uniform(0.5, 2, cells)
    a = np.maximum(a, 1.2 * c)
    b = c * (a / c) ** random.uniform(0.05, 0.95, cells)
    columns = {"a": a, "b": b, "c": c, "delta": random.uniform(-0.5, 0.5, cells)}
    columns |= {"mu": 0.1 * (MOST_FRICTION / 0.1) ** random.random(cells)}
    columns |= {"n0": random.choice([-1, 1], cells) * 0.005 * 40 ** random.random(cells)}
    return columns | {name: b * random.uniform(-0.15, 0.15, cells) for name in ("x0", "y0")}


def compare(label: str, columns: dict[str, Array]) -> None:
    """Print how many decided cells the reference contradicts."""
    rows = [dict(zip(columns, row, strict=True)) for row in np.stack([*columns.values()], axis=1).tolist()]
    ours = sweep.run(comparison.table(rows), verify=0.0, progress=False)
    decided = ours.decided.values == 1
    ends = {"settled": int((ours.status == SETTLED).sum()), "decided": int(decided.sum())}
    theirs = {name: values[decided] for name, values in columns.items()}
    runs = reference.follow(theirs, reference.double_precision(TOLERANCE), reference.LANES, float)
    final = np.array([run.status == "settled" for run in runs])
    wrong = final & (np.array([run.reversals() for run in runs]) != ours.reversals.values[decided])
    print(f"{label}: {len(rows)} cells, {ends}; of {final.sum()} that settle for the reference, {wrong.sum()} differ")
    for i in np.flatnonzero(wrong):
        at = np.flatnonzero(decided)[i]
        margins = [float(ours[name][at]) for name in ("margin_more", "margin_fewer")]
        print(
            f"  {rows[at]}: {int(ours.reversals[at])}, reference {runs[i].reversals()}, margins {margins}", flush=True
        )


if __name__ == "__main__":
    beside, far = map(int, sys.argv[1:3])
    generator = np.random.default_rng(int(sys.argv[3]) if sys.argv[3:] else 20261123)
    if far:
        compare("wide", wide(generator, far))
    if beside:
        compare("near", near(generator, beside))
