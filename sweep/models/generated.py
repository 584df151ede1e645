"""Compile generated source: straight-line code under file names that tracebacks and debuggers can find."""

from __future__ import annotations

import hashlib
import linecache
from collections.abc import Iterable
from typing import Any

from sweep.jit import inline

GENERATED: dict[str, dict[str, Any]] = {}
"""The bindings of the names in each generated source, by the source's file name."""


def compile_inline(name: str, arguments: str, lines: Iterable[str], names: dict[str, Any]):
    """Compiled (arguments) -> what `lines` return, which may use `names`.

    Equal sources have equal file names in every process.
    """
    source = "\n".join([f"def {name}({arguments}):", *(f"    {line}" for line in lines)])
    digest = hashlib.sha256(source.encode()).hexdigest()[:16]
    filename = f"<sweep {name} {digest}>"
    linecache.cache[filename] = (len(source), None, source.splitlines(keepends=True), filename)
    GENERATED[filename] = names
    namespace = dict(names)
    exec(compile(source, filename, "exec"), namespace)
    return inline(namespace[name])


def tuple_of(items: Iterable[str]) -> str:
    """Return the source of a tuple."""
    return f"({' '.join(item + ',' for item in items)})"
