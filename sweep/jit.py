"""All Numba options of the project, and the on-disk cache that makes compiled kernels safe to reuse.

Numba takes half a second to import, so it is imported when the first function is to be compiled.  This module alone
looks inside Numba (`tests/test_numba.py` lists what for); all others keep to its public names.
"""

from __future__ import annotations

import gc
import hashlib
import itertools
import os
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from contextvars import ContextVar
from functools import cache
from itertools import pairwise
from pathlib import Path
from threading import Lock, RLock, current_thread
from traceback import walk_tb
from types import FunctionType
from typing import Any

import numpy as np

from sweep.faults import CompileError, fault_of
from sweep.meaning import INLINED, Unknown, meaning
from sweep.sources import hashed, versions

# contract: fuse a*b + c into one FMA.  nsz, arcp: harmless on the values met here.
# Not nnan or ninf: these let the compiler assume that no NaN or infinity occurs, so tests such as `x > 0`
# and isfinite(x) become constants for exactly the states that they have to catch.
# Not reassoc: 4 % faster on the slip model, but it may rearrange (1 - u1^2) - u2^2 and the differences in
# the energy, and the last bits then depend on choices of the optimiser.
FASTMATH = {"contract", "nsz", "arcp"}

# error_model="python" would put a branch in front of each division, which prevents vectorisation.
OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": FASTMATH}

_WIDEST = 512

_NUMERIC_SOURCES = ("jit.py", "models/**/*.py", "kernels/**/*.py")

_KEPT = 10
"""Number of versions of a compiled function that the cache on disk keeps, each in two files."""

_waiting: list[tuple[Callable[..., Any], bool]] = []
"""Functions that Numba does not know yet, because it is not imported, and whether they are inlined."""


INTERPRETED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")
"""True if Numba must not compile: everything then runs in plain Python, on one thread, where a debugger stops."""


@cache
def load_numba() -> Any:
    """Return the module `numba`, which from now on knows the inline functions: who compiles them takes it from here."""
    import numba
    from llvmlite import binding
    from numba.core.bytecode import FunctionIdentity

    # LLVM vectorises a loop only if a few comparisons show that its arrays lie apart.  By default it gives up merging
    # these after 100 places in memory, and adams for any body has more: its step took seven times as long.
    binding.set_option(__name__, "--memory-check-merge-threshold=1000")

    # Numba numbers the functions of each process from 1, and only that number distinguishes the symbols of two
    # closures with the same name.  When one process loaded two kernels that two others had compiled, these shared
    # symbols, and one called the loop of the other, made for another layout: wrong numbers, or a crash.  So each
    # process starts from a random number.
    FunctionIdentity._unique_ids = itertools.count(int.from_bytes(os.urandom(5), "little"))
    while _waiting:
        _register(*_waiting.pop(0))
    return numba


def _register(function: Callable[..., Any], inlined: bool) -> None:
    from numba.extending import register_jitable

    # Wrappers by which C and Python would call it take a twentieth of the time to compile a kernel.
    register_jitable(forceinline=inlined, no_cfunc_wrapper=True, no_cpython_wrapper=True, **OPTIONS)(function)


def inline(function: Callable[..., Any]) -> Callable[..., Any]:
    """Mark `function` to be inlined into the compiled code that calls it.

    Called from Python, it remains plain Python, and so do the inline functions that it calls: it takes arrays,
    real or complex, and nothing is compiled.
    """
    return _marked(function, inlined=True)


def called(function: Callable[..., Any]) -> Callable[..., Any]:
    """As `inline`, but a function of its own in the compiled code too: for one that is called from several places."""
    return _marked(function, inlined=False)


def _marked(function: Callable[..., Any], inlined: bool) -> Callable[..., Any]:
    setattr(function, INLINED, inlined)
    if load_numba.cache_info().currsize:
        _register(function, inlined)
    else:
        _waiting.append((function, inlined))
    return function


@inline
def nothing(*_: Any) -> float:
    """The literal 0.0, for what a kernel does without: a sum with it leaves no instruction."""
    return 0.0


def compiled(function: Callable[..., Any]) -> Any:
    """`function`, to be compiled when it is first called, or as part of the compiled function that calls it."""
    return load_numba().njit(function, **OPTIONS)


