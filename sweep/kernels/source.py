"""Prints the source generated for a kernel: python -m sweep.kernels.source METHOD MODEL [MEASURE …]"""

from __future__ import annotations

import linecache
import sys

from sweep.kernels.codegen import PREFIX
from sweep.kernels.methods import make_kernel
from sweep.models import find


def main(method: str, model: str, *measure: str) -> None:
    """Print each generated function under the file name by which tracebacks refer to it."""
    make_kernel(method, find(model), measure)
    for name in linecache.cache:
        if name.startswith(PREFIX):
            print(f"# {name}\n{''.join(linecache.getlines(name))}\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
