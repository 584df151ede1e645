"""Compile the pieces of kernels into the cache, side by side, each in its own process.

The arguments of such a process are PIECE METHOD MODEL [MEASURE …]. A PIECE is `kernel`, or another part that runs need:
`beginning`, `exchange` and `follow` for the slow equations, `path` for single trajectories, and `failing` once a
trajectory has failed. For a user's model, MODEL is "name@digest", and the record of its origin comes as a line of
standard input.

Separate processes are needed because the code that Numba executes right after compiling is not the code that it caches:
functions that a kernel calls are compiled once by themselves and once more as part of the kernel, and the last bits of
sums differ (seen in `work` of adams: 4e-16, in 9 % of 4048 cells).  A run that always takes its kernel from the cache
gives the same bits as the run after it.
"""

from __future__ import annotations

import gc
import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path

from sweep.faults import CompileError
from sweep.interrupt import point
from sweep.jit import Cached, compile_for_disk, compiled, compiling, load_numba, threads
from sweep.kernels.failure import compiled_approach
from sweep.kernels.kernel import Kernel
from sweep.kernels.methods import METHODS, PLAIN, make_kernel
from sweep.kernels.path import compiled_path
from sweep.models import find
from sweep.models.model import Model, Offer
from sweep.models.origin import Origin
from sweep.models.slow.estimate import compiled_exchange
from sweep.models.slow.follow import compiled_follow
from sweep.models.stiff.slip import form_of
from sweep.models.user import loading
from sweep.models.user.blame import blamed

Job = tuple[tuple[str, ...], Origin | None]
"""The arguments of this module, and the origin of the model."""

KERNEL, BEGINNING, PATH, FAILING = "kernel", "beginning", "path", "failing"
EXCHANGE, FOLLOW = "exchange", "follow"

_PIECES: dict[str, Callable[[Kernel], tuple[Cached, ...]]] = {
    KERNEL: lambda kernel: (kernel.advancing,),
    BEGINNING: lambda kernel: kernel.stepper.prepared_by(kernel.model),
    PATH: lambda kernel: (compiled_path(kernel.model),) if kernel.model.path else (),
    FAILING: lambda kernel: (compiled_approach(kernel.full),),
    EXCHANGE: lambda kernel: (
        (compiled_exchange(form_of(kernel.model).full),) if Offer.ENDING in kernel.model.offers else ()
    ),
    FOLLOW: lambda kernel: (compiled_follow(),) if Offer.ENDING in kernel.model.offers else (),
}
"""The compiled functions of each piece."""

_SECONDS = {BEGINNING: 4.0, PATH: 4.0, FAILING: 4.0, EXCHANGE: 4.0, FOLLOW: 5.0}
"""Time to compile a piece other than a kernel (`scripts/LOG.md`: `run_costs`)."""

_DOES_NOT_COMPILE = 3
"""Exit code of a process that prints the places and the reason of a `CompileError`."""

_POLL = 0.05
"""Time in seconds between two checks of the processes."""


def build(kernels: Iterable[Kernel], *also: str) -> None:
    """Compile the pieces that the cache lacks to run `kernels`, in as many processes at a time as this one has threads.

    `also` names further pieces: `PATH` to find how bodies turn and travel, `FAILING` to look at failures.

    Anything still missing afterwards, because a process failed or there is no folder for a cache, is compiled where it
    is first used.

    Raises
    ------
    InputError
        if a user's model cannot be compiled.
    CompileError
        if other code cannot.
    """
    kernels = list(kernels)
    if users := [kernel.model for kernel in kernels if kernel.model.origin and not kernel.advancing.is_compiled()]:
        with compiling():
            try_compiling(users[0])
    if jobs := missing(kernels, *also):
        with compiling():
            _compile(jobs)


def build_estimates(model: Model) -> None:
    """Compile what estimates the counts of `model`, as `build` compiles its kernels, if the cache lacks it."""
    if jobs := [(piece, model.origin) for piece in _lacking(make_kernel(PLAIN, model, ()), (EXCHANGE, FOLLOW))]:
        with compiling():
            _compile(jobs)


