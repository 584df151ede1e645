"""The directional derivative of a right-hand side, as straight-line source that is made by tracing it once.

Functions of a model consist of plain arithmetic without branches (`sweep.models.model.Model`).  Called with `Traced`
numbers they write down what they compute, and beside it the derivative by the rules of calculus.  No difference is
taken, so that every component keeps its relative precision however small it is.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sweep.kernels.codegen import compile_inline, tuple_of
from sweep.models.model import Model

_ONE: dict[Any, tuple[str, str]] = {
    np.negative: ("-{a}", "-{da}"),
    np.sqrt: ("np.sqrt({a})", "0.5 * {da} / {r}"),
    np.absolute: ("abs({a})", "({da} if {a} >= 0.0 else -{da})"),
    np.exp: ("np.exp({a})", "{r} * {da}"),
    np.log: ("np.log({a})", "{da} / {a}"),
    np.sin: ("np.sin({a})", "np.cos({a}) * {da}"),
    np.cos: ("np.cos({a})", "-np.sin({a}) * {da}"),
    np.tanh: ("np.tanh({a})", "(1.0 - {r} * {r}) * {da}"),
    np.square: ("{a} * {a}", "2.0 * {a} * {da}"),
}
"""The value r of an operation on a, and its derivative, da being that of a."""

_TWO: dict[Any, tuple[str, str, str, str]] = {
    np.add: ("{a} + {b}", "{da} + {db}", "{da}", "{db}"),
    np.subtract: ("{a} - {b}", "{da} - {db}", "{da}", "-{db}"),
    np.multiply: ("{a} * {b}", "{da} * {b} + {a} * {db}", "{da} * {b}", "{a} * {db}"),
    np.divide: ("{a} / {b}", "({da} - {r} * {db}) / {b}", "{da} / {b}", "-({r} * {db}) / {b}"),
    np.minimum: ("min({a}, {b})", *3 * ("({da} if {a} < {b} else {db})",)),
    np.maximum: ("max({a}, {b})", *3 * ("({da} if {a} > {b} else {db})",)),
}
"""The value r of an operation on a and b, and its derivative: if both change, if a alone does, and if b alone does."""

_ZERO = "0.0"


class Traced(np.lib.mixins.NDArrayOperatorsMixin):
    """A number of the trace: the names of its value and of its derivative in the source."""

    def __init__(self, lines: list[str], value: str, slope: str) -> None:
        self.lines, self.value, self.slope = lines, value, slope

    def __array_ufunc__(self, ufunc, method: str, *inputs, **options):
        if ufunc is np.power and isinstance(inputs[1], int) and inputs[1] > 0:
            product = inputs[0]
            for _ in range(inputs[1] - 1):
                product = product * inputs[0]
            return product
        if ufunc not in {**_ONE, **_TWO} or method != "__call__" or options:
            raise TypeError(f"{ufunc.__name__} cannot be differentiated")
        number = len(self.lines)
        words = {"r": f"t{number}"}
        for key, each in zip("ab", inputs, strict=False):
            traced = isinstance(each, Traced)
            words |= {key: each.value if traced else repr(float(each)), f"d{key}": each.slope if traced else _ZERO}
        if ufunc in _ONE:
            value, slope = _ONE[ufunc]
            changes = words["da"] != _ZERO
        else:
            value, both, first, second = _TWO[ufunc]
            slope = first if words["db"] == _ZERO else second if words["da"] == _ZERO else both
            changes = words["da"] != _ZERO or words["db"] != _ZERO
        line = f"t{number} = {value.format(**words)}"
        self.lines.append(f"{line}; d{number} = {slope.format(**words)}" if changes else line)
        return Traced(self.lines, f"t{number}", f"d{number}" if changes else _ZERO)

    def __bool__(self) -> bool:
        raise TypeError("a branch cannot be differentiated")


def make_extended(model: Model):
    """Inline (z, constants) -> (slopes, (0.0, 0.0, 1.0, 1.0)) for z = (states, direction), as a right-hand side.

    The slopes are those of the states, and their derivative in the direction.

    Raises
    ------
    TypeError
        if the right-hand side of the model is not plain arithmetic.
    """
    lines: list[str] = []
    n = len(model.states)
    states = tuple(Traced(lines, f"z[{i}]", f"z[{n + i}]") for i in range(n))
    constants = model.constants(*(Traced(lines, f"p.{name}", _ZERO) for name in model.constants._fields))
    slopes, _ = model.rhs(states, constants)
    parts = [(each.value, each.slope) if isinstance(each, Traced) else (repr(float(each)), _ZERO) for each in slopes]
    result = tuple_of(part[i] for i in (0, 1) for part in parts)
    lines.append(f"return {result}, (0.0, 0.0, 1.0, 1.0)")
    # The source of a constant may be one of the latter two.
    return compile_inline("extended", "z, p", lines, {"np": np, "inf": np.inf, "nan": np.nan})


def undifferentiable(model: Model) -> str:
    """Why the right-hand side of a model cannot be differentiated; "" if it can."""
    try:
        make_extended(model)
    except (TypeError, AttributeError) as error:
        return str(error)
    return ""
