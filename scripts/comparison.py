"""Runs tables of cells as a user would, and tells how near the estimated errors of their spins are to true ones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

import sweep
from sweep.config import Config
from sweep.models.model import Array

LEAST = 1e-13
"""Errors in spin below this are those of the reference."""


def table(cells: Iterable[Mapping[str, float | str]]) -> Config:
    """A configuration of the paper's model for these cells, each given by its parameters."""
    rows = list(cells)
    return sweep.load_config({"name": "cells", "cases": {n: [float(row[n]) for row in rows] for n in rows[0]}})


def words(error: Array, told: Array, allowed: Any, sharp: Array) -> str:
    """How many of the cells whose reference is `sharp` keep what is `allowed`, and how near the `told` errors are."""
    allowed = np.broadcast_to(allowed, error.shape)
    says = sharp & ~(told <= allowed)
    silent = sharp & ~says
    seen = sharp & (error > np.maximum(LEAST, 1e-3 * allowed)) & np.isfinite(told)
    ratio = told[seen] / error[seen]
    spread = "unknown, as all errors are too small"
    if seen.any():
        spread = " ".join(f"{value:.2g}" for value in np.percentile(ratio, [5, 50, 95]))
        spread += f", {np.mean(ratio < 0.1):.2%} ten times too small"
    kept = ", ".join(f"{np.mean(error[silent] <= k * allowed[silent]):.2%} within {k}" for k in (1, 3))
    return (
        f"{sharp.sum()} cells; of {silent.sum()} silent ones {kept}; "
        f"{says.sum()} say that they miss, {(error[says] > allowed[says]).sum()} rightly; "
        f"estimate / error: {spread}"
    )
