"""Check a user's model: its declarations, and the results of its functions for some cells.

Only faults that would silently give wrong numbers, or an error far from its cause, are checked.  Errors in the code
itself are left to Python, which reports their line (`sweep.models.user.blame`).
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Any

import numpy as np

from sweep.faults import fault_of
from sweep.models.general.laws import LAWS, Law
from sweep.models.model import OWN, Columns, Model, Offer, never_rocks, never_upright
from sweep.models.origin import Origin
from sweep.models.theory.linear import fastest_motion
from sweep.models.theory.stability import stable_ranges
from sweep.models.user.blame import blamed
from sweep.models.variants import SlipWith
from sweep.parameters import PARAMETERS, Parameter
from sweep.units import is_of_paper

_OFFERS = Offer.COUNT, Offer.SPIN, Offer.ENERGY, Offer.LINEAR

Faults = Iterator[tuple[Any, str]]
"""The function at fault, or None, and a sentence on what is wrong and what to do."""


def check(made, origin: Origin) -> None:
    """Raise an `InputError` for the first fault of the MODEL that a file defines."""
    _refuse(_declared(made), origin)


def try_out(model: Model, columns: Columns, law: Law | None = None) -> None:
    """Call the functions of a user's model for some cells.

    Parameters
    ----------
    columns : physical parameters by name, each of shape (cells,)
    law : the law of friction, if the user has defined no more than that

    Raises
    ------
    InputError
        if one of them returns anything but what it should.
    """
    assert model.origin
    with np.errstate(all="ignore"), blamed(model.origin, always=True):
        _refuse(_values(model, columns), model.origin)
        _refuse(_settling_too_early(model, columns, law), model.origin)


def _refuse(faults: Faults, origin: Origin) -> None:
    for function, message in faults:
        code = getattr(function, "__code__", None)
        line = code.co_firstlineno if code and code.co_filename == origin.place else None
        raise fault_of(message, file=origin.place, line=line)


def _declared(made) -> Faults:
    from sweep.models import TIERS

    if isinstance(made, SlipWith) and isinstance(made.law, Law):
        yield from _names(made.law.name, LAWS, made.own_parameters, made.law.parameters)
        for p in made.own_parameters:
            if p.section != "friction":
                yield None, f"parameter {p.path} is of a law of friction; give it the section 'friction'"
        return
    if not isinstance(made, Model):
        yield None, f"MODEL is of the type {type(made).__name__}; it has to be Model(…), or with_law(Law(…), …)"
    yield from _names(made.name, TIERS, made.own_parameters, made.parameters)
    if not (made.own_parameters or made.parameters):
        yield None, "the model has no parameter; give it own_parameters=(Parameter(…), …)"
    if len(set(made.states)) < len(made.states) or made.spin_state not in range(len(made.states)):
        yield None, f"the states {made.states} need distinct names, and spin_state the index of one of them"
    if unknown := made.offers - set(_OFFERS):
        names = ", ".join(each.name for each in _OFFERS)
        yield None, f"a model cannot offer {', '.join(sorted(unknown))}; it may offer {names}"
    if made.units not in ("paper", "SI", OWN):
        yield None, f"units {made.units!r} are unknown; choose paper, SI or {OWN}"
    if made.upright is never_upright and (Offer.LINEAR in made.offers or made.fastest_motion is None):
        yield None, "the length of its steps needs a bound on its motion; define upright or fastest_motion"
    if Offer.COUNT in made.offers and made.slower_period is never_rocks:
        yield None, "reversals are counted in an averaged spin; define slower_period, or do not offer COUNT"


def _names(name: str, taken: Collection[str], own: tuple[Parameter, ...], used: tuple[str, ...]) -> Faults:
    if not name.isidentifier() or name in taken:
        yield None, f"invalid model name {name!r}: use letters, digits and _, and none of {', '.join(taken)}"
    for p in own:
        if wrong := [word for word in filter(None, (p.name, p.section)) if not word.isidentifier()]:
            yield None, f"parameter {p.path}: {wrong[0]!r} is invalid; use letters, digits and _"
        if p.default is not None and not p.allows(p.default):
            yield None, f"parameter {p.path}: its default {p.default:g} is out of its bounds; it has to be {p.allowed}"
        if is_of_paper(p.long_name.rpartition(", in ")[2]):
            yield None, f"parameter {p.path}: its unit stands in long_name; give it as units, such as sweep.units.SPEED"
    known = [p.name for p in own]
    if len(set(known)) < len(known):
        yield None, f"the parameters {', '.join(known)} need distinct names"
    if unknown := [each for each in used if each not in known and each not in PARAMETERS]:
        yield (
            None,
            f"parameter {unknown[0]!r} is unknown; add a Parameter for it, or use one of {', '.join(PARAMETERS)}",
        )


def _values(model: Model, columns: Columns) -> Faults:
    cells = np.shape(next(iter(columns.values())))

    def tuples(function, name, value, length):
        if not isinstance(value, tuple) or len(value) != length:
            given = f"{len(value)} values" if isinstance(value, tuple) else type(value).__name__
            yield function, f"{name} gives {given}; it has to give a tuple of {length}"

    def one_a_cell(function, name, value):
        if np.shape(value) != cells:
            yield function, f"{name} has the shape {np.shape(value)}; it has to be {cells}, as the columns are"

    constants, start = model.constants.of(columns), model.start(columns)
    for name, value in zip(model.constants._fields, constants, strict=True):
        yield from one_a_cell(model.constants.of, f"the constant {name}", value)
    yield from tuples(model.start, "start", start, len(model.states))
    yield from one_a_cell(model.start, "the start", sum(start))
    y = tuple(np.broadcast_to(value, cells) for value in start)
    slopes, told = model.rhs(y, constants)
    yield from tuples(model.rhs, "rhs, of derivatives,", slopes, len(y))
    yield from tuples(model.rhs, "rhs, of spin, power, normal force and denominator,", told, 4)
    yield from tuples(model.energy, "energy", model.energy(y, constants), 3)
    decided = np.asarray(model.decided(y, constants))
    if decided.dtype != bool or decided.shape not in ((), cells):
        yield model.decided, "decided is neither true nor false; it has to be comparisons, joined by & and |"
    if model.upright is not never_upright:
        yield from tuples(model.upright, "upright", model.upright(np.zeros(cells)), len(y))
    for name in ("slower_period", "fastest_decay", "spin_unit", "fastest_motion"):
        if function := getattr(model, name):
            yield from one_a_cell(function, name, function(columns))
    fastest = np.asarray(fastest_motion(model, columns))
    fine = (fastest > 0) & np.isfinite(fastest) | np.isfinite(model.slower_period(columns))
    if not fine.all():
        where = model.fastest_motion or model.slower_period
        yield where, f"the fastest motion is {fastest[~fine][0]:g}, from which steps follow; it has to be a number > 0"


def _settling_too_early(model: Model, columns: Columns, law: Law | None) -> Faults:
    """Find faults that would make trajectories settle too early."""
    if law and law.linear_to is None:
        at_rest, fast = (np.asarray(law.resistance(square, model.constants.of(columns))) for square in (0.0, 1.0))
        if not np.array_equal(at_rest, fast):
            words = "the resistance depends on the slip velocity; say by linear_to up to which it is nearly constant"
            yield law.resistance, words
    if not law and Offer.LINEAR in model.offers:
        try:
            stable_ranges(model, columns)
        except ValueError as error:
            yield model.rhs, f"{error}, so that nothing settles by its theory; do not offer LINEAR"