def exactly_compiled(function: Callable[..., Any]) -> Any:
    """As `compiled`, but operations are carried out as they are written: without `FASTMATH`."""
    return load_numba().njit(function, error_model=OPTIONS["error_model"])


def parallel(function: Callable[..., Any], types: str, specialisation: str) -> Cached:
    """`function`, with prange, from the cache on disk, or compiled when it is first called.

    Parameters
    ----------
    types : of its arguments, as Numba writes a signature
    specialisation : tells apart what is made from the same function; one of them has one signature only
    """
    return Cached(load_numba().njit(function, parallel=True, **OPTIONS), types, specialisation, launches=True)


def serial(function: Callable[..., Any], types: str, specialisation: str) -> Cached:
    """As `parallel`, but on the thread that calls it, while other threads go on."""
    return Cached(load_numba().njit(function, nogil=True, **OPTIONS), types, specialisation)


@cache
def full_width() -> Any:
    """A compiled function, () -> None: loops of the function that calls it are vectorised as widely as the CPU can.

    For many of Intel's CPUs with AVX-512 LLVM prefers vectors of 256 bits, because wide ones used to slow the clock
    down.  It adds no instruction, only an attribute of the caller; what that is inlined into has to call it as well.
    """
    if INTERPRETED:
        return lambda: None
    from numba import types
    from numba.extending import intrinsic

    load_numba()

    @intrinsic
    def prefer_full_width(typing_context: Any) -> Any:  # noqa: ARG001
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:  # noqa: ARG001
            # llvmlite knows only attributes without a value.
            set.add(builder.function.attributes, f'"prefer-vector-width"="{_WIDEST}"')
            return context.get_dummy_value()

        return types.void(), generate

    return prefer_full_width


def compile_for_disk() -> None:
    """Prepare this process, which compiles for the cache on disk and runs nothing, to leave out what only runs need.

    Numba optimises each function by itself, and makes machine code of it, even if it is only part of others: together a
    fifth of the time. It also imports SciPy, for linear algebra that no compiled function has.
    """
    sys.modules["scipy"] = None  # type: ignore[assignment]
    load_numba()
    from numba.core import codegen

    library: Any = codegen.JITCodeLibrary
    optimise = library._optimize_final_module

    def optimise_what_python_calls(self: Any) -> None:
        if any(function.name.startswith("_ZN7cpython") for function in self.get_defined_functions()):
            optimise(self)

    library._optimize_final_module = optimise_what_python_calls
    # Numba then makes machine code where it asks for the address of a function, as it does if Python calls it.
    library._finalize_specific = codegen.JITCPUCodegen.set_env = nothing  # type: ignore[method-assign]


def vector_bits() -> int:
    """Width of the vectors in which kernels compute, in bits."""
    load_numba()
    from numba.core.registry import cpu_target

    *_, features = cpu_target.target_context.codegen().magic_tuple()
    widths = {"+avx512f": _WIDEST, "+avx": 256}
    return next((bits for feature, bits in widths.items() if feature in features.split(",")), 128)


def threads() -> int:
    """Number of threads on which parallel functions run."""
    return 1 if INTERPRETED else int(load_numba().get_num_threads())


@contextmanager
def all_threads() -> Iterator[None]:
    """Let parallel functions run on all threads within, even if the calling thread has fewer."""
    numba, usual = load_numba(), threads()
    numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)
    try:
        yield
    finally:
        numba.set_num_threads(usual)


def on_all_threads(function: Callable[[Any], Any], items: Sequence[Any]) -> list[Any]:
    """Call `function` for each of `items`, and return what it returns.

    It has to spend its time in functions of `serial`, or in those of NumPy that let other threads run, as LAPACK's do.
    Called on one of these threads, it uses that thread alone.
    """
    shares = [items[i :: 4 * threads()] for i in range(min(len(items), 4 * threads()))]
    within = current_thread().name.startswith(_POOL)
    over = map if INTERPRETED or len(shares) == 1 or within else _pool(threads()).map
    found: list[Any] = [None] * len(items)
    for i, results in enumerate(over(lambda share: [*map(function, share)], shares)):
        found[i :: len(shares)] = results
    return found


_POOL = "sweep-"


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    # It is kept, because threads take a millisecond to start.
    return ThreadPoolExecutor(threads, thread_name_prefix=_POOL)


