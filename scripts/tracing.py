"""The package's right-hand sides for the numbers of other tools."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import FunctionType, SimpleNamespace
from typing import Any

import numpy as np

from sweep.models.model import Model


def traced_rhs(model: Model, sqrt: Callable[[Any], Any]) -> Callable[..., Any]:
    """The right-hand side of `model`, with `sqrt` in the place of numpy's; its constants are a tuple in their order."""
    rhs = _traced(model.rhs, SimpleNamespace(sqrt=sqrt))
    return lambda y, p: rhs(y, model.constants(*p))


def taylor_system(model: Model, scale: Sequence[float] | None = None) -> tuple[list[tuple[Any, Any]], tuple[Any, ...]]:
    """The equations of `model` for heyoka, and what else its right-hand side gives, as symbols.

    Its constants are heyoka's parameters, in their order; its states are in multiples of `scale`, by default of one.
    """
    import heyoka

    symbols, units = heyoka.make_vars(*model.states), scale if scale is not None else [1.0] * len(model.states)
    states = tuple(symbol * unit for symbol, unit in zip(symbols, units, strict=True))
    constants = tuple(heyoka.par[i] for i in range(len(model.constants._fields)))
    slopes, others = traced_rhs(model, heyoka.sqrt)(states, constants)
    scaled = [slope * (1 / unit) for slope, unit in zip(slopes, units, strict=True)]
    return list(zip(symbols, scaled, strict=True)), others


def _traced(function: Any, numbers: Any) -> Any:
    """`function`, and all that it calls by name, with `numbers` in the place of numpy."""
    known = {name: function.__globals__[name] for name in function.__code__.co_names if name in function.__globals__}
    for name, value in known.items():
        if value is np:
            known[name] = numbers
        elif isinstance(value, FunctionType):
            known[name] = _traced(value, numbers)
    return FunctionType(function.__code__, known)
