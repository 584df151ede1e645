"""The hash of source code, and the versions of what compiles it: of kernels, of datasets, and of users' models."""

from __future__ import annotations

import hashlib
import os
import platform
from collections.abc import Iterable
from functools import cache
from pathlib import Path


def hashed(files: Iterable[Path]) -> str:
    """Return the SHA-256 of source files: of their paths below the folder that holds them all, and of their texts."""
    found, digest = sorted(files), hashlib.sha256()
    root = os.path.commonpath([path.parent for path in found]) if found else ""
    for path in found:
        digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


@cache
def versions() -> str:
    """Return the versions of Python and of the libraries that compile and run kernels, in words."""
    from importlib import metadata  # which takes as long to import as NumPy

    found = [f"{name} {metadata.version(name)}" for name in ("numba", "llvmlite", "numpy")]
    return ", ".join([f"Python {platform.python_version()}", *found])
