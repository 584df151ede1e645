"""Compiles into the cache what kernels need, each piece in a process of its own, side by side.

    python -m sweep.kernels.build kernel METHOD MODEL [MEASURE …]
    python -m sweep.kernels.build images METHOD MODEL
    python -m sweep.kernels.build approach MODEL
    python -m sweep.kernels.build theory MODEL

A MODEL that a user brings is "name@digest", and the record of its origin comes as a line of standard input.

Processes, because the code that Numba executes right after compiling is not the code that it caches: functions that a
kernel calls are compiled once by themselves and once more as part of the kernel, and the last bits of sums differ (seen
in `work` of adams: 4e-16, in 9 % of 4048 cells).  A run that always takes its kernel from the cache gives the same bits
as the run after it.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, suppress

import numpy as np

from sweep.interrupt import point
from sweep.jit import compiled, compiling, load_numba, threads
from sweep.kernels.failure import compile_approach, compiled_approach
from sweep.kernels.kernel import Kernel
from sweep.kernels.methods import make_kernel
from sweep.kernels.quartic import compiled_modes, has_fast_slip
from sweep.kernels.stability import compile_theory, compiled_search
from sweep.models import find
from sweep.models.model import Model
from sweep.models.origin import Origin
from sweep.models.user import loading
from sweep.models.user.blame import blamed
from sweep.parameters import PAPER_PARAMETERS

Piece = tuple[str, ...]
"""Something to be compiled: the arguments of this module."""

Job = tuple[Piece, Origin | None]
"""A piece, and where its model comes from."""

_POLL = 0.05
"""Time in seconds between two looks at the processes."""


def build(kernels: Iterable[Kernel]) -> None:
    """Compile what the cache lacks to run `kernels`, in as many processes at a time as this one has threads.

    What is missing after that, because a process failed or there is no folder for a cache, is compiled where it is
    first used.

    Raises
    ------
    ModelError
        if a model that a user brings cannot be compiled.
    """
    kernels = list(kernels)
    if brought := [kernel.model for kernel in kernels if kernel.model.origin and not kernel.is_compiled()]:
        with compiling():
            try_compiling(brought[0])
    jobs = dict.fromkeys((piece, kernel.model.origin) for kernel in kernels for piece in _missing(kernel))
    if jobs:
        with compiling():
            _compile(list(jobs))


def try_compiling(model: Model) -> None:
    """Compile the inline functions of a model one by one, so that a fault is known by its line; `ModelError` if any."""
    numba, states = load_numba(), (0.0,) * len(model.states)
    constants = model.constants(*(0.0 for _ in model.constants._fields))
    with blamed(model.origin):
        for function, arguments in ((model.rhs, (states, constants)), (model.energy, (states, constants)),
                                    (model.tilt, (states,))):  # fmt: skip
            compiled(function).compile(tuple(map(numba.typeof, arguments)))


def _missing(kernel: Kernel) -> Iterator[Piece]:
    """What the cache lacks to run `kernel`, the longest first."""
    model = kernel.model.key
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


def _compile(jobs: list[Job]) -> None:
    waiting, running = jobs[::-1], list[subprocess.Popen[bytes]]()
    with ExitStack() as stack:
        while waiting or running:
            while waiting and len(running) < threads():
                process = stack.enter_context(_start(*waiting.pop()))
                stack.callback(process.kill)  # if this is interrupted, and before it is waited for
                running.append(process)
            time.sleep(_POLL)
            point()
            running = [process for process in running if process.poll() is None]


def _start(piece: Piece, origin: Origin | None) -> subprocess.Popen[bytes]:
    # Nothing else is ever written to stdin: it closes when this process ends, however it ends.
    command = [sys.executable, "-m", __name__, *piece]
    nothing = subprocess.DEVNULL
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=nothing, stderr=nothing)
    if origin and process.stdin:
        with suppress(BrokenPipeError):  # it has failed: what it was to compile stays missing
            process.stdin.write(json.dumps(vars(origin)).encode() + b"\n")
            process.stdin.flush()
    return process


def _end_with_parent() -> None:
    os.read(sys.stdin.fileno(), 1)
    os._exit(1)


def main(what: str, *which: str) -> None:
    """Compile one piece into the cache."""
    name = which[what in ("kernel", "images")]
    model = _brought(name) if "@" in name else find(name)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if what == "kernel":
        method, _, *measure = which
        make_kernel(method, model, measure).compile()
    elif what == "images":
        kernel = make_kernel(which[0], model, ())
        body = {name: np.full(1, p.default if p.default is not None else 1.5) for name, p in PAPER_PARAMETERS.items()}
        body |= {name: np.full(1, 1.5) for name in kernel.model.parameters if name not in body}
        kernel.images(body, np.full(1, 0.1), 10.0)
    elif what == "approach":
        compile_approach(model)
    else:
        compile_theory(model)


def _brought(name: str) -> Model:
    return loading.compiled_as(Origin(**json.loads(sys.stdin.buffer.readline())), name.partition("@")[0])


if __name__ == "__main__":
    main(*sys.argv[1:])
