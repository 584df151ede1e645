"""Derive the directional derivative of a right-hand side, as straight-line source, by tracing it once.

Functions of a model are traced with `Dual` numbers, whose derivatives follow from the rules of calculus
(`sweep.models.symbols`).  No difference is taken, so that every component keeps its relative precision however small it
is.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from sweep.models.model import Model
from sweep.models.symbols import Constants, Symbol, choose, power, specialised

_RULES: dict[Any, Callable[..., Any]] = {
    np.negative: lambda r, a, da: -da,
    np.sqrt: lambda r, a, da: 0.5 * da / r,
    np.absolute: lambda r, a, da: choose(">=", a, 0.0, da, -da),
    np.exp: lambda r, a, da: r * da,
    np.log: lambda r, a, da: da / a,
    np.sin: lambda r, a, da: np.cos(a) * da,
    np.cos: lambda r, a, da: -np.sin(a) * da,
    np.tanh: lambda r, a, da: (1.0 - r * r) * da,
    np.square: lambda r, a, da: 2.0 * a * da,
    np.add: lambda r, a, b, da, db: da + db,
    np.subtract: lambda r, a, b, da, db: da - db,
    np.multiply: lambda r, a, b, da, db: da * b + a * db,
    np.divide: lambda r, a, b, da, db: (da - r * db) / b,
    np.minimum: lambda r, a, b, da, db: choose("<", a, b, da, db),
    np.maximum: lambda r, a, b, da, db: choose(">", a, b, da, db),
}
"""The derivative of the value r of an operation, from its operands and their derivatives."""


class Dual(np.lib.mixins.NDArrayOperatorsMixin):
    """A traced number and its derivative."""

    def __init__(self, value: Any, slope: Any) -> None:
        self.value, self.slope = value, slope

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        if ufunc is np.power and isinstance(inputs[1], int) and inputs[1] > 0:
            return power(*inputs)
        if ufunc not in _RULES or method != "__call__" or options:
            raise TypeError(f"{ufunc.__name__} cannot be differentiated")
        values, slopes = zip(*map(_parts, inputs), strict=True)
        result = ufunc(*values)
        changes = any(isinstance(each, Symbol) or each != 0 for each in slopes)
        return Dual(result, _RULES[ufunc](result, *values, *slopes) if changes else 0.0)

    def __bool__(self) -> bool:
        raise TypeError("a branch cannot be differentiated")


def _parts(number: Any) -> tuple[Any, Any]:
    return (number.value, number.slope) if isinstance(number, Dual) else (float(number), 0.0)


def make_extended(model: Model):
    """Inline (z, constants) -> (slopes, (0.0, 0.0, 1.0, 1.0)) for z = (states, direction), as a right-hand side.

    The slopes are those of the states, and their derivative in the direction.

    Raises
    ------
    TypeError
        if the right-hand side of the model is not plain arithmetic.
    """
    n = len(model.states)

    def extended(z, p):
        states = tuple(Dual(*each) for each in zip(z[:n], z[n:], strict=True))
        constants = model.constants(*(Dual(getattr(p, name), 0.0) for name in model.constants._fields))
        parts = [_parts(each) for each in model.rhs(states, constants)[0]]
        return (*(value for value, _ in parts), *(slope for _, slope in parts)), (0.0, 0.0, 1.0, 1.0)

    return specialised(extended, z=2 * n, p=Constants(model.constants._fields, {}))


def undifferentiable(model: Model) -> str:
    """Return why the right-hand side of a model cannot be differentiated; "" if it can."""
    try:
        make_extended(model)
    except (TypeError, AttributeError) as error:
        return str(error)
    return ""
