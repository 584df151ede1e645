"""A refined map over μ and b: what it costs, and how many cells are wrong.

Runs the map with `refine`, then blocks of it in full, drawn at random, and compares.  If interrupted, the same command
continues the map.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
import xarray as xr

from sweep.bench.studies.maps import write_map
from sweep.engine.run import run
from sweep.grid import Array

REST = """\
integrator: {{method: adams, tolerance: 1.0e-6, t_end: {t_end}}}
measure: [reversals]
refine: {depth}
"""


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m sweep.bench.studies.refined_map", description=__doc__)
    parser.add_argument("--size", type=int, default=1024, help="cells along each axis (default 1024)")
    parser.add_argument("--t-end", type=float, default=30_000.0, help="time limit in sqrt(c/g) (default 30000)")
    parser.add_argument("--depth", type=int, default=4, help="value of `refine` (default 4)")
    parser.add_argument("--blocks", type=int, default=36, help="blocks to run in full (default 36)")
    parser.add_argument("--side", type=int, default=64, help="cells along each axis of a block (default 64)")
    parser.add_argument("--seed", type=int, default=0, help="seed of the draw of blocks (default 0)")
    parser.add_argument(
        "--output", type=Path, default=Path("runs/refined_map"), help="folder (default runs/refined_map)"
    )
    options = parser.parse_args()

    options.output.mkdir(parents=True, exist_ok=True)
    name, size = f"refined_{options.size}_{options.depth}", (options.size, options.size)
    config = write_map(options.output, name, size, REST.format(t_end=options.t_end, depth=options.depth))
    began = time.perf_counter()
    refined = run(config, options.output)
    print(
        f"{options.size}²: {refined.attrs['simulated_share']:.2%} simulated, {refined.attrs['wall_time']:.0f} s "
        f"of simulation, {time.perf_counter() - began:.0f} s in all",
        flush=True,
    )

    rng = np.random.default_rng(options.seed)
    found = []
    print("μ           b           share   wrong count   status   either")
    for i, j in rng.integers(0, options.size - options.side + 1, (options.blocks, 2)):
        block = refined.isel(mu=slice(i, i + options.side), b=slice(j, j + options.side))
        found.append(compare(block, run(config, mu=block.mu.values, b=block.b.values, refine=0)))
        edges = [f"{v.values[0]:5.4g}…{v.values[-1]:<5.4g}" for v in (block.mu, block.b)]
        print(*edges, describe(found[-1]), flush=True)
    print(f"{'all blocks':23}", describe(np.mean(found, axis=0)))


def compare(block: xr.Dataset, full: xr.Dataset) -> Array:
    """Shares of the cells: simulated; with a wrong count, a wrong status, either."""
    count, status = ((block[name] != full[name]).values for name in ("reversals", "status"))
    simulated = (block.inferred == 0).values
    assert not (simulated & (count | status)).any(), "a simulated cell differs from the full run"
    return np.array([simulated.mean(), count.mean(), status.mean(), (count | status).mean()])


def describe(shares: Array) -> str:
    simulated, *wrong = shares
    return f"{simulated:6.1%}  " + "  ".join(f"{share:8.3%}" for share in wrong)


if __name__ == "__main__":
    main()