_launched = _orphaned = False
"""Whether a parallel function has run, in this process, and in a parent that it was forked from."""

_LAUNCHING = Lock()


def _after_fork() -> None:
    """Forget the threads of the parent, which this process does not have: it would wait for them for ever."""
    global _orphaned, _LAUNCHING
    _pool.cache_clear()
    _orphaned, _LAUNCHING = _orphaned or _launched, Lock()


os.register_at_fork(after_in_child=_after_fork)


@contextmanager
def _launching() -> Iterator[None]:
    """Keep other parallel functions from running: the threading layer `workqueue` ends a process that runs two.

    Raises
    ------
    InputError
        in a process that was forked after a run, if it has none of the threads of its parent.
    """
    global _launched
    if _orphaned and load_numba().threading_layer() == "omp":  # the other layers start new threads
        raise fault_of(
            "this process was forked after a run, and has none of its threads; start processes by 'spawn', such as "
            "multiprocessing.get_context('spawn').Pool()"
        )
    with _LAUNCHING:
        _launched = True
        yield


def fingerprint(function: Callable[..., Any]) -> str:
    """Return a hash of all that decides the machine code of a function: what it means, and what compiles it.

    If it depends on something of unknown meaning, the sources of all numeric code count.
    """
    try:
        means = meaning(function)
    except Unknown:
        means = hashed(path for pattern in _NUMERIC_SOURCES for path in Path(__file__).parent.glob(pattern))
    return _short(f"{means} {hashed([Path(__file__)])} {versions()}")


def _short(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]


_FUNCTION = re.compile(r"No implementation of function Function\(<function \S+ at 0x([0-9a-f]+)>")
_FILE = re.compile(r'File "(.+?)", line (\d+)')


def compiler_said(error: Exception) -> tuple[list[tuple[str, int]], str]:
    """Return the places, as file and line, that an error of Numba's compiler names, and why it failed.

    What Python raises while Numba infers a type, such as for a function that NumPy lacks, counts as one. An error of
    anything else has no places and no reason.
    """
    if isinstance(error, CompileError):
        return [*error.places], error.reason
    if not type(error).__module__.startswith("numba"):
        held = (frame.f_locals.get("constraint") for frame, _ in walk_tb(error.__traceback__))
        places = [(at.filename, at.line) for each in held if (at := getattr(each, "loc", None))]
        return places, str(error) if places else ""
    where = getattr(error, "loc", None)
    places = [(where.filename, where.line)] if where else []
    places += [(file, int(line)) for file, line in _FILE.findall(str(error))]
    # Numba says, from the outermost function inwards: that it failed, and why.
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    reason = [after for before, after in pairwise(lines) if "Failed in" in before] or lines
    return places + _called_last(str(error), reason[-1]), reason[-1]


def _called_last(message: str, reason: str) -> list[tuple[str, int]]:
    """Return the place in the innermost function that a message of Numba's names by its address, where it gives none.

    It is the line with the name that the reason quotes, or else that of the function.
    """
    wanted = {int(address, 16) for address in _FUNCTION.findall(message)[-1:]}
    found = [each for each in gc.get_objects() if id(each) in wanted and isinstance(each, FunctionType)]
    quoted = re.search(r"'(\w+)'", reason)
    places = []
    for code in (each.__code__ for each in found if os.path.exists(each.__code__.co_filename)):
        lines = Path(code.co_filename).read_text(encoding="utf-8").splitlines()
        inside = range(code.co_firstlineno, max(line or 0 for *_, line in code.co_lines()) + 1)
        named = [line for line in inside if quoted and re.search(rf"\b{quoted[1]}\b", lines[line - 1])]
        places.append((code.co_filename, (named or [*inside])[0]))
    return places


@contextmanager
def condensed() -> Iterator[None]:
    """Turn the two hundred lines of an error of Numba's compiler into a `CompileError`."""
    try:
        yield
    except Exception as error:
        places, reason = compiler_said(error)
        if not reason:
            raise
        raise CompileError(places, reason) from None


_LOADING = RLock()

_shown: ContextVar[Callable[[], AbstractContextManager[Any]]] = ContextVar("shown", default=nullcontext)


