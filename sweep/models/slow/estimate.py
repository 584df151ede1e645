"""Count reversals by the slow equations, and find out whether the counts depend on the terms that they leave out."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from sweep.jit import Cached, serial
from sweep.models.generated import compile_inline, tuple_of
from sweep.models.model import Array, Columns, Model, stack, take
from sweep.models.slow.exchange import TERMS, make_exchange
from sweep.models.slow.follow import make_follow
from sweep.models.stiff.modes import RATTLE, SLIP_DECAY
from sweep.models.stiff.slip import form_of
from sweep.models.theory.linear import jacobian

# The fastest spin within reach, in units of the spin that has all the energy.
_REACH = 1.02

# Factors of terms of higher order, of a couple, of the changes in a step, and of the start spin.  The first row gives
# the count.  It is sure if the next two leave it as it is, and with a couple the others as well: for 1/d the spin
# lingers above the critical one, and a tiny mode grows or does not.  The couple and the steps vary one at a time, since
# together their effects may cancel.  Of 5939 cells of `mu_b` 48 % are sure, two of them falsely.  Twice the changes in
# a step take half the time.
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

# A faster mode that turns three times as fast as the slower one, or 5, 7 or 9 times, is driven by its harmonics, which
# the equations leave out: of 44 random cells that were sure although the ratio exceeds 3.9, six were false. The ratio
# has to lie below 3 by this share.
_BELOW_THREE = 0.3

# Amplitude at which energies and the modes at rest are evaluated.
_SMALL = 1e-8


class Estimate(NamedTuple):
    """Counts by the slow equations; arrays of shape (cells,)."""

    reversals: Array
    """The number of reversals; 0 where there are no two rocking modes."""
    sure: Array
    """Whether it stays the same if higher orders and the start spin change, and the modes are as assumed."""


def estimate(model: Model, columns: Columns, *, check: bool = True) -> Estimate:
    """Count the reversals of trajectories by the slow equations of `model`, which has two rocking modes (`ENDING`).

    Without `check`, no count is sure, and it takes seven tenths of the time, or less with a couple.
    """
    size = len(next(iter(columns.values())))
    result = Estimate(np.zeros(size, np.int16), np.zeros(size, bool))
    possible = np.flatnonzero(~model.impossible(columns))
    if not len(possible):
        return result
    p = model.constants.of({name: values[possible] for name, values in columns.items()})
    states = stack(model.start({name: values[possible] for name, values in columns.items()}))
    spin, rattle, inertia = model.energy(tuple(states), p)
    reach = _REACH * np.sqrt(spin**2 + 2 * rattle / inertia)
    rates, E = _modes_of_bodies(model, p)
    decay = SLIP_DECAY * form_of(model).unit(p)
    sound = (rates[:, :2].imag > 0).all(axis=1) & (rates[:, 4:].real < -decay[:, None]).all(axis=1) & (reach > 0)
    some = np.flatnonzero(sound & np.isfinite(reach))
    some = some[np.argsort(-reach[some])]  # the longest runs begin first, so that fewer lanes are idle at the end
    if not len(some):
        return result
    p, states, reach = take(p, some), states[:, some], reach[some]
    E = reach[:, None, None] * _of_unit_energy(model, p, E[some])
    rows = np.concatenate([stack((*p, -states[model.spin_state] / reach, reach)), states[list(RATTLE)]])
    tables, starts = np.empty((len(some), 5, TERMS), complex), np.empty((len(some), 8))
    followed = np.empty(len(some), bool)
    compiled_exchange(model)(np.ascontiguousarray(rows.T), E, np.linalg.inv(E), tables, starts, followed)
    slower, faster = rates[some, :2].imag.T
    # Slip that decays more slowly than the faster mode turns acts on its own.
    apart = (3 * slower > (1 + _BELOW_THREE) * faster) & (rates[some, 4:].real < -faster[:, None]).all(axis=1)
    counts, sure = _counts(tables, starts, check & followed & apart)
    result.reversals[possible[some]], result.sure[possible[some]] = counts, sure
    return result


def _counts(tables: Array, starts: Array, sure: Array) -> tuple[Array, Array]:
    """Count reversals, and return whether those of the cells `sure` stay the same with all of `_FACTORS`."""
    follow, size = compiled_follow(), len(tables)
    counts, found, sound = np.empty(size), np.empty(size), np.empty(size, bool)
    follow(tables, starts, np.arange(size), _FACTORS[0], counts, sound)
    sure = sure & sound
    for k, factors in enumerate(_FACTORS[1:], 1):
        cells = np.flatnonzero(sure & ((k < _WITHOUT_COUPLE) | (starts[:, 5] > 0)))
        follow(tables, starts, cells, factors, found, sound)
        sure[cells] = found[cells] == counts[cells]
    return counts, sure


def _modes_of_bodies(model: Model, p: Any) -> tuple[Array, Array]:
    """Return rates and modes at rest of cells, which are found once for consecutive cells of a body."""
    constants = stack(p)
    new = np.append(True, (constants[:, 1:] != constants[:, :-1]).any(axis=0))
    rates, modes = _modes_at_rest(model, take(p, np.flatnonzero(new)))
    place = np.cumsum(new) - 1
    return rates[place], modes[place]


def _modes_at_rest(model: Model, p: Any) -> tuple[Array, Array]:
    """Rates and modes: the slower rocking, the faster one, their conjugates, and the decay of the slip."""
    rates, modes = np.linalg.eig(jacobian(model, p, np.zeros_like(p[0])))
    order = np.argsort(-rates.imag, axis=1)[:, [1, 0, 4, 5, 2, 3]]
    return np.take_along_axis(rates, order, axis=1), np.take_along_axis(modes, order[:, None, :], axis=2)


def _of_unit_energy(model: Model, p: Any, modes: Array) -> Array:
    """E: the modes with 2 E_k / J33 = 1 for an amplitude of 1, shape (cells, 6, 6)."""
    E, energies = modes.astype(complex), np.zeros((2, len(modes)))
    for part in (E[:, :, :2].real, E[:, :, :2].imag):
        states = np.insert(np.moveaxis(part, 0, -1) * _SMALL, 4, 0.0, axis=0)
        _, rattle, inertia = model.energy(tuple(states), p)
        energies += 4 * rattle / inertia / _SMALL**2
    E[:, :, :2] /= np.sqrt(energies).T[:, None]
    E[:, :, 2:4] = E[:, :, :2].conj()
    return np.ascontiguousarray(E)


@cache
def compiled_exchange(model: Model) -> Cached:
    """Compiled (rows, E, E⁻¹, tables, starts, followed) -> None: what `make_follow` needs of each cell.

    A row has the constants, the spin, the reach and the rattle; `followed` is as of `make_exchange`.
    """
    record, n = model.constants, len(model.constants._fields)
    load = compile_inline("load", "row", [f"return Of{tuple_of(f'row[{i}]' for i in range(n))}"], {"Of": record})
    exchange, begin = make_exchange(model)

    def run(rows, E, inverse, tables, starts, followed):
        bent = np.empty(2)
        for i in range(len(rows)):
            p, spin, reach = load(rows[i]), rows[i, n], rows[i, n + 1]
            d, at_nodes = exchange(p, reach, E[i], inverse[i], tables[i], bent)
            a1, a2, spin, at_start = begin(rows[i, n + 2 :], spin, p, reach, E[i], inverse[i])
            start = (a1.real, a1.imag, a2.real, a2.imag, spin, d, bent[0], bent[1])
            for k in range(8):
                starts[i, k] = start[k]
            followed[i] = at_nodes and at_start

    types = "(f8[:, ::1], c16[:, :, ::1], c16[:, :, ::1], c16[:, :, ::1], f8[:, ::1], b1[::1])"
    return serial(run, types, f"exchange-{model.key}")


@cache
def compiled_follow() -> Cached:
    """Compiled `make_follow`, the same for all models."""
    return serial(make_follow(), "(c16[:, :, ::1], f8[:, ::1], i8[::1], f8[::1], f8[::1], b1[::1])", "follow")
