"""Follow the slow equations: to count reversals from the start, and to find how a rattle that is left alone ends."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from sweep.jit import Cached, serial
from sweep.models.generated import compile_inline, tuple_of
from sweep.models.model import Array, Columns, Model, stack, take
from sweep.models.slow.exchange import TERMS, Body, coefficients, make_exchange
from sweep.models.slow.follow import FOUND, compiled_follow
from sweep.models.stiff.modes import RATTLE, rocks
from sweep.models.stiff.slip import form_of
from sweep.models.theory.modes import Modes, modes_at

# The fastest spin within reach, in units of the spin that has all the energy.
_REACH = 1.02

# Factors of terms of higher order, of a couple, of the changes in a step, and of the start spin.  The first row gives
# the count.  It is sure if the next two leave it as it is, and with a couple the others as well: for 1/d the spin
# lingers above the critical one, and a tiny mode grows or does not.  The couple and the steps vary one at a time, since
# together their effects may cancel.  With a couple, a mode that fell far and may have grown back too early makes a
# count unsure as well; without one this would cost 475 of 3321 sure counts of `mu_b`, and remove none of the two false
# ones.  Twice the changes in a step take half the time.
_FACTORS = np.array([
    (1, 1, 1, 1),
    (0.7, 1, 2, 1.03),
    (1.4, 1, 2, 0.97),
    (1, 1, 2, 1),
    (1, 0.5, 1, 1),
    (1, 2, 1, 1),
])  # fmt: skip
_WITHOUT_COUPLE = 3
"""The number of rows that are used without a couple."""

# The same for the spin that remains, whose error is quadratic in the changes in a step: with half of them it is 7e-5
# (median of settled cells of `mu_b`), with this share 1.5e-5, and both take about as long.
_FINELY = np.array([1, 1, 0.15, 1])

# A faster mode that turns three times as fast as the slower one, or 5, 7 or 9 times, is driven by its harmonics, which
# the equations leave out: of 44 random cells that were sure although the ratio exceeds 3.9, six were false. The ratio
# has to lie below 3 by this share.
_BELOW_THREE = 0.3


class Estimate(NamedTuple):
    """Counts by the slow equations; arrays of shape (cells,)."""

    reversals: Array
    """The number of reversals; 0 where there are no two rocking modes."""
    sure: Array
    """Whether it stays the same if higher orders and the start spin change, and the modes are as assumed."""


class Ending(NamedTuple):
    """How trajectories end; arrays of shape (cells,), NaN where the slow equations do not apply."""

    spin: Array
    """The spin that remains, in sqrt(g/c); with a couple, the spin when it can no longer reverse."""
    reversals: Array
    """Number of reversals until then."""
    overshoot: Array
    """Largest |spin| since the last reversal, or since the beginning."""
    nearest_approach: Array
    """Smallest |spin| after that.  With a couple, which damps all spins, it is the smallest share that |spin| has in
    the sum of |spin| and of what both modes can still do to it, times the fastest spin within reach."""


def estimate(model: Model, columns: Columns, *, check: bool = True) -> Estimate:
    """Count the reversals of trajectories by the slow equations of `model`, which has two rocking modes (`ENDING`).

    Without `check`, no count is sure, and it takes seven tenths of the time, or less with a couple.
    """
    size = len(next(iter(columns.values())))
    result = Estimate(np.zeros(size, np.int16), np.zeros(size, bool))
    possible = np.flatnonzero(~model.impossible(columns))
    theirs = {name: values[possible] for name, values in columns.items()}
    cells = _prepared(model, stack(model.start(theirs)), model.constants.of(theirs))
    found, sound = _follow(cells, np.arange(len(cells.which)), _FACTORS[0])
    damped = cells.starts[:, 5] > 0
    counts, sure = found[:, 1], sound & cells.converged & cells.apart & check & ~(damped & (found[:, -1] > 0))
    for k, factors in enumerate(_FACTORS[1:], 1):
        some = np.flatnonzero(sure & ((k < _WITHOUT_COUPLE) | damped))
        sure[some] = _follow(cells, some, factors)[0][some, 1] == counts[some]
    result.reversals[possible[cells.which]], result.sure[possible[cells.which]] = counts, sure
    return result


def ending(model: Model, states: Array, constants: Any) -> Ending:
    """Find how the rattles of trajectories of `model` end, from their states, of shape (states, cells)."""
    result = Ending(*np.full((4, states.shape[1]), np.nan))
    cells = _prepared(model, states, constants)
    found, sound = _follow(cells, np.arange(len(cells.which)), _FINELY)
    found[~(sound & cells.converged)] = np.nan
    for i, whole in enumerate(result):
        whole[cells.which] = found[:, i] * (1 if i == 1 else cells.reach)
    return result


class _Cells(NamedTuple):
    """Cells to which the slow equations apply; arrays over these."""

    which: Array
    """Their indices."""
    reach: Array
    """The fastest spin within reach, in sqrt(g/c)."""
    tables: Array
    """Coefficients, shape (cells, 5, TERMS)."""
    starts: Array
    """As `make_follow` takes them, shape (cells, 8)."""
    converged: Array
    """Whether the modes were found at all spins."""
    apart: Array
    """Whether the modes are as assumed: slip decays fast, and no harmonic of the slower mode meets the faster one."""


def _prepared(model: Model, states: Array, p: Any) -> _Cells:
    """Prepare to follow trajectories from states of `model`."""
    spin, rattle, inertia = model.energy(tuple(states), p)
    reach = _REACH * np.sqrt(spin**2 + 2 * rattle / inertia)
    modes, body = _modes_at_rest(model, p)
    some = np.flatnonzero(rocks(form_of(model), modes)[body] & np.isfinite(reach) & (reach > 0))
    some = some[np.argsort(-reach[some])]  # the longest runs begin first, so that fewer lanes are idle at the end
    p, states, reach, rates = take(p, some), states[:, some], reach[some], modes.rates[body[some]]
    E = reach[:, None, None] * modes.of_unit_energy()[body[some]]
    rows = np.concatenate([stack((*p, -states[model.spin_state] / reach, reach)), states[list(RATTLE)]])
    sums, starts = np.empty((len(some), 6, TERMS), complex), np.empty((len(some), 8))
    converged = np.empty(len(some), bool)
    compiled_exchange(model)(np.ascontiguousarray(rows.T), E, np.linalg.inv(E), sums, starts, converged)
    tables, starts[:, 6:] = coefficients(sums)
    slower, faster = rates[:, :2].imag.T
    # Slip that decays more slowly than the faster mode turns acts on its own.
    apart = (3 * slower > (1 + _BELOW_THREE) * faster) & (rates[:, 4:].real < -faster[:, None]).all(axis=1)
    return _Cells(some, reach, tables, starts, converged, apart)


def _follow(cells: _Cells, some: Array, factors: Array) -> tuple[Array, Array]:
    """Follow `some` of the cells; return what `make_follow` finds, over all cells."""
    found, sound = np.empty((len(cells.which), len(FOUND))), np.empty(len(cells.which), bool)
    compiled_follow()(cells.tables, cells.starts, some, factors, found, sound)
    return found, sound


def _modes_at_rest(model: Model, p: Any) -> tuple[Modes, Array]:
    """Return the modes at rest, found once for consecutive cells of a body, and the index of each cell's body."""
    constants = stack(p)
    new = np.ones(constants.shape[1], bool)
    new[1:] = (constants[:, 1:] != constants[:, :-1]).any(axis=0)
    theirs = take(p, np.flatnonzero(new))
    return modes_at(model, theirs, np.zeros_like(theirs[0])), np.cumsum(new) - 1


@cache
def compiled_exchange(model: Model) -> Cached:
    """Compiled (rows, E, E⁻¹, sums, starts, converged) -> None: finds the terms of each cell, and where it starts.

    A row has the constants, the spin, the reach and the rattle; `converged` is as of `make_exchange`.
    """
    record, n = model.constants, len(model.constants._fields)
    load = compile_inline("load", "row", [f"return Of{tuple_of(f'row[{i}]' for i in range(n))}"], {"Of": record})
    exchange, begin = make_exchange(model)

    def run(rows, E, inverse, sums, starts, converged):
        for i in range(len(rows)):
            body = Body(load(rows[i]), rows[i, n + 1])
            d, at_nodes = exchange(body, E[i], inverse[i], sums[i])
            a1, a2, spin, at_start = begin(rows[i, n + 2 :], rows[i, n], body, E[i], inverse[i])
            start = (a1.real, a1.imag, a2.real, a2.imag, spin, d)
            for k in range(6):
                starts[i, k] = start[k]
            converged[i] = at_nodes and at_start

    types = "(f8[:, ::1], c16[:, :, ::1], c16[:, :, ::1], c16[:, :, ::1], f8[:, ::1], b1[::1])"
    return serial(run, types, f"exchange-{model.key}")
