"""Every Numba option of the project, and the cache that makes a compiled kernel safe to reuse."""

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

# contract: fuse a*b + c into one FMA; nsz, arcp: free on the values met here.
# Not nnan/ninf: they turn `x > 0` and isfinite(x) into constants for the very states to be caught.
# Not reassoc: 4 % faster on the slip model, but it may undo (1 - u1^2) - u2^2 and the energy's
# differences, and ties the last bits to the compiler's mood.
FASTMATH = {"contract", "nsz", "arcp"}

# error_model="python" puts a branch in front of each division, which stops vectorisation.
OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": FASTMATH}

# Numba numbers the functions of a process from 1, and only that number tells the symbols of two closures
# of one name apart.  Two kernels compiled by two processes and loaded by a third then shared symbols, and one
# called the other's loop, with other rows: wrong numbers, or a crash.
FunctionIdentity._unique_ids = itertools.count(int.from_bytes(os.urandom(5), "little"))

_NUMERIC_SOURCES = ("jit.py", "models/**/*.py", "kernels/**/*.py")


def inline(function: Callable[..., Any]) -> Callable[..., Any]:
    """Let `function` dissolve into compiled code that calls it.

    Called from Python it stays Python, all the way down: on arrays, real or complex, it compiles nothing.
    """
    jitable: Callable[..., Any] = register_jitable(forceinline=True, **OPTIONS)(function)
    return jitable


def parallel(function: Callable[..., Any], specialisation: str, *modules: str) -> Any:
    """Compile `function` with prange, cached on disk under `specialisation` and all its sources.

    Numba's own cache looks at the file that defines a function and at its closure.  Here the
    closure holds compiled functions from other files (Numba sees a new one in every process and
    would never hit) whose edits it cannot see.  The key used instead names the specialisation and
    carries a hash of every numeric source, of the `modules` (files of models from outside the
    package) and of the libraries that compile them.
    """
    return _cached(numba.njit(function, parallel=True, **OPTIONS), specialisation, *modules)


def serial(function: Callable[..., Any], specialisation: str) -> Any:
    """As `parallel`, for work not worth sharing out: threads take their time to come in on a busy machine."""
    return _cached(numba.njit(function, **OPTIONS), specialisation)


def _cached(dispatcher: Any, specialisation: str, *modules: str) -> Any:
    dispatcher._cache = _SpecialisedCache(dispatcher.py_func, (specialisation, fingerprint(*modules)))
    return dispatcher


def is_cached(dispatcher: Any, signature: tuple[Any, ...]) -> bool:
    """Whether `dispatcher` can load `signature` from disk instead of compiling it."""
    return bool(dispatcher._cache.holds(signature))


def fingerprint(*modules: str) -> str:
    """Hash of all sources a kernel can be built from, and of what compiles them."""
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
    def __init__(self, function: Callable[..., Any], key: tuple[str, str]) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        self._key = key

    def _index_key(self, sig: Any, codegen: Any) -> tuple[Any, ...]:
        return (sig, codegen.magic_tuple(), self._key)

    def holds(self, sig: tuple[Any, ...]) -> bool:
        context = cpu_target.target_context
        context.refresh()
        return self._index_key(sig, context.codegen()) in self._cache_file._load_index()  # type: ignore[no-untyped-call]
