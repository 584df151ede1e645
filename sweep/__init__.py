"""Parameter sweeps for the reversals of a rattleback.

`load_config`, `run` and `predict` do from Python what `python -m sweep` does from the shell.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sweep.config import Config, load_config
    from sweep.run import predict, run

__all__ = ["Config", "load_config", "predict", "run"]

_HOMES = {"Config": "sweep.config", "load_config": "sweep.config", "predict": "sweep.run", "run": "sweep.run"}


def __getattr__(name: str) -> Any:
    # Loaded on use: `python -m sweep --help` then needs none of numba, xarray and matplotlib.
    if name not in _HOMES:
        raise AttributeError(f"module 'sweep' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
