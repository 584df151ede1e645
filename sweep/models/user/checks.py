"""Whether what a user brings is a model: checked before anything is computed, so that a fault names its line."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from inspect import signature
from typing import Any

from sweep.models.general.laws import LAWS, Law
from sweep.models.general.variants import SlipWith
from sweep.models.model import COUNT, ENERGY, LINEAR, OWN, SPIN, Model, never_rocks, never_upright
from sweep.models.origin import ModelError, Origin
from sweep.parameters import PARAMETERS, Parameter

_OFFERS = {COUNT: "COUNT", SPIN: "SPIN", ENERGY: "ENERGY", LINEAR: "LINEAR"}

_TAKEN = frozenset({
    "name", "model", "model_sha256", "units", "cases", "integrator", "measure", "verify", "refine",
    "max_failed_fraction", "method", "step", "tolerance", "t_end", "stop_when_settled", "case", "trajectory", "time",
    "every", "reporter", "progress", "config", "output", "fresh", "rerun", "cluster",
})  # fmt: skip
"""Names that mean something else in a configuration, as an argument or as a dimension."""


def inspect(made: Any, origin: Origin) -> None:
    """Raise a `ModelError` for the first thing that is wrong with `made`, the MODEL of a file or an entry point."""
    for function, message in _faults(made):
        raise ModelError(origin.place, line_of(function, origin), message)


def line_of(function: Any, origin: Origin) -> int | None:
    """The line of a function of the file, or else that of MODEL."""
    code = getattr(function, "__code__", None)
    if code and code.co_filename == origin.place:
        return int(code.co_firstlineno)
    assigned = [
        node.lineno
        for node in (ast.parse(origin.text).body if origin.is_file else ())
        if isinstance(node, ast.Assign | ast.AnnAssign)
        for target in (node.targets if isinstance(node, ast.Assign) else [node.target])
        if isinstance(target, ast.Name) and target.id == "MODEL"
    ]
    return assigned[-1] if assigned else None


Faults = Iterator[tuple[Any, str]]
"""The function at fault, None if it is MODEL itself, and what is wrong."""


def _faults(made: Any) -> Faults:
    if made is None:
        yield None, "defines no MODEL; allowed: MODEL = Model(…), or MODEL = with_law(…)"
    elif isinstance(made, SlipWith):
        yield from _law_faults(made)
    elif isinstance(made, Model):
        yield from _model_faults(made)
    else:
        yield None, f"MODEL is of the type {type(made).__name__}; allowed: Model(…), or with_law(…)"


def _law_faults(made: SlipWith) -> Faults:
    law: Any = made.law
    if not isinstance(law, Law):
        yield None, f"with_law of the type {type(law).__name__}; allowed: with_law(Law(…), Parameter(…), …)"
        return
    yield from _name_faults(law.name, tuple(LAWS))
    yield from _parameter_faults(made.own_parameters, law.parameters, "friction")
    yield from _arity(law.resistance, "resistance", "square", "p")
    yield from _arity(law.strongest, "strongest", "columns")
    if law.linear_to:
        yield from _arity(law.linear_to, "linear_to", "columns")


def _model_faults(made: Model) -> Faults:
    from sweep.models import TIERS

    yield from _name_faults(made.name, tuple(TIERS))
    yield from _parameter_faults(made.own_parameters, made.parameters)
    if not (made.own_parameters or made.parameters):
        yield None, "no parameter; allowed: own_parameters=(Parameter(…), …)"
    if not made.states or not all(map(_is_word, made.states)) or len(set(made.states)) < len(made.states):
        yield None, f"states {made.states!r}; allowed: a tuple of distinct names"
    elif made.spin_state not in range(len(made.states)):
        yield None, f"spin_state {made.spin_state!r}; allowed: 0 to {len(made.states) - 1}, the index of a state"
    if not made.offers <= set(_OFFERS):
        yield None, f"offers {', '.join(sorted(made.offers - set(_OFFERS)))}; allowed: {', '.join(_OFFERS.values())}"
    if made.units not in ("paper", "SI", OWN):
        yield None, f"units {made.units!r}; allowed: paper, SI, {OWN}"
    if not hasattr(made.constants, "_fields") or not callable(getattr(made.constants, "of", None)):
        yield None, "constants; allowed: a NamedTuple class with a classmethod of(columns)"
    if made.upright is never_upright and (LINEAR in made.offers or made.fastest_motion is None):
        yield None, "neither upright nor fastest_motion, of which steps are made; allowed: one of the two"
    if COUNT in made.offers and made.slower_period is never_rocks:
        yield None, "no slower_period, over which the spin is averaged to count reversals; allowed: one, or no COUNT"
    for name in ("rhs", "energy"):
        yield from _arity(getattr(made, name), name, "states", "constants")
    for name in ("start", "slower_period", "fastest_decay", "spin_unit", "extremes"):
        yield from _arity(getattr(made, name), name, "columns")
    yield from _arity(made.tilt, "tilt", "states")
    yield from _arity(made.decided, "decided", "states", "constants")
    yield from _arity(made.observe, "observe", "states", "constants")
    if made.fastest_motion:
        yield from _arity(made.fastest_motion, "fastest_motion", "columns")


def _name_faults(name: Any, taken: tuple[str, ...]) -> Faults:
    if not _is_word(name) or name in taken:
        yield None, f"name {name!r}; allowed: letters, digits and _, and none of {', '.join(taken)}"


def _is_word(name: Any) -> bool:
    return isinstance(name, str) and name.isidentifier()


def _parameter_faults(own: Any, names: tuple[str, ...], section: str = "") -> Faults:
    for p in own:
        if not isinstance(p, Parameter):
            yield None, f"a parameter of the type {type(p).__name__}; allowed: Parameter(name, section, units, …)"
            return
        wrong = [word for word in (p.name, *filter(None, [p.section])) if not _is_word(word) or word in _TAKEN]
        if wrong:
            yield None, f"parameter {p.path}: {wrong[0]!r} is taken or no word; allowed: another name"
        if section and p.section != section:
            yield None, f"parameter {p.path}; allowed: of the section {section}"
        if p.default is not None and not p.allows(p.default):
            yield None, f"parameter {p.path}: default {p.default:g}; allowed: {p.allowed}"
    known = [p.name for p in own]
    if len(set(known)) < len(known):
        yield None, f"parameters {', '.join(known)}; allowed: each once"
    if unknown := [name for name in names if name not in known and name not in PARAMETERS]:
        yield None, f"unknown parameter {unknown[0]!r}; allowed: a Parameter of yours, or {', '.join(PARAMETERS)}"


def _arity(function: Any, name: str, *arguments: str) -> Faults:
    wanted = f"{name}({', '.join(arguments)})"
    if not callable(function):
        yield None, f"{name} is no function; allowed: {wanted}"
        return
    try:
        signature(function).bind(*arguments)
    except TypeError:
        yield function, f"{name}{signature(function)}; allowed: {wanted}"