@contextmanager
def showing(show: Callable[[], AbstractContextManager[Any]]) -> Iterator[None]:
    """Enter `show()` whenever something begins to be compiled, and leave it when that is done."""
    token = _shown.set(show)
    try:
        yield
    finally:
        _shown.reset(token)


def compiling() -> AbstractContextManager[Any]:
    """To be entered while something is compiled: shows this where `showing` says how."""
    return _shown.get()()


class Cached:
    """A compiled function whose machine code is kept on disk.

    Numba's own cache depends on the file that defines a function and on the function's closure.  Here the closure
    holds compiled functions from other files.  Numba takes these for new ones in every process, so its cache would
    never hit, and it does not notice when those files are edited.  The name of a file of this cache consists instead of
    the specialisation and of the `fingerprint`, so that an edit of a comment, or of what the function does not use,
    compiles nothing, and two branches keep their code side by side.
    """

    def __init__(self, dispatcher: Any, types: str, specialisation: str, *, launches: bool = False) -> None:
        self._launches = launches and not INTERPRETED
        self._dispatcher, self._types, self._cache, self._found = dispatcher, types, None, False
        if INTERPRETED:  # Numba has returned the function as it was
            return
        with suppress(RuntimeError):  # Numba finds no folder to write to: each process compiles for itself
            self._cache = dispatcher._cache = _disk_cache()(dispatcher.py_func, specialisation)

    def __call__(self, *arguments: Any) -> None:
        if not self.is_ready():
            self.compile()
        # Compiled code does not warn of a division by zero.
        with np.errstate(all="ignore") if INTERPRETED else _launching() if self._launches else nullcontext():
            self._dispatcher(*arguments)

    def compile(self) -> None:
        """Compile it, or load it from disk, so that no timing of a run includes that.

        Raises
        ------
        CompileError
            if Numba cannot compile it.
        """
        # Numba compiles on one thread at a time, but while it loads from disk another thread finds it half ready.
        with _LOADING:
            if not self.is_ready():
                with nullcontext() if self.is_compiled() else compiling(), condensed():
                    self._dispatcher.compile(self._types)

    def is_ready(self) -> bool:
        """Return whether there is machine code in memory, or none is needed."""
        return INTERPRETED or bool(self._dispatcher.signatures)

    def is_compiled(self) -> bool:
        """Return whether the first call will find machine code, in memory or on disk."""
        # To look it up on disk takes a millisecond.
        self._found |= self.is_ready() or (self._cache is not None and self._cache.holds())
        return self._found

    def is_missing(self) -> bool:
        """Return whether another process could compile it into the cache on disk, which lacks it."""
        return self._cache is not None and not self.is_compiled()


@cache
def _disk_cache() -> Any:
    """The class of the caches of `Cached` functions, derived from Numba's."""
    from numba.core.caching import FunctionCache, IndexDataCacheFile
    from numba.core.registry import cpu_target

    class DiskCache(FunctionCache):
        def __init__(self, function: Callable[..., Any], specialisation: str) -> None:
            super().__init__(function)  # type: ignore[no-untyped-call]
            # Each specialisation has files of its own: processes that compile two of them at the same time would
            # otherwise write to one index, and could give the code of one the name of the other.
            self._name = f"{self._impl.filename_base}-{_short(specialisation)}"
            self._cache_file = IndexDataCacheFile(self.cache_path, f"{self._name}-{fingerprint(function)}", "")

        def _index_key(self, sig: Any, codegen: Any) -> tuple[Any, ...]:
            return (sig, codegen.magic_tuple(), vector_bits())

        def holds(self) -> bool:
            context = cpu_target.target_context
            context.refresh()
            machine, files = context.codegen().magic_tuple(), self._cache_file
            found = [name for (_, theirs, _), name in files._load_index().items() if theirs == machine]
            return any(os.path.exists(files._data_path(name)) for name in found)

        def save_overload(self, sig: Any, data: Any) -> None:
            with suppress(OSError):  # such as a full disk: the code in memory runs all the same
                super().save_overload(sig, data)  # type: ignore[no-untyped-call]
                self._discard_oldest()

        def _discard_oldest(self) -> None:
            saved = sorted(Path(self.cache_path).glob(f"{self._name}-*"), key=lambda file: -file.stat().st_mtime)
            for file in saved[2 * _KEPT :]:
                file.unlink(missing_ok=True)

    return DiskCache
