"""Print the source generated for a kernel: python -m sweep.kernels.source METHOD MODEL [MEASURE …]"""

from __future__ import annotations

import linecache
import sys
from collections.abc import Iterator
from typing import Any

from sweep.kernels.methods import make_kernel
from sweep.models import find
from sweep.models.generated import GENERATED


def main(method: str, model: str, *measure: str) -> None:
    """Print each generated function under its file name in tracebacks, and what its names are bound to."""
    make_kernel(method, find(model), measure)
    for name, names in GENERATED.items():
        print(f"# {name}", *_bound(names), "".join(linecache.getlines(name)), "", sep="\n")


def _bound(names: dict[str, Any]) -> Iterator[str]:
    """Give the place where each function or class in a source is defined, one per line."""
    for name, value in names.items():
        if isinstance(value, type):
            yield f"#   {name}: {value.__module__}.{value.__qualname__}"
        elif code := getattr(getattr(value, "py_func", value), "__code__", None):
            yield f"#   {name}: {code.co_filename}:{code.co_firstlineno}"


if __name__ == "__main__":
    main(*sys.argv[1:])
