"""Is it over? When a run may end, because its spin can reverse no more.

The kernel ends a run by the first of these rules that holds at a check (`sweep.kernels.lanes`):

1. The energy of its rattle cannot carry the spin through zero, or to where a rattle grows.
2. The model says so (`Model.decided`).
3. A rattle that rolls round and round was watched, and winds down (`sweep.kernels.measures.decay`).

The slow equations then predict the further course of the spin (`sweep.kernels.measures.resting_spin`), and with it

4. A run that has ended goes on if its spin will reverse once more (`too_early`).
5. A run at its time limit is over if its spin will reverse no more (`at_limit`).
6. A run at the end of its first leg (`stop_early`) goes on to `t_end` if its spin will reverse once more, or while its
   rattle grows or winds down. Of any other it cannot be predicted when it will be over.

Of 450 cells of `configs/mu_b.yaml` the first rule ends 401, the third 34 and the fifth 15; the fourth lets 5 go on, the
sixth 15 (scripts/LOG.md).
"""

from __future__ import annotations

import numpy as np

from sweep.engine.cells import Cells
from sweep.grid import Array
from sweep.kernels.layout import BLOCK
from sweep.kernels.measures.decay import CHECKS, EVERY, LEFT, NEXT, WOUND
from sweep.kernels.measures.resting_spin import endings
from sweep.kernels.status import SETTLED, TIME_LIMIT
from sweep.models.general import rigid_body, starts
from sweep.models.model import Offer
from sweep.models.slow.estimate import Ending
from sweep.models.stiff.modes import bending
from sweep.models.theory import linear, modes
from sweep.models.theory.rocking import frequencies

# Safety factor on the change of the spin at the present rates, where the slow equations do not hold.
_REACH = 4.0

# Least error of the slow equations in spin, relative to the fastest spin that the energy allows, and its ratio to the
# neglected terms. Of 576 cells of `configs/mu_b.yaml` at n0 = 0.05, stopped at t = 5000 and at 30 000, none that was
# ended this way had another count at t = 10⁶.
_LEAST, _NEGLECTED = 0.02, 3.0

# Above this relative error, the slow equations predict nothing.
_LARGEST = 0.2

# Length of a window in which a rattle that rolls round is watched, as a share of the first leg.
_WINDOW = 0.1

# A run goes on if its rattle will have wound down within this multiple of the time that is left: by then the course of
# the spin shows how it ends.
_WINDS_DOWN = 10.0

# A rattle rolls round if the body turns by more than one radian while its two modes gain half a radian on each other.
_ROLLS = 0.5


def predicted(cells: Cells, *, at_limit: bool) -> Ending:
    """Predict how the runs that have settled end, and those `at_limit`; arrays of shape (cells,), NaN for others."""
    return endings(cells.table, (cells.status == SETTLED) | (at_limit & _late(cells)))


def too_early(cells: Cells, left: Ending) -> Array:
    """Return which cells have settled although their spin may reverse once more, shape (cells,).

    The bound of the kernel fails if a strong rattle hardly decays and keeps turning the spin, and if friction is too
    weak to stop the slip. Where the slow equations do not hold, the spin must keep its sign, and the rattle decay, even
    at `_REACH` times the present rate of change; unless it rolls round, and was watched.
    """
    settled = cells.status == SETTLED
    if Offer.ENDING not in cells.kernel.model.offers or not settled.any():
        return np.zeros(len(settled), bool)
    wound = cells.recorded(WOUND) > 0
    early, unknown = settled & (left.reversals > 0), np.flatnonzero(settled & np.isnan(left.reversals) & ~wound)
    early[wound] &= _error(cells)[0][wound] < _LARGEST
    if len(unknown):
        early[unknown] = ~_stays(cells.take(unknown))
    return np.asarray(early)


def _stays(cells: Cells) -> Array:
    """Return where the spin keeps its sign and the rattle decays even at `_REACH` times the predicted change."""
    model, constants, states = cells.model, cells.kernel.unpack(cells.rows)[1], cells.kernel.model_states(cells.rows)
    spin, _, _ = model.energy(tuple(states), constants)
    farthest = spin + _REACH * (modes.resting_spin(model, constants, states) - spin)
    known = np.isfinite(farthest)
    growth = linear.growth_rate(model, constants, np.where(known, farthest, spin))
    return np.asarray(known & (spin * farthest > 0) & (growth < 0))


def at_limit(cells: Cells, left: Ending) -> tuple[Array, Array]:
    """Return which cells at their time limit will reverse no more, and which to go on with to a later one, (cells,)."""
    late = _late(cells)
    if not late.any():
        return late, late
    error, fastest = _error(cells)
    sure = (left.reversals == 0) & (left.nearest_approach > error * fastest)
    reverses = ~sure & np.isfinite(left.reversals) & (error < _LARGEST)
    final = late & ~reverses & (sure | (cells.recorded(WOUND) > 0))
    return final, late & ~final & (reverses | _winds_down(cells))


def _winds_down(cells: Cells) -> Array:
    """Return whose rattle still grows, or will have wound down in time, shape (cells,)."""
    first, t_end, windows = cells.rules.first_leg or 0.0, cells.rules.t_end, cells.recorded(LEFT)
    return np.asarray((windows != 0) & (windows * _WINDOW * first < _WINDS_DOWN * (t_end - first)))


def _late(cells: Cells) -> Array:
    """Return which cells have reached their time limit and can be shown to have settled, shape (cells,)."""
    known = Offer.ENDING in cells.kernel.model.offers and "reversals" in cells.kernel.measure
    return np.asarray((cells.status == TIME_LIMIT) & known)


def _error(cells: Cells) -> tuple[Array, Array]:
    """Return the relative error of the slow equations, and the fastest spin that the energy allows, (cells,)."""
    fastest = np.sqrt(2 * np.maximum(cells.table["energy"], 0) / cells.inertia)
    return np.maximum(_NEGLECTED * bending(cells.model, cells.columns) * fastest**2, _LEAST), fastest


def whole_blocks(steps: Array) -> Array:
    """Return the steps, rounded up: adams continues only from the end of a block, where its history is complete."""
    return np.asarray(BLOCK * np.ceil(steps / BLOCK))


def first_goal(cells: Cells) -> Array | float:
    """Return the number of steps of the first leg of cells at t = 0, which are to be watched, in place.

    A rattle is watched from the start if it rolls round, or in the last window.
    """
    table, first, surface = cells.table, cells.rules.first_leg, cells.model.variant and cells.model.variant.surface
    if first is None:
        return np.inf
    goal = whole_blocks(first / table["step"])
    if cells.rules.settles and NEXT in table.layout:
        slower, faster = frequencies(rigid_body.rocking(cells.columns, surface))
        rolls = faster - slower < _ROLLS * np.abs(starts.spin(cells.columns, surface))
        table[EVERY] = every = whole_blocks(_WINDOW * first / (CHECKS * table["step"]))
        last = goal - CHECKS * every
        table[NEXT] = np.where(rolls, 0.0, np.where(last < 0, np.inf, last))
    return goal
