"""Decides when a run is over: when the count is final, or when it cannot be predicted to become final.

The kernel settles a cell by a bound on what the energy of its rattle can do to the spin (`sweep.kernels.lanes`), or by
how a rattle that rolls round and round winds down (`sweep.kernels.measures.decay`). Where the bound fails, the cell
continues. A cell that has not settled at the end of the first leg (`stop_early`) continues to `t_end` only if the slow
equations predict that its spin will reverse once more, or while its rattle grows or winds down.
"""

from __future__ import annotations

import numpy as np

from sweep.engine.cells import RUN, Cells, Lives
from sweep.grid import Array
from sweep.kernels.kernel import Kernel
from sweep.kernels.layout import BLOCK
from sweep.kernels.measures.decay import CHECKS, EVERY, LEFT, NEXT, WOUND
from sweep.kernels.measures.resting_spin import endings
from sweep.kernels.status import RUNNING, SETTLED, TIME_LIMIT
from sweep.models.general import rigid_body, starts
from sweep.models.model import Model, Offer
from sweep.models.stiff.modes import bending
from sweep.models.theory import linear
from sweep.models.theory.rocking import frequencies

FIRST, LATER = range(2)
"""Legs of a run: to `Rules.first_leg`, and to `t_end`."""

# Safety factor on the change of the spin at the present rates, where the slow equations do not hold.
_REACH = 4.0

# Least error of the slow equations in spin, relative to the fastest spin that the energy allows, and its ratio to the
# neglected terms. Of 576 cells of `configs/mu_b.yaml` at n0 = 0.05, stopped at t = 5000 and at 30 000, none that was
# settled this way had another count at t = 10⁶.
_LEAST, _NEGLECTED = 0.02, 3.0

# Above this relative error, the slow equations predict nothing.
_LARGEST = 0.2

# Length of a window in which a rattle that rolls round is watched, as a share of the first leg.
_WINDOW = 0.1

# A rattle is followed if it will have wound down within this multiple of the time that is left: by then the course of
# the spin shows how it ends.
_WINDS_DOWN = 10.0

# A rattle rolls round if the body turns by more than one radian while its two modes gain half a radian on each other.
_ROLLS = 0.5


def begin(lives: Lives, which: Array, rows: Array) -> None:
    """Let `rows` at t = 0 run to their ends."""
    rules, table = lives.cells.rules, lives.cells.kernel.table(rows)
    first = np.inf if rules.first_leg is None else whole_blocks(rules.first_leg / table["step"])
    if rules.settles:
        watch(lives.take(which), rows)
    lives.note(which, ("leg", "wary"), 0)
    lives.enter(which, RUN, rows, settles=rules.settles, goal=first)


def over(lives: Lives, which: Array) -> Array:
    """Find which of the cells `which`, which have stopped, are finished; the others continue.

    Returns
    -------
    The indices of their cells.
    """
    rules, run = lives.cells.rules, lives.take(which)
    early = too_early(run, lives.notes["wary"][which] == 0)
    predicted = settle(run, ~early & rules.settles)
    first = (lives.notes["leg"][which] == FIRST) & ~early & (rules.settles and rules.first_leg is not None)
    later = first & _late(run) & (predicted | winds_down(run))
    lives.cells.rows[which] = run.rows
    _go_on(lives, which[early], settles=False)
    _go_on(lives, which[later], settles=True)
    return np.asarray(which[~early & ~later])


def _go_on(lives: Lives, which: Array, *, settles: bool) -> None:
    """Let the cells `which` run on, to `t_end` if they may settle, and otherwise on the same leg without settling."""
    table = lives.table(which)
    table["status"], table["settles"] = RUNNING, settles
    lives.notes["wary"][which] = not settles
    if settles:
        table["goal"], lives.notes["leg"][which] = table["steps"], LATER
    lives.cells.rows[which] = table.rows


