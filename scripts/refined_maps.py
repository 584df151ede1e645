"""Compares refined maps with the whole map: SIDE × SIDE cells over μ and b, by default those of `configs/mu_b.yaml`.

    python scripts/refined_maps.py SIDE REFINE[,REFINE ...] [FOLDER [KEY=VALUE ...]]

The whole map is kept in FOLDER, and not simulated again if it is there.  512 × 512 cells take a quarter of an hour on
two cores.  KEY=VALUE are other values of parameters, such as `n0=0.08`.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

import sweep

CONFIG = Path(__file__).parent.parent / "configs" / "mu_b.yaml"


def main(side: int, depths: list[int], folder: str | None, parameters: dict[str, float]) -> None:
    """Print share, wrong cells and seconds."""
    settings: dict[str, Any] = {"n0": 0.05, "estimate_errors": False, "measure": ["reversals", "margin"]}
    settings |= parameters
    sweep.run(CONFIG, **settings, mu=[60, 70], b=[3, 4])  # compiles
    mu = {"start": 20.0, "stop": 200.0, "num": side}
    b = {"start": 1.2, "stop": min(9.8, settings.get("a", 10.0) - 0.2), "num": side}
    began = time.perf_counter()
    whole = sweep.run(CONFIG, folder, progress=False, **settings, mu=mu, b=b)
    print(f"{side} x {side} cells, all of them: {time.perf_counter() - began:.1f} s")
    for depth in depths:
        began = time.perf_counter()
        refined = sweep.run(CONFIG, **settings, mu=mu, b=b, refine=depth)
        seconds = time.perf_counter() - began
        wrong = [int((refined[name] != whole[name]).sum()) for name in ("reversals", "status")]
        share, shares = refined.attrs["simulated_share"], np.array(wrong) / side**2
        print(f"refine {depth}: {share:.2%} simulated, {seconds:.1f} s", end="; ")
        print(f"wrong counts {wrong[0]} ({shares[0]:.4%}), statuses {wrong[1]} ({shares[1]:.4%})", flush=True)


if __name__ == "__main__":
    given = dict(text.split("=") for text in sys.argv[4:])
    main(
        int(sys.argv[1]),
        [int(depth) for depth in sys.argv[2].split(",")],
        sys.argv[3] if len(sys.argv) > 3 else None,
        {name: float(value) for name, value in given.items()},
    )
