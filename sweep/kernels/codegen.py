"""Generate source: straight-line code on scalars, under file names that tracebacks and debuggers can find.

A loop over states would need arrays, and arrays inside the loop over lanes prevent LLVM from vectorising across
trajectories.  So everything that depends on the number of states, or on a list of functions, is written out.
`python -m sweep.kernels.source METHOD MODEL` prints the source generated for a kernel, and what each function in it
is bound to.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from inspect import signature
from typing import Any

from sweep.faults import CompileError
from sweep.jit import inline
from sweep.kernels.layout import STABLE, Layout, constants_of
from sweep.kernels.status import DIVERGED, LIFT_OFF, PARADOX
from sweep.models.generated import compile_inline, tuple_of
from sweep.models.model import Model


def make_load(names: Sequence[str], layout: Layout, record=None):
    """Compiled (group, lane) -> the quantities `names` of one lane, as a tuple or as the `NamedTuple` `record`."""
    return make_gather("group, lane", (f"group[{layout.at(name)} + lane]" for name in names), record)


def make_gather(arguments: str, places: Iterable[str], record=None):
    """Compiled (arguments) -> the values of the expressions `places`, as a tuple or as the `NamedTuple` `record`."""
    made = f"{'record' if record else ''}{tuple_of(places)}"
    return compile_inline("load", arguments, [f"return {made}"], {"record": record})


def make_scatter(arguments: str, places: Iterable[str]):
    """Compiled (arguments, values) -> None: sets the expressions `places`."""
    lines = [f"{place} = values[{i}]" for i, place in enumerate(places)]
    return compile_inline("store", f"{arguments}, values", lines, {})


def make_store(names: Sequence[str], layout: Layout):
    """Compiled (group, lane, keep, new, old) -> None: sets the quantities `names` to `new` if `keep`, else to `old`."""
    lines = [f"group[{layout.at(name)} + lane] = new[{i}] if keep else old[{i}]" for i, name in enumerate(names)]
    return compile_inline("store", "group, lane, keep, new, old", lines, {})


@cache  # so that each is compiled once
def make_access(model: Model, layout: Layout, states: tuple[str, ...] = ()):
    """Make the functions that begin and end a loop over lanes: load the states, load the constants, store the states.

    See `make_load` and `make_store`; `states` replace those of the model.
    """
    states = states or model.states
    load_constants = make_load(constants_of(model), layout, model.constants)
    return make_load(states, layout), load_constants, make_store(states, layout)


def make_accept(model: Model, layout: Layout):
    """Inline (group, lane, status, active, y, new, sound, airborne, jammed) -> accepted: keeps the states of a step.

    A lane that is not `active` keeps its states and status.  After a step that is not `sound` an active lane keeps its
    states, and its status gives the reason: the normal force (`airborne`) or the Painlevé denominator (`jammed`) is not
    positive; otherwise the step diverged.
    """
    (_, _, store), STATUS = make_access(model, layout), layout.at("status")

    @inline
    def accept(group, lane, status, active, y, new, sound, airborne, jammed):
        accepted = active & sound
        store(group, lane, accepted, new, y)
        failure = PARADOX if jammed else (LIFT_OFF if airborne else DIVERGED)
        group[STATUS + lane] = failure if active & (not sound) else status
        return accepted

    return accept


def make_stays(layout: Layout, beyond: float = 1.0):
    """Inline (group, lane, lowest, highest) -> whether all spins in between lie in one range in which a rattle decays.

    The range about zero is widened by the factor `beyond`.
    """
    FROM, TO, BELOW_FROM, BELOW_TO, ABOVE_FROM, ABOVE_TO = map(layout.at, STABLE[:6])

    @inline
    def stays(group, lane, lowest, highest):
        about_zero = (lowest > beyond * group[FROM + lane]) & (highest < beyond * group[TO + lane])
        below = (lowest > group[BELOW_FROM + lane]) & (highest < group[BELOW_TO + lane])
        return about_zero | below | ((lowest > group[ABOVE_FROM + lane]) & (highest < group[ABOVE_TO + lane]))

    return stays


def make_rest(n_states: int, spin_state: int):
    """Compiled (states) -> states with the same spin and no rattle."""
    rest = tuple_of(f"y[{i}]" if i == spin_state else "0.0" for i in range(n_states))
    return compile_inline("rest", "y", [f"return {rest}"], {})


def call_all(name: str, arguments: str, functions: Sequence[Any]):
    """Compiled (arguments) -> None: calls each of `functions`; if there is none, it adds no instruction."""
    calls, names = _calls(arguments, functions)
    return compile_inline(name, arguments, calls or ["pass"], names)


def all_true(name: str, arguments: str, functions: Sequence[Any]):
    """Compiled (arguments) -> bool: whether each of `functions` is true; True if there is none."""
    return _joined(name, arguments, functions, " & ", "True")


def any_true(name: str, arguments: str, functions: Sequence[Any]):
    """Compiled (arguments) -> bool: whether one of `functions` is true; False if there is none."""
    return _joined(name, arguments, functions, " | ", "False")


def _joined(name: str, arguments: str, functions: Sequence[Any], operator: str, without: str):
    calls, names = _calls(arguments, functions)
    return compile_inline(name, arguments, [f"return {operator.join(calls) or without}"], names)


def _calls(arguments: str, functions: Sequence[Any]) -> tuple[list[str], dict[str, Any]]:
    """Return a call of each function, and the functions by the names that the calls have for them.

    Raises
    ------
    CompileError
        if a function does not take these arguments; Numba would say so only after seconds, without its line.
    """
    for function in functions:
        try:
            signature(function).bind(*arguments.split(", "))
        except TypeError as error:
            taken, code = f"{function.__name__}{signature(function)}", function.__code__
            reason = f"{taken} is called with ({arguments}): {error}"
            raise CompileError([(code.co_filename, code.co_firstlineno)], reason) from None
    return [f"f{i}({arguments})" for i in range(len(functions))], {f"f{i}": each for i, each in enumerate(functions)}
