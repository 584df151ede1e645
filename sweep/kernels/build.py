"""Compiles into the cache what kernels need, each piece in a process of its own, side by side.

    python -m sweep.kernels.build kernel METHOD MODEL [MEASURE …]
    python -m sweep.kernels.build images METHOD MODEL
    python -m sweep.kernels.build approach MODEL
    python -m sweep.kernels.build theory MODEL

Processes, because the code that Numba executes right after compiling is not the code that it caches: functions that a
kernel calls are compiled once by themselves and once more as part of the kernel, and the last bits of sums differ (seen
in `work` of adams: 4e-16, in 9 % of 4048 cells).  A run that always takes its kernel from the cache gives the same bits
as the run after it.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import ExitStack

import numpy as np

from sweep.jit import compiling, threads
from sweep.kernels.failure import compile_approach, compiled_approach
from sweep.kernels.kernel import Kernel
from sweep.kernels.methods import make_kernel
from sweep.kernels.quartic import compiled_modes, has_fast_slip
from sweep.kernels.stability import compile_theory, compiled_search
from sweep.models import find
from sweep.parameters import PAPER

Piece = tuple[str, ...]
"""Something to be compiled: the arguments of this module."""

_POLL = 0.05
"""Time in seconds between two looks at the processes."""


def build(kernels: Iterable[Kernel]) -> None:
    """Compile what the cache lacks to run `kernels`, in as many processes at a time as this one has threads.

    What is missing after that, because a process failed or there is no folder for a cache, is compiled where it is
    first used.
    """
    if pieces := list(dict.fromkeys(piece for kernel in kernels for piece in _missing(kernel))):
        with compiling():
            _compile(pieces)


def _missing(kernel: Kernel) -> Iterator[Piece]:
    """What the cache lacks to run `kernel`, the longest first."""
    model = kernel.model.name
    advance, filling = kernel.compiled_functions()
    if advance.is_missing():
        yield "kernel", kernel.method, model, *(each.spec for each in kernel.measurements if each.in_kernel)
    if any(function.is_missing() for function in filling):
        yield "images", kernel.method, model
    if compiled_approach(kernel.model).is_missing():
        yield "approach", model
    if has_fast_slip(kernel.model) and any(
        function(kernel.model).is_missing() for function in (compiled_search, compiled_modes)
    ):
        yield "theory", model


def _compile(pieces: list[Piece]) -> None:
    waiting, running = pieces[::-1], list[subprocess.Popen[bytes]]()
    with ExitStack() as stack:
        while waiting or running:
            while waiting and len(running) < threads():
                process = stack.enter_context(_start(waiting.pop()))
                stack.callback(process.kill)  # if this is interrupted, and before it is waited for
                running.append(process)
            time.sleep(_POLL)
            running = [process for process in running if process.poll() is None]


def _start(piece: Piece) -> subprocess.Popen[bytes]:
    # Nothing is ever written to stdin: it closes when this process ends, however it ends.
    command = [sys.executable, "-m", __name__, *piece]
    nothing = subprocess.DEVNULL
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=nothing, stderr=nothing)


def _end_with_parent() -> None:
    os.read(sys.stdin.fileno(), 1)
    os._exit(1)


def main(what: str, *which: str) -> None:
    """Compile one piece into the cache."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if what == "kernel":
        method, model, *measure = which
        make_kernel(method, find(model), measure).compile()
    elif what == "images":
        kernel = make_kernel(which[0], find(which[1]), ())
        body = {name: np.full(1, p.default if p.default is not None else 1.5) for name, p in PAPER.items()}
        body |= {name: np.full(1, 1.5) for name in kernel.model.parameters if name not in body}
        kernel.images(body, np.full(1, 0.1), 10.0)
    elif what == "approach":
        compile_approach(find(which[0]))
    else:
        compile_theory(find(which[0]))


if __name__ == "__main__":
    main(*sys.argv[1:])
