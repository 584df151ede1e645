"""Compiles a kernel into the cache: python -m sweep.kernels.build METHOD MODEL [MEASURE …]

In a process of its own, for the code that Numba runs right after compiling is not the code it caches:
functions that a kernel calls are compiled alone and once more within it, and the last bits of sums differ
(seen in `work` of adams, 4e-16, in 9 % of 4048 cells).  A run that always takes its kernel from the
cache gives the same bits as the run after it.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterable

import numpy as np

from sweep.kernels.methods import make_kernel
from sweep.models import MODELS
from sweep.parameters import PARAMETERS


def build(method: str, model: str, measure: Iterable[str]) -> None:
    """Let another process compile; without a cache to write to, nothing comes of it."""
    subprocess.run([sys.executable, "-m", __name__, method, model, *measure], check=False, capture_output=True)


def main(method: str, model: str, *measure: str) -> None:
    kernel = make_kernel(method, MODELS[model], measure)
    body = {name: np.full(1, p.default if p.default is not None else 1.5) for name, p in PARAMETERS.items()}
    # What fills images is compiled by its first use; the kernel comes last, as it stands for them all.
    kernel.images(body, np.full(1, 0.1), 10.0, np.full((6, 1), np.nan), np.ones(1))
    kernel.compile()


if __name__ == "__main__":
    main(*sys.argv[1:])
