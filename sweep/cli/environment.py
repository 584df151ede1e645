"""Checks environment variables that would make Numba fail with a warning or a traceback."""

from __future__ import annotations

import os
import re
from importlib import import_module

from sweep.cli.faults import refuse
from sweep.faults import either, refusal

_LAYERS = ("default", "safe", "forksafe", "threadsafe", "tbb", "omp", "workqueue")

_ALLOWED = {
    "NUMBA_NUM_THREADS": (r"\+?0*[1-9]\d{0,3}", "a whole number from 1 to 9999"),
    "NUMBA_DISABLE_JIT": ("[01]", "0 or 1"),
    "NUMBA_THREADING_LAYER": ("|".join(_LAYERS), either(_LAYERS)),
}
"""The pattern of permitted values of each variable, and a description of it for messages."""

_POOLS = {"tbb": "numba.np.ufunc.tbbpool", "omp": "numba.np.ufunc.omppool"}
"""The modules of Numba that need an optional library, by threading layer."""


def check() -> None:
    """Raise an `InputError` for the first variable whose value Numba does not accept."""
    for name, (pattern, wanted) in _ALLOWED.items():
        if (given := os.environ.get(name, "").strip()) and not re.fullmatch(pattern, given):
            refuse(name, refusal(given, wanted))
    layer = os.environ.get("NUMBA_THREADING_LAYER", "").strip()
    if pool := _POOLS.get(layer):
        try:
            import_module(pool)
        except ImportError as error:
            refuse("NUMBA_THREADING_LAYER", f"{layer} cannot be loaded: {error}; install it, or unset the variable")
