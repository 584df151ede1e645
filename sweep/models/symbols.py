"""Specialise the equations for a scene: whatever is zero or one there adds no instruction.

Functions of a model consist of plain arithmetic without branches (`sweep.models.model.Model`).  Called once with
symbols in place of numbers, they write down what they compute, and numbers that are known fold away: 0·x, 1·x, x + 0.
The rest becomes the source of one function.  A compiler of floating-point code cannot do that by itself, because
0·x is not zero for an infinite x.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from sweep.jit import INTERPRETED
from sweep.models.generated import compile_inline, tuple_of

_SOURCES: dict[Any, str] = {
    np.negative: "-{}",
    np.sqrt: "np.sqrt({})",
    np.absolute: "abs({})",
    np.exp: "np.exp({})",
    np.log: "np.log({})",
    np.sin: "np.sin({})",
    np.cos: "np.cos({})",
    np.tanh: "np.tanh({})",
    np.square: "{0} * {0}",
    np.add: "{} + {}",
    np.subtract: "{} - {}",
    np.multiply: "{} * {}",
    np.divide: "{} / {}",
    np.minimum: "np.minimum({}, {})",
    np.maximum: "np.maximum({}, {})",
}


_COMPARISONS = (np.less, np.less_equal, np.greater, np.greater_equal, np.equal, np.not_equal)

_BRANCH = "a trace cannot follow a branch; instead of `if`, write np.minimum or np.maximum"
_KNOWN = f"it knows whole powers and {', '.join(f'np.{ufunc.__name__}' for ufunc in _SOURCES)}"


class Trace:
    """The expressions computed so far, each once, in the order of the source."""

    def __init__(self) -> None:
        self.nodes: dict[tuple[Any, ...], Symbol] = {}
        self.names: dict[str, Any] = {"np": np}

    def node(self, template: str, *inputs: Any) -> Symbol:
        """The expression `template` of `inputs`, symbols or numbers."""
        key = (template, *(id(each) if isinstance(each, Symbol) else float(each) for each in inputs))
        return self.nodes.setdefault(key, Symbol(self, template, inputs))

    def lines(self, results: list[Any]) -> tuple[list[str], dict[int, str]]:
        """The source that computes `results`, and the names in it, by the identity of a symbol."""
        needed, stack = set[int](), [each for each in results if isinstance(each, Symbol)]
        while stack:
            each = stack.pop()
            if id(each) not in needed:
                needed.add(id(each))
                stack += [other for other in each.inputs if isinstance(other, Symbol)]
        lines, names = list[str](), dict[int, str]()
        for each in self.nodes.values():
            if id(each) in needed and each.inputs:
                source = each.template.format(*(source_of(other, names) for other in each.inputs))
                names[id(each)] = f"t{len(lines)}"
                lines.append(f"t{len(lines)} = {source}")
            else:
                names[id(each)] = each.template
        return lines, names


def source_of(each: Any, names: dict[int, str]) -> str:
    """The source of a number or of a symbol."""
    return names[id(each)] if isinstance(each, Symbol) else repr(float(each))


class Symbol(np.lib.mixins.NDArrayOperatorsMixin):
    """A number that is known only by its source."""

    def __init__(self, trace: Trace, template: str, inputs: tuple[Any, ...]) -> None:
        self.trace, self.template, self.inputs = trace, template, inputs

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        if ufunc is np.power and isinstance(inputs[1], int) and inputs[1] > 0:
            return power(*inputs)
        if ufunc not in _SOURCES or method != "__call__" or options:
            reason = _BRANCH if ufunc in _COMPARISONS else f"{ufunc.__name__} is not known to a trace"
            raise TypeError(f"{reason}; {_KNOWN}")
        known = folded(ufunc, *inputs)
        return self.trace.node(_SOURCES[ufunc], *inputs) if known is None else known

    def __bool__(self) -> bool:
        raise TypeError(f"{_BRANCH}; {_KNOWN}")


def power(base: Any, exponent: int) -> Any:
    """A power as a product."""
    product = base
    for _ in range(exponent - 1):
        product = product * base
    return product


def folded(ufunc: Any, *inputs: Any) -> Any:
    """The result of an operation that needs no computation, or None."""
    zero, one = ([not isinstance(each, Symbol) and each == number for each in inputs] for number in (0, 1))
    if ufunc is np.multiply:
        return 0.0 if any(zero) else inputs[1] if one[0] else inputs[0] if one[1] else None
    if ufunc is np.add:
        return inputs[1] if zero[0] else inputs[0] if zero[1] else None
    if ufunc is np.subtract:
        return inputs[0] if zero[1] else -inputs[1] if zero[0] else None
    if ufunc is np.divide:
        return 0.0 if zero[0] else inputs[0] if one[1] else None
    return None


def call(function: Any, name: str, values: int, *inputs: Any) -> Any:
    """`function` of symbols and the constants p, as one expression that is not traced further.

    `values` is the number of values in the tuple that it returns, 0 if it returns a single number.
    """
    trace = next(each.trace for each in inputs if isinstance(each, Symbol))
    trace.names[name] = function
    result = trace.node(f"{name}({', '.join('{}' for _ in inputs)}, p)", *inputs)
    return tuple(trace.node(f"{{}}[{i}]", result) for i in range(values)) if values else result


@dataclass(frozen=True)
class Constants:
    """The argument p: constants by name, and those that are `known`."""

    names: tuple[str, ...]
    known: Mapping[str, float]

    def __call__(self, trace: Trace) -> SimpleNamespace:
        return self.of(trace.node(f"p.{name}") for name in self.names)

    def of(self, values: Iterable[Any]) -> SimpleNamespace:
        """All constants; those in `names` have these values."""
        return SimpleNamespace(**self.known, **dict(zip(self.names, values, strict=True)))


def specialised(function: Callable[..., Any], **arguments: Any):
    """Write `function` as straight-line source, inline.

    Parameters
    ----------
    arguments : for each argument of `function` in their order: None for a number, a count for a tuple of numbers, a
        `NamedTuple` class for one of those, and `Constants` for p, which comes last if there is one

    If compilation by Numba is disabled, call `function` itself, in which a debugger can stop.  Either way a tuple of
    another length is an error.
    """
    if INTERPRETED:
        return _interpreted(function, arguments)
    trace = Trace()
    result = function(*(_argument(trace, name, kind) for name, kind in arguments.items()))
    flat: list[Any] = []
    _flatten(result, flat)
    lines, names = trace.lines(flat)
    counts = {name: kind for name, kind in arguments.items() if isinstance(kind, int)}
    unpacked = [f"{tuple_of(f'{name}{i}' for i in range(n))} = {name}" for name, n in counts.items()]
    lines = [*unpacked, *lines, f"return {_source(result, trace, names)}"]
    return compile_inline(function.__name__, ", ".join(arguments), lines, trace.names | {function.__name__: function})


def _interpreted(function: Callable[..., Any], kinds: Mapping[str, Any]):
    def plain(*arguments: Any) -> Any:
        taken = []
        for value, (name, kind) in zip(arguments, kinds.items(), strict=True):
            if isinstance(kind, int) and len(value) != kind:
                raise ValueError(f"{name} has {len(value)} values, not {kind}")
            known = isinstance(kind, Constants)
            taken.append(kind.of(getattr(value, each) for each in kind.names) if known else value)
        return function(*taken)

    return plain


def _argument(trace: Trace, name: str, kind: Any) -> Any:
    if kind is None:
        return trace.node(name)
    if isinstance(kind, int):
        return tuple(trace.node(f"{name}{i}") for i in range(kind))
    if isinstance(kind, type):
        return kind(*(trace.node(f"{name}.{field}") for field in kind._fields))  # type: ignore[attr-defined]
    return kind(trace)


def _flatten(value: Any, flat: list[Any]) -> None:
    if isinstance(value, tuple):
        for each in value:
            _flatten(each, flat)
    else:
        flat.append(value)


def _source(value: Any, trace: Trace, names: dict[int, str]) -> str:
    if not isinstance(value, tuple):
        return source_of(value, names)
    record = type(value).__name__ if hasattr(value, "_fields") else ""
    trace.names |= {record: type(value)} if record else {}
    return record + tuple_of(_source(each, trace, names) for each in value)
