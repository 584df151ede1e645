"""Python's values as the plain data that a YAML file holds: numbers, words, lists and mappings."""

from __future__ import annotations

import os
from collections.abc import Mapping
from numbers import Integral, Real
from typing import Any

import numpy as np


def plain(value: Any) -> Any:
    """`value` with tuples, ranges and arrays as lists, and NumPy's numbers as Python's.

    An array is whatever NumPy can read as one, such as an `xarray.DataArray` or a `pandas.Series`.  Values of
    any other type are returned as they are, and refused by the schema.
    """
    if value is None or (isinstance(value, str | bool | int | float) and type(value).__module__ == "builtins"):
        return value
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | range):
        return [plain(item) for item in value]
    if isinstance(value, np.ndarray | np.generic) or hasattr(value, "__array__"):
        return np.asarray(value).tolist()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, Integral):
        return int(value)
    return float(value) if isinstance(value, Real) else value
