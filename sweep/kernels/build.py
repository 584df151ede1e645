"""Compiles a kernel into the cache: python -m sweep.kernels.build METHOD MODEL [MEASURE …]

It runs in a process of its own, because the code that Numba executes right after compiling is not the code that it
caches: functions that a kernel calls are compiled once by themselves and once more as part of the kernel, and the last
bits of sums differ (seen in `work` of adams: 4e-16, in 9 % of 4048 cells).  A run that always takes its kernel from the
cache gives the same bits as the run after it.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterable

import numpy as np

from sweep.kernels.failure import compile_approach
from sweep.kernels.methods import make_kernel
from sweep.models import MODELS
from sweep.parameters import PARAMETERS


def build(method: str, model: str, measure: Iterable[str]) -> None:
    """Compile a kernel in another process; this has no effect if there is no cache that can be written to."""
    subprocess.run([sys.executable, "-m", __name__, method, model, *measure], check=False, capture_output=True)


def main(method: str, model: str, *measure: str) -> None:
    kernel = make_kernel(method, MODELS[model], measure)
    body = {name: np.full(1, p.default if p.default is not None else 1.5) for name, p in PARAMETERS.items()}
    # The functions that fill images are compiled when they are first used.  The kernel comes last, because finding
    # it in the cache is taken to mean that they are there too.
    kernel.images(body, np.full(1, 0.1), 10.0)
    compile_approach(MODELS[model])
    kernel.compile()


if __name__ == "__main__":
    main(*sys.argv[1:])