def missing(kernels: Sequence[Kernel], *also: str) -> list[Job]:
    """List the pieces that the cache lacks to run `kernels`; `also` as in `build`."""
    pieces = (KERNEL, EXCHANGE, FOLLOW, BEGINNING, *also)  # the longest first
    lacking = ((piece, kernel.model.origin) for kernel in kernels for piece in _lacking(kernel, pieces))
    return list(dict.fromkeys(lacking))


def compile_seconds(jobs: Sequence[Job]) -> float:
    """Estimate the time to compile `jobs` side by side."""
    each = [METHODS[piece[1]].compile_seconds if piece[0] == KERNEL else _SECONDS[piece[0]] for piece, _ in jobs]
    return max(max(each, default=0.0), sum(each) / threads())


def try_compiling(model: Model) -> None:
    """Compile the inline functions of a model one by one, so that an `InputError` gives the line of a fault."""
    numba, states = load_numba(), (0.0,) * len(model.states)
    constants = model.constants(*(0.0 for _ in model.constants._fields))
    with blamed(model.origin):
        for function, arguments in ((model.rhs, (states, constants)), (model.energy, (states, constants)),
                                    (model.tilt, (states,))):  # fmt: skip
            compiled(function).compile(tuple(map(numba.typeof, arguments)))


def _lacking(kernel: Kernel, pieces: Iterable[str]) -> Iterator[tuple[str, ...]]:
    """List those of `pieces` that the cache lacks, as arguments of this module."""
    for piece in pieces:
        if any(function.is_missing() for function in _PIECES[piece](kernel)):
            method = kernel.method if piece in (KERNEL, BEGINNING) else PLAIN
            measure = (each.spec for each in kernel.measurements if piece == KERNEL)
            yield piece, method, kernel.model.key, *measure


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
            for process in running:
                if process.poll() == _DOES_NOT_COMPILE and process.stdout:
                    raise CompileError(*json.loads(process.stdout.read()))
            running = [process for process in running if process.returncode is None]


_BEGIN = f"""
import sys
from importlib.machinery import PathFinder
from importlib.util import module_from_spec

spec = PathFinder.find_spec("sweep", sys.argv[1:2])
sys.modules["sweep"] = module_from_spec(spec)
spec.loader.exec_module(sys.modules["sweep"])
from {__name__} import main

main(*sys.argv[2:])
"""
"""The program of such a process. With -P it imports nothing from the current folder, but this package from anywhere."""


def _start(job: tuple[str, ...], origin: Origin | None) -> subprocess.Popen[bytes]:
    # Nothing else is ever written to stdin: it closes when this process ends, however it ends.
    command = [sys.executable, "-P", "-c", _BEGIN, str(Path(__file__).parents[2]), *job]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    if origin and process.stdin:
        with suppress(BrokenPipeError):  # it has failed: its piece stays missing
            process.stdin.write(json.dumps(vars(origin)).encode() + b"\n")
            process.stdin.flush()
    return process


def _end_with_parent() -> None:
    os.read(sys.stdin.fileno(), 1)
    os._exit(1)


def main(piece: str, method: str, name: str, *measure: str) -> None:
    """Compile one piece into the cache."""
    if "@" in name:
        origin = Origin(**json.loads(sys.stdin.buffer.readline()))
        model = loading.compiled_as(origin, name.partition("@")[0])
    else:
        model = find(name)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    compile_for_disk()
    gc.disable()  # the garbage collector's search for cycles takes a twentieth of the time
    try:
        for function in _PIECES[piece](make_kernel(method, model, measure)):
            function.compile()
    except CompileError as error:
        if model.origin:  # the run finds the place in the user's file
            raise
        print(json.dumps([error.places, error.reason]), flush=True)
        os._exit(_DOES_NOT_COMPILE)
