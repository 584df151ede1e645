"""Whether the functions of a model that a user brings give what they have to, for some cells of its configuration."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from sweep.models.general.laws import Law
from sweep.models.model import LINEAR, Array, Columns, Model, never_upright
from sweep.models.origin import ModelError
from sweep.models.theory.linear import fastest_motion
from sweep.models.theory.stability import stable_ranges
from sweep.models.user.checks import Faults, line_of


def try_out(model: Model, columns: Columns, law: Law | None = None) -> None:
    """Call the functions of a user's model for some cells.

    Parameters
    ----------
    columns : physical parameters by name, each of shape (cells,)
    law : the law of friction, if that is all that the user brings

    Raises
    ------
    ModelError
        if one of them gives something else than it has to.
    """
    assert model.origin
    with np.errstate(all="ignore"):
        for function, message in _wrong_values(model, columns, len(next(iter(columns.values())))):
            raise ModelError(model.origin.place, line_of(function, model.origin), message)
        for function, message in _wrong_theory(model, columns, law):
            raise ModelError(model.origin.place, line_of(function, model.origin), message)


def _wrong_theory(model: Model, columns: Columns, law: Law | None) -> Faults:
    """What would make trajectories settle that have not."""
    if law and law.linear_to is None:
        at_rest, fast = (np.asarray(law.resistance(square, model.constants.of(columns))) for square in (0.0, 1.0))
        if not np.array_equal(at_rest, fast):
            words = "the resistance depends on the slip velocity; allowed: linear_to, up to which it is nearly constant"
            yield law.resistance, words
    if not law and LINEAR in model.offers:
        try:
            stable_ranges(model, columns)
        except ValueError as error:
            yield model.rhs, f"{error}, so that nothing settles by its theory; allowed: offers without LINEAR"


def _wrong_values(model: Model, columns: Columns, cells: int) -> Faults:
    constants, start = model.constants.of(columns), model.start(columns)
    fields = model.constants._fields
    allowed = f"; allowed: ({cells},), as the columns"
    for name, value in zip(fields, constants, strict=True):
        if np.shape(value) != (cells,):
            yield model.constants.of, f"constant {name} has the shape {np.shape(value)}{allowed}"
    yield from _tuple(model.start, "start", start, len(model.states), "a number for each state")
    if np.shape(sum(start)) != (cells,):
        yield model.start, f"start has the shape {np.shape(sum(start))}{allowed}"
    y = tuple(np.broadcast_to(value, (cells,)) for value in start)
    given = model.rhs(y, constants)
    yield from _tuple(model.rhs, "rhs", given, 2, "(derivatives, (spin, power, normal force, denominator))")
    yield from _tuple(model.rhs, "rhs: derivatives", given[0], len(y), "one for each state")
    yield from _tuple(model.rhs, "rhs: its second part", given[1], 4, "(spin, power, normal force, denominator)")
    yield from _tuple(model.energy, "energy", model.energy(y, constants), 3, "(spin, energy, moment of inertia)")
    decided = model.decided(y, constants)
    kind, shape = getattr(decided, "dtype", type(decided).__name__), getattr(decided, "shape", ())
    if str(kind) != "bool" or shape not in ((), (cells,)):
        words = f"decided is of the type {kind} and the shape {shape}"
        yield model.decided, f"{words}; allowed: comparisons, joined by & and |"
    if model.upright is not never_upright:
        spin = np.zeros(cells)
        yield from _tuple(model.upright, "upright", model.upright(spin), len(y), "a number for each state")
    bounds: list[tuple[str, Callable[[Columns], Array]]] = [
        (name, getattr(model, name)) for name in ("slower_period", "fastest_decay", "spin_unit")
    ]
    bounds += [("fastest_motion", model.fastest_motion)] if model.fastest_motion else []
    for name, function in bounds:
        if np.shape(value := function(columns)) != (cells,):
            yield function, f"{name} has the shape {np.shape(value)}{allowed}"
    fastest = np.asarray(fastest_motion(model, columns))
    if not ((fastest > 0) & np.isfinite(fastest) | np.isfinite(model.slower_period(columns))).all():
        where = model.fastest_motion or model.slower_period
        yield where, f"the fastest motion is {fastest[0]:g}, by which steps are chosen; allowed: a number > 0"


def _tuple(function: Any, name: str, value: Any, length: int, what: str) -> Faults:
    if not isinstance(value, tuple):
        yield function, f"{name} is of the type {type(value).__name__}; allowed: a tuple, {what}"
    elif len(value) != length:
        yield function, f"{name} has {len(value)} values; allowed: {length}, {what}"
