"""What the studies share: the map they run, and its time."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from sweep.engine.run import run
from sweep.grid import Array

MU, B = (20.0, 200.0), (1.2, 9.8)
"""Ends of the axes."""


def write_map(folder: Path, name: str, size: tuple[int, int], rest: str = "") -> Path:
    """Write a configuration of `size` cells over μ and b, with the lines `rest`, and return its path."""
    (mu_start, mu_stop), (b_start, b_stop) = MU, B
    path = folder / f"{name}.yaml"
    path.write_text(
        f"name: {name}\n"
        f"friction: {{mu: {{start: {mu_start}, stop: {mu_stop}, num: {size[0]}}}}}\n"
        f"body: {{b: {{start: {b_start}, stop: {b_stop}, num: {size[1]}}}}}\n"
        f"{rest}",
        encoding="utf-8",
    )
    return path


def draw_cells(size: int, count: int) -> Array:
    """μ and b of `count` cells drawn at random from a map of `size` × `size`, shape (count, 2)."""
    drawn = np.random.default_rng(0).choice(size * size, count, replace=False)
    return np.column_stack([np.linspace(*MU, size)[drawn // size], np.linspace(*B, size)[drawn % size]])


def timed_run(config: Any, **arguments: Any) -> tuple[float, xr.Dataset]:
    """Seconds of a whole run, and its dataset."""
    began = time.perf_counter()
    result = run(config, **arguments)
    return time.perf_counter() - began, result
