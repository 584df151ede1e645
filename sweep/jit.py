"""All Numba options of the project, and the on-disk cache that makes compiled kernels safe to reuse."""

from __future__ import annotations

import hashlib
import itertools
import os
import platform
from collections.abc import Callable
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np
from numba.core.bytecode import FunctionIdentity
from numba.core.caching import FunctionCache
from numba.core.registry import cpu_target
from numba.extending import register_jitable

# contract: fuse a*b + c into one FMA.  nsz, arcp: harmless on the values met here.
# Not nnan or ninf: these let the compiler assume that no NaN or infinity occurs, so tests such as `x > 0`
# and isfinite(x) become constants for exactly the states that they have to catch.
# Not reassoc: 4 % faster on the slip model, but it may rearrange (1 - u1^2) - u2^2 and the differences in
# the energy, and the last bits then depend on choices of the optimiser.
FASTMATH = {"contract", "nsz", "arcp"}

# error_model="python" would put a branch in front of each division, which prevents vectorisation.
OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": FASTMATH}

# Numba numbers the functions of each process from 1, and only that number distinguishes the symbols of two
# closures with the same name.  When one process loaded two kernels that two others had compiled, these shared
# symbols, and one called the loop of the other, made for another layout: wrong numbers, or a crash.  So each
# process starts from a random number.
FunctionIdentity._unique_ids = itertools.count(int.from_bytes(os.urandom(5), "little"))

_NUMERIC_SOURCES = ("jit.py", "models/**/*.py", "kernels/**/*.py")


def inline(function: Callable[..., Any]) -> Callable[..., Any]:
    """Mark `function` to be inlined into the compiled code that calls it.

    Called from Python, it remains plain Python, and so do the inline functions that it calls: it takes arrays,
    real or complex, and nothing is compiled.
    """
    jitable: Callable[..., Any] = register_jitable(forceinline=True, **OPTIONS)(function)
    return jitable


def parallel(function: Callable[..., Any], specialisation: str, *modules: str) -> Any:
    """Compile `function` with prange; cache the result on disk under `specialisation` and a hash of all sources.

    Numba's own cache depends on the file that defines a function and on the function's closure.  Here the
    closure holds compiled functions from other files.  Numba takes these for new ones in every process, so its
    cache would never hit, and it does not notice when those files are edited.  The key used instead consists of
    the specialisation and of a hash: of every numeric source, of the `modules` (files of models from outside
    the package), and of the versions of the libraries that compile them.
    """
    return _cached(numba.njit(function, parallel=True, **OPTIONS), specialisation, *modules)


def serial(function: Callable[..., Any], specialisation: str) -> Any:
    """As `parallel`, but on the thread that calls it, while other threads go on."""
    return _cached(numba.njit(function, nogil=True, **OPTIONS), specialisation)


def _cached(dispatcher: Any, specialisation: str, *modules: str) -> Any:
    dispatcher._cache = _SpecialisedCache(dispatcher.py_func, (specialisation, fingerprint(*modules)))
    return dispatcher


def is_cached(dispatcher: Any, signature: tuple[Any, ...]) -> bool:
    """Whether `dispatcher` can load `signature` from disk instead of compiling it."""
    return bool(dispatcher._cache.holds(signature))


def fingerprint(*modules: str) -> str:
    """Hash of all sources from which a kernel can be built, and of the versions of what compiles them."""
    root = Path(__file__).parent
    files = [path for pattern in _NUMERIC_SOURCES for path in sorted(root.glob(pattern))]
    digest = hashlib.sha256()
    for path in [*files, *map(Path, modules)]:
        name = path.relative_to(root) if path.is_relative_to(root) else Path(path.name)
        digest.update(name.as_posix().encode() + b"\0" + path.read_bytes())
    for version in (platform.python_version(), numba.__version__, llvmlite.__version__, np.__version__):
        digest.update(version.encode())
    return digest.hexdigest()[:16]


class _SpecialisedCache(FunctionCache):
    """Numba's cache, in which `key` (the specialisation and the hash of the sources) replaces the closure."""

    def __init__(self, function: Callable[..., Any], key: tuple[str, str]) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        self._key = key

    def _index_key(self, sig: Any, codegen: Any) -> tuple[Any, ...]:
        return (sig, codegen.magic_tuple(), self._key)

    def holds(self, sig: tuple[Any, ...]) -> bool:
        context = cpu_target.target_context
        context.refresh()
        return self._index_key(sig, context.codegen()) in self._cache_file._load_index()  # type: ignore[no-untyped-call]
