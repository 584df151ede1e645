"""What tests of several rooms share: the paper's standard case, a small sweep, kernels, commands, processes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parent.parent.parent

STANDARD = {"a": 10.0, "b": 3.0, "c": 1.0, "delta": 0.03, "mu": 60.0, "n0": 0.05, "x0": 0.01, "y0": 0.01}
"""The standard case of Takano (2011)."""

SMALL = """\
name: small
body: {a: 10.0, b: [2.0, 3.0, 5.0], delta: 0.03}
friction: {mu: [40, 60]}
start: {n0: [0.02, 0.05], x0: 0.01, y0: 0.01}
integrator: {t_end: 1500}
"""
"""A sweep of twelve cells."""


def columns(**parameters: Any) -> dict[str, np.ndarray]:
    """The standard case with some parameters replaced, as columns over cells."""
    arrays = np.broadcast_arrays(*(np.atleast_1d(np.asarray(v, float)) for v in (STANDARD | parameters).values()))
    return {name: array.copy() for name, array in zip(STANDARD | parameters, arrays, strict=True)}