def too_early(cells: Cells, which: Array | bool = True) -> Array:
    """Return which cells of a mask have settled although their spin may reverse once more, shape (cells,).

    The bound of the kernel fails if a strong rattle hardly decays and keeps turning the spin, and if friction is too
    weak to stop the slip. The slow equations then predict the further course. Where they do not hold, the spin must
    keep its sign, and the rattle decay, even at `_REACH` times the present rate of change; unless it rolls round, and
    was watched.
    """
    settled = which & (cells.status == SETTLED)
    if Offer.ENDING not in cells.kernel.model.offers or not settled.any():
        return np.zeros(len(settled), bool)
    table = cells.kernel.table(cells.rows)
    left = endings(table, settled).reversals
    wound = cells.recorded(WOUND) > 0
    early, unknown = left > 0, np.flatnonzero(settled & np.isnan(left) & ~wound)
    early[wound] &= _error(cells)[0][wound] < _LARGEST
    if len(unknown):
        early[unknown] = ~_stays(cells.model, cells.kernel, cells.rows[unknown])
    return np.asarray(early)


def _stays(model: Model, kernel: Kernel, rows: Array) -> Array:
    """Return where the spin keeps its sign and the rattle decays even at `_REACH` times the predicted change."""
    constants = kernel.unpack(rows)[1]
    states = kernel.model_states(rows)
    spin, _, _ = model.energy(tuple(states), constants)
    farthest = spin + _REACH * (linear.resting_spin(model, constants, states) - spin)
    known = np.isfinite(farthest)
    growth = linear.growth_rate(model, constants, np.where(known, farthest, spin))
    return np.asarray(known & (spin * farthest > 0) & (growth < 0))


def _late(cells: Cells) -> Array:
    """Return which cells have reached their time limit and can be shown to have settled, shape (cells,)."""
    known = Offer.ENDING in cells.kernel.model.offers and "reversals" in cells.kernel.measure
    return np.asarray((cells.status == TIME_LIMIT) & known)


def settle(cells: Cells, which: Array | bool = True) -> Array:
    """Settle, in place, the cells of a mask that are at their time limit and can be shown to reverse no more.

    Returns
    -------
    A mask of the cells with a predictable further reversal, shape (cells,).
    """
    table, late = cells.kernel.table(cells.rows), which & _late(cells)
    if not late.any():
        return late
    left = endings(table, late)
    error, fastest = _error(cells)
    final = (left.reversals == 0) & (left.nearest_approach > error * fastest)
    predicted = late & ~final & np.isfinite(left.reversals) & (error < _LARGEST)
    table["status"][late & ~predicted & (final | (cells.recorded(WOUND) > 0))] = SETTLED
    return np.asarray(predicted)


def _error(cells: Cells) -> tuple[Array, Array]:
    """Return the relative error of the slow equations, and the fastest spin that the energy allows, (cells,)."""
    fastest = np.sqrt(2 * np.maximum(cells.kernel.table(cells.rows)["energy"], 0) / cells.inertia)
    return np.maximum(_NEGLECTED * bending(cells.model, cells.columns) * fastest**2, _LEAST), fastest


def whole_blocks(steps: Array) -> Array:
    """Return the steps, rounded up: adams continues only from the end of a block, where its history is complete."""
    return np.asarray(BLOCK * np.ceil(steps / BLOCK))


def watch(cells: Cells, rows: Array) -> None:
    """Have `rows` of cells at t = 0 watched, in place: from the start if they roll round, or in the last window."""
    table, first = cells.kernel.table(rows), cells.rules.first_leg
    if NEXT not in table.layout or first is None:
        return
    surface = cells.model.variant.surface
    slower, faster = frequencies(rigid_body.rocking(cells.columns, surface))
    rolls = faster - slower < _ROLLS * np.abs(starts.spin(cells.columns, surface))
    table[EVERY] = every = whole_blocks(_WINDOW * first / (CHECKS * table["step"]))
    last = whole_blocks(first / table["step"]) - CHECKS * every
    table[NEXT] = np.where(rolls, 0.0, np.where(last < 0, np.inf, last))


def winds_down(cells: Cells) -> Array:
    """Return whose rattle still grows, or winds down so fast that the rest can be followed, shape (cells,)."""
    first, t_end, left = cells.rules.first_leg or 0.0, cells.rules.t_end, cells.recorded(LEFT)
    return np.asarray((left != 0) & (left * _WINDOW * first < _WINDS_DOWN * (t_end - first)))
