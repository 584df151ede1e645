"""Measures the boundaries of a map: `configs/mu_b.yaml` at n0 = 0.05, on a grid of SIDE × SIDE cells.

    python scripts/boundaries.py SIDE SAMPLE [DEVIATION]

It tells how far the curves that the margins draw are from the brackets, whether the ends of the brackets keep their
counts with dopri5 at half its step, and how many of SAMPLE random cells the curves count wrong.
"""

from __future__ import annotations

import sys
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import comparison
import numpy as np
import xarray as xr

import sweep
from sweep.axis import Axis
from sweep.grid import Array
from sweep.kernels.status import SETTLED
from sweep.plots.boundaries import curves
from sweep.plots.levels import lines
from sweep.results.margins import FOUND
from sweep.studies import BOUNDARY_DEVIATION

CONFIG = Path(__file__).parent.parent / "configs" / "mu_b.yaml"
OTHERS = {"a": 10.0, "delta": 0.03, "n0": 0.05, "x0": 0.01, "y0": 0.01}


def main(side: int, sample: int, deviation: float = BOUNDARY_DEVIATION) -> None:
    """Print the figures."""
    axes: dict[str, Any] = {"mu": np.linspace(20, 200, side), "b": np.linspace(1.2, 9.8, side)}
    sweep.run(CONFIG, n0=0.05, mu=[60, 70], b=[3, 4])  # compiles
    began = time.perf_counter()
    grid = sweep.run(CONFIG, n0=0.05, **axes)
    of_map, began = time.perf_counter() - began, time.perf_counter()
    found = sweep.boundaries(CONFIG, n0=0.05, deviation=deviation, **axes)
    seconds = time.perf_counter() - began
    points, simulated = found.sizes["point"], int(found.attrs["trajectories"])
    outcomes, undecided = np.bincount(found.outcome, minlength=3).tolist(), int((grid.decided == 0).sum())
    print(
        f"{side} x {side}: {points} points (found, open, uncertain: {outcomes}), {simulated / points:.2f} runs a point"
    )
    print(f"{seconds:.1f} s; the map alone {of_map:.1f} s; undecided cells of the map: {undecided}")
    whole, found = found, found.isel(point=(found.outcome == FOUND).values)
    wide = np.abs(found.end_more - found.end_fewer) / np.minimum(found.end_more, found.end_fewer)
    print(f"largest bracket {float(wide.max()):.2e}")
    cell = np.array([float(np.diff(axes[name])[0]) for name in ("b", "mu")])
    on_lines = np.isin(found.b, axes["b"]) | np.isin(found.mu, axes["mu"])  # the others lie where curves are ragged
    off = distances(grid, found.isel(point=on_lines), axes, cell)
    far = np.quantile(off, [0.5, 0.95])
    print("margins' curves from the brackets, in cells: median {:.3f}, 95th percentile {:.3f}".format(*far))
    print(f"ends that keep their counts with dopri5 at half its step: {kept(found)} of {2 * found.sizes['point']}")
    counted(grid, whole, sample, cell)


def distances(grid: xr.Dataset, found: xr.Dataset, axes: dict[str, Any], cell: Array) -> Array:
    """How far each point is from the curve of its level that the margins of the grid draw, in cells."""
    drawn: dict[int, list[Array]] = {}
    for line in lines(grid, Axis("b", axes["b"]), Axis("mu", axes["mu"])):
        drawn[int(line.symbol)] = [np.stack(part, axis=1) / cell for part in line.parts]
    places = np.stack([found.b.values, found.mu.values], axis=1) / cell
    return np.array([
        min(to_segments(place, part) for part in drawn[level])
        for place, level in zip(places, found.level.values.tolist(), strict=True) if level in drawn
    ])  # fmt: skip


def to_segments(place: Array, line: Array) -> float:
    """The distance of a place from a line of points."""
    start, way = line[:-1], np.diff(line, axis=0)
    long = np.maximum((way**2).sum(axis=1), 1e-300)
    share = np.clip(((place - start) * way).sum(axis=1) / long, 0, 1)
    return float(np.hypot(*(place - start - share[:, None] * way).T).min())


def kept(found: xr.Dataset) -> int:
    """How many ends of brackets count the same with dopri5 at half the step of the search."""
    same = 0
    for end, count in (("end_fewer", "reversals_fewer"), ("end_more", "reversals_more")):
        cells = [
            OTHERS | {"mu": float(p.mu), "b": float(p.b)} | {str(p.bracket.values): float(p[end])}
            for p in (found.isel(point=i) for i in range(found.sizes["point"]))
        ]
        again = sweep.run(comparison.table(cells), method="dopri5", tolerance=1e-10 / 32, estimate_errors=False)
        same += int((again.reversals.values == found[count].values).sum())
    return same


def counted(grid: xr.Dataset, found: xr.Dataset, sample: int, cell: Array) -> None:
    """Count random cells by the curves: on the way from the nearest cell of the grid, each curve changes the count."""
    random = np.random.default_rng(23)
    places = np.stack([random.uniform(1.2, 9.8, sample), random.uniform(20, 200, sample)], axis=1)
    true = sweep.run(comparison.table([OTHERS | {"b": b, "mu": mu} for b, mu in places.tolist()]))
    nearest = grid.sel(b=xr.DataArray(places[:, 0]), mu=xr.DataArray(places[:, 1]), method="nearest")
    count, here = nearest.reversals.values.astype(int), np.stack([nearest.b.values, nearest.mu.values], axis=1)
    told = np.zeros(sample, int)
    levels = {level: [] for level in range(1, int(count.max()) + 1)}  # type: dict[int, list[Array]]
    for level, xs, ys in curves(found, "b", "mu"):
        levels[level].append(np.stack([xs, ys], axis=1))
    for level, parts in levels.items():
        crossed = sum((crossings(here / cell, places / cell, part / cell) for part in parts), np.zeros(sample, int))
        told += (count >= level) ^ (crossed % 2 == 1)
    sound = (true.status.values == SETTLED) & (nearest.status.values == SETTLED)
    wrong = sound & (told != true.reversals.values)
    by_cell = sound & (count != true.reversals.values)
    shares = [f"{each.sum()} ({each.sum() / sound.sum():.3%})" for each in (wrong, by_cell)]
    print(f"of {sound.sum()} random settled cells the curves count {shares[0]} wrong, the nearest cell {shares[1]}")


def crossings(start: Array, end: Array, line: Array) -> Array:
    """How often the straight way from each start to its end crosses a line."""

    def side(a: Array, b: Array, c: Array) -> Array:
        return (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) > (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0])

    total = np.zeros(len(start), int)
    for p, q in pairwise(line):
        near = np.flatnonzero((np.abs(start - p) < 2).all(axis=1))
        s, e = start[near], end[near]
        both = (side(s, e, p[None]) != side(s, e, q[None])) & (side(p[None], q[None], s) != side(p[None], q[None], e))
        total[near] += both
    return total


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), *map(float, sys.argv[3:]))
