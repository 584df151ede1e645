"""What tests of several rooms share: the paper's standard case, a small sweep, kernels, commands, processes."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from sweep.kernels.status import LIFT_OFF, PARADOX, TOPPLED

ROOT = Path(__file__).parent.parent.parent

Write = Callable[..., Path]
"""The fixtures `write` and `kept`: write a configuration, by default a sweep of twelve cells, and return its path."""

STANDARD = {"a": 10.0, "b": 3.0, "c": 1.0, "delta": 0.03, "mu": 60.0, "n0": 0.05, "x0": 0.01, "y0": 0.01}
"""The standard case of Takano (2011)."""

CHAOTIC = {"a": 39.7614, "b": 11.6247, "c": 1.19954, "delta": 0.020937, "mu": 240.612}
CHAOTIC |= {"n0": -0.0490836, "x0": 8.26e-4, "y0": 2.26e-4}

ENDS = {
    TOPPLED: {"a": 8.36, "b": 1.73, "c": 1.54, "delta": 0.179, "mu": 178.0, "n0": 1.0, "x0": 0.573, "y0": 0.0569},
    LIFT_OFF: {"a": 15.7, "b": 1.05, "c": 0.732, "delta": 0.171, "mu": 33.0, "n0": 1.0, "x0": -3.49, "y0": 0.576},
    PARADOX: {"a": 13.5, "b": 2.92, "c": 1.13, "delta": -0.326, "mu": 173.0, "n0": -1.0, "x0": 0.643, "y0": 0.209},
}
"""Bodies and starts by how they end."""

ENDED = {
    TOPPLED: (1.98151077087, 0.850367779047),
    LIFT_OFF: (0.309325995245, 0.594084511578),
    PARADOX: (2.60774091287, -0.981004030229),
}
"""When and with which spin: `newton.end`, seconds of work, which `kernels/test_failure.py` runs."""

SMALL = """\
name: small
body: {a: 10.0, b: [2.0, 3.0, 5.0], delta: 0.03}
friction: {mu: [40, 60]}
start: {n0: [0.02, 0.05], x0: 0.01, y0: 0.01}
integrator: {method: dopri5, t_end: 1500}
"""
"""A sweep of twelve cells, slow enough to be interrupted."""


def cells(**parameters: Any) -> dict[str, np.ndarray]:
    """Columns over cells."""
    arrays = np.broadcast_arrays(*(np.atleast_1d(np.asarray(value, float)) for value in parameters.values()))
    return {name: array.copy() for name, array in zip(parameters, arrays, strict=True)}


def columns(**parameters: Any) -> dict[str, np.ndarray]:
    """The standard case with some parameters replaced, as columns over cells."""
    return cells(**STANDARD | parameters)


def wide_bodies(number: int) -> dict[str, np.ndarray]:
    """Random bodies far beyond the paper's, as columns over cells; always the same ones."""
    random = np.random.default_rng(1)

    def between(low: Any, high: Any) -> Any:
        return np.exp(random.uniform(np.log(low), np.log(high), number))

    c = between(0.5, 2)
    a = between(np.maximum(c, 1.5), 50)
    return columns(a=a, b=between(c, a), c=c, delta=random.uniform(-0.5, 0.5, number), mu=between(0.1, 5000))
