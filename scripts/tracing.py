"""The package's right-hand sides for the numbers of other tools."""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType, SimpleNamespace
from typing import Any

import numpy as np

from sweep.models.model import Model


def traced_rhs(model: Model, sqrt: Callable[[Any], Any]) -> Callable[..., Any]:
    """The right-hand side of `model`, with `sqrt` in the place of numpy's; its constants are a tuple in their order."""
    rhs = _traced(model.rhs, SimpleNamespace(sqrt=sqrt))
    return lambda y, p: rhs(y, model.constants(*p))


def _traced(function: Any, numbers: Any) -> Any:
    """`function`, and all that it calls by name, with `numbers` in the place of numpy."""
    known = {name: function.__globals__[name] for name in function.__code__.co_names if name in function.__globals__}
    for name, value in known.items():
        if value is np:
            known[name] = numbers
        elif isinstance(value, FunctionType):
            known[name] = _traced(value, numbers)
    return FunctionType(function.__code__, known)
