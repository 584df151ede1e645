"""Load users' models from a Python file.

Loading a model runs its code, so nothing here may be called with a name that the user has not given.
"""

from __future__ import annotations

import linecache
import sys
from dataclasses import replace
from functools import cache
from types import ModuleType

from sweep.faults import fault_of
from sweep.models import variants
from sweep.models.general.laws import Law
from sweep.models.model import Model
from sweep.models.origin import Origin
from sweep.models.user import trial
from sweep.models.user.blame import blamed
from sweep.models.variants import Physics, SlipWith
from sweep.parameters import PARAMETERS, Parameter


@cache
def load(origin: Origin) -> Model | SlipWith:
    """Run the code of a file, once in a process, and return the model that it defines.

    Raises
    ------
    InputError
        if the code cannot be run, or does not define a model.
    """
    made: Model | SlipWith
    with blamed(origin):
        made = _file(origin)
        trial.check(made, origin)
    if isinstance(made, SlipWith):
        return replace(made, origin=origin)
    # In a state row, states stand next to other quantities, so their names could clash.
    states = tuple(f"state.{name}" for name in made.states)
    parameters = (*(p.name for p in made.own_parameters), *made.parameters)
    return replace(made, origin=origin, states=states, parameters=parameters)


def _file(origin: Origin):
    module = ModuleType(f"sweep_model_{origin.digest[:16]}")
    module.__file__ = origin.place
    sys.modules[module.__name__] = module
    # Messages quote the text that runs, even if the file has changed since.
    linecache.cache[origin.place] = (len(origin.text), None, origin.text.splitlines(keepends=True), origin.place)
    try:
        code = compile(origin.text, origin.place, "exec")
    except (SyntaxError, ValueError) as error:
        line = getattr(error, "lineno", None)
        raise fault_of(f"not Python: {error.args[0]}", file=origin.place, line=line) from None
    try:
        exec(code, module.__dict__)
    except SystemExit as error:
        raise RuntimeError("it ends the program") from error
    return getattr(module, "MODEL", None)


def table(origin: Origin | None) -> dict[str, Parameter]:
    """The parameters that a configuration may name: those of a user's model or, without one, those of the package's
    models."""
    if origin is None:
        return PARAMETERS
    made = load(origin)
    own = {p.name: p for p in made.own_parameters}
    if isinstance(made, SlipWith):
        return {**PARAMETERS, **own}
    return {name: own.get(name) or PARAMETERS[name] for name in made.parameters}


def law(origin: Origin) -> Law | None:
    """The law of friction that a file defines for `slip`; None if it defines a complete model."""
    made = load(origin)
    return made.law if isinstance(made, SlipWith) else None


def find(origin: Origin, physics: Physics) -> Model:
    """The user's model, or the model for this physics with the user's law of friction."""
    made = load(origin)
    if isinstance(made, Model):
        return made
    return replace(physics.variant("slip"), origin=origin, own_parameters=made.own_parameters)


def compiled_as(origin: Origin, name: str) -> Model:
    """The model whose compiled code is stored under the key "name@digest"."""
    made = load(origin)
    return made if isinstance(made, Model) else replace(variants.variant(name, made.law), origin=origin)
