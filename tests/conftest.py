"""What several tests need: the paper's standard case and configurations on disk."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import settings

# Compiling takes longer than any deadline; the same examples on every machine.
settings.register_profile("sweep", deadline=None, derandomize=True, max_examples=200)
settings.load_profile("sweep")

ROOT = Path(__file__).parent.parent

STANDARD = {"a": 10.0, "b": 3.0, "c": 1.0, "delta": 0.03, "mu": 60.0, "n0": 0.05, "x0": 0.01, "y0": 0.01}


def columns(**parameters: Any) -> dict[str, np.ndarray]:
    """The standard case with some parameters replaced, as columns over cells."""
    arrays = np.broadcast_arrays(*(np.atleast_1d(np.asarray(v, float)) for v in (STANDARD | parameters).values()))
    return {name: array.copy() for name, array in zip(STANDARD | parameters, arrays, strict=True)}


SMALL = """\
name: small
body: {a: 10.0, b: [2.0, 3.0, 5.0], delta: 0.03}
friction: {mu: [40, 60]}
start: {n0: [0.02, 0.05], x0: 0.01, y0: 0.01}
integrator: {t_end: 1500}
"""


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Writes a configuration, by default a sweep of twelve cells, and returns its path."""

    def write_config(text: str = SMALL, name: str = "small.yaml") -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write_config
