"""Hashes what the code of a function means: what it does and what it calls, whatever its comments and docstrings say.

Numba compiles a function from its bytecode, and takes from outside what the bytecode names: variables of enclosing
functions and of the module.  These are followed here in the same way, through every function that is called.  Numbers,
texts and tuples count by their values, and what comes from other packages by its name.  An object of any other kind
cannot be followed, and the sources of all numeric code count in its place.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Iterator
from types import CodeType, FunctionType
from typing import Any

import numpy as np

INLINED = "is_inlined"
"""Attribute of a function that says whether it is inlined into compiled code."""


class Unknown(TypeError):
    """An object that compiled code depends on cannot be followed."""


def meaning(function: Any) -> str:
    """Return a hash of what `function` does, with all that it calls.

    Raises
    ------
    Unknown
        if it depends on an object whose meaning is not known.
    """
    digest, seen = hashlib.sha256(), dict[int, int]()
    for part in _of(function, seen):
        digest.update(f"{part}\0".encode())
    return digest.hexdigest()


def _of(value: Any, seen: dict[int, int]) -> Iterator[str]:
    """Yield texts that say what `value` means; one that came before is named by its number in `seen`."""
    # A compiled function is what it was compiled from, and an intrinsic is the function that generates its code.
    function = getattr(value, "py_func", getattr(value, "_defn", value))
    if id(function) in seen:
        yield f"again {seen[id(function)]}"
    elif isinstance(function, FunctionType) and not _is_of_library(function):
        seen[id(function)] = len(seen)
        yield f"function {getattr(function, INLINED, '')}"
        yield from _of(tuple(getattr(value, "targetoptions", {}).items()), seen)
        yield from _of_function(function, seen)
    elif isinstance(value, tuple | list):
        yield f"{type(value).__name__} {getattr(value, '_fields', '')} {len(value)}"
        for each in value:
            yield from _of(each, seen)
    elif isinstance(value, frozenset | set):
        yield repr(sorted(map(repr, value)))
    elif isinstance(value, np.ndarray):
        yield f"{value.dtype} {value.shape} {value.tobytes().hex()}"
    elif isinstance(value, _PLAIN):
        yield f"{type(value).__name__} {value!r}"
    elif isinstance(value, type) and issubclass(value, tuple) and hasattr(value, "_fields"):
        yield f"record {value._fields}"
    else:
        yield _name(value)


_PLAIN = (bool, int, float, complex, str, bytes, type(None), type(...), np.generic)

_LIBRARIES = ("numpy", "numba", "builtins", "math", "cmath")
"""Packages whose objects are known by name; who caches compiled code adds their versions to the key."""


def _is_of_library(function: FunctionType) -> bool:
    # Generated functions belong to no module.
    return (function.__module__ or "").partition(".")[0] in _LIBRARIES


def _name(value: Any) -> str:
    name = getattr(value, "__name__", "")
    place: str = "numpy" if isinstance(value, np.ufunc) else getattr(value, "__module__", None) or name
    if not name or place.partition(".")[0] not in _LIBRARIES:
        raise Unknown(f"{value!r} cannot be followed")
    return f"{place}.{getattr(value, '__qualname__', name)}"


def _of_function(function: FunctionType, seen: dict[int, int]) -> Iterator[str]:
    yield from _of_code(function.__code__, seen)
    yield from _of(function.__defaults__ or (), seen)
    cells = (cell.cell_contents for cell in function.__closure__ or ())
    for name, value in zip(function.__code__.co_freevars, cells, strict=True):
        yield name
        yield from _of(value, seen)
    for name in sorted(_names(function.__code__) & function.__globals__.keys()):
        yield name
        yield from _of(function.__globals__[name], seen)


def _of_code(code: CodeType, seen: dict[int, int]) -> Iterator[str]:
    """Yield what a code object says, without its docstring, its name and its line numbers."""
    yield f"{code.co_code.hex()} {code.co_names} {code.co_varnames} {code.co_cellvars} {code.co_argcount}"
    for const in code.co_consts[_documented(code) :]:
        yield from _of_code(const, seen) if isinstance(const, CodeType) else _of(const, seen)


def _documented(code: CodeType) -> bool:
    """Return whether the first constant is the docstring, or None in the place of one."""
    if sys.version_info >= (3, 13):
        return bool(code.co_flags & _HAS_DOCSTRING)
    return code.co_name != "<lambda>"


_HAS_DOCSTRING = 0x4000000
"""The flag `CO_HAS_DOCSTRING` of Python 3.13."""


def _names(code: CodeType) -> set[str]:
    inner = (_names(const) for const in code.co_consts if isinstance(const, CodeType))
    return set(code.co_names).union(*inner)
