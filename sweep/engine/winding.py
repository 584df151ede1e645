"""Follows a rattle that rolls round and round, and finds out whether the spin still reverses when it has wound down.

So rattle nearly round bodies (`sweep.models.stiff.precession`).  What their rattle does to the spin is measured, as no
equations for it are at hand.
"""

from __future__ import annotations

import numpy as np

from sweep.engine.executor import UNTIL_ALL_STOP, Work, execute
from sweep.engine.plan import Part
from sweep.grid import Array
from sweep.kernels.lanes import BEYOND, STABLE
from sweep.kernels.layout import BLOCK, Table
from sweep.kernels.measures.margin import WOUND
from sweep.kernels.measures.resting_spin import slow_states
from sweep.kernels.status import RUNNING, SETTLED, TIME_LIMIT
from sweep.models.stiff.precession import vertical_spin

# Looks at a rattle that winds down, and over which share of the patience.  Of the roundest bodies of `mu_b` it loses
# 0.03 % of its energy in that time, so that few looks would not tell this from the ripple of M·u/I3, which is 3e-6.
_LOOKS, _LONGER = 256, 0.1

_KEPT = 32
"""Looks after which they are kept for an interrupted run to go on."""

# The slope of M·u/I3 over the energy grows as the rattle decays, in nearly round bodies about as the sixth power of
# 1/spin.  Then the spin stays away from zero if it would with seven times the slope.
_STEEPER = 8.0

# A rattle that loses a larger share of its energy between the first look and the last is soon small enough for others.
_SLOW = 0.5


def whole_blocks(steps: Array) -> Array:
    """So many steps, rounded up: adams goes on only from the end of a block, where its history is that of the state."""
    return np.asarray(BLOCK * np.ceil(steps / BLOCK))


def wind_down(part: Part, rows: Array, work: Work, name: str, patience: float) -> Array:
    """Follow the rattle of the cells `rows` for a while, and settle those that it hardly turns any more, in place.

    A cell that would pass its `t_end` in that time is left alone.  While the rattle decays, M·u/I3 changes with its
    energy by some slope.  If `_STEEPER` times this slope and all the energy left carry the spin neither through zero
    nor to where a rattle grows, no reversal will come.  Of the 423 cells of `configs/mu_b.yaml` that nothing else
    settles by t = 30 000, that is so of 334; none of these reverses by t = 10⁶, while 27 of the others do.

    Returns
    -------
    Where the rattle has wound down before `t_end`, and what then happens can be followed, shape (rows,).
    """
    every = part.kernel.table(part.images[rows])
    between = whole_blocks(_LONGER * patience / (_LOOKS * every["step"]))
    in_time = every["done"] + _LOOKS * between <= every["goal"]
    goes_on = np.zeros(len(rows), bool)
    if not in_time.any():
        return goes_on
    followed = rows[in_time]
    on = part.take(followed)
    spins, totals = _looks(on, work, name, between[in_time])
    table = on.kernel.table(on.images)
    spin, energies, off = spins[-1], totals - spins**2, totals - totals.mean(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = (off * spins).sum(axis=0) / (off**2).sum(axis=0)
        end = spin - _STEEPER * slope / (1 - 2 * spin * slope) * energies[-1]
        left = _LONGER * energies[-1] / (energies[0] - energies[-1])  # until it has wound down, in units of patience
    falls = (table["status"] == TIME_LIMIT) & (totals[-1] < totals[0])
    final = falls & (energies[-1] > _SLOW * energies[0]) & (spin * end > 0)
    final &= _stays(table, np.minimum(spin, end), np.maximum(spin, end))
    table["status"] = np.where(final, SETTLED, TIME_LIMIT)
    if WOUND in table.layout:
        table[WOUND] = np.where(final, np.abs(end), 0)
    later = falls & ~final & (left * patience < part.config.integrator.t_end - patience)
    part.images[followed[final | later]] = on.images[final | later]
    goes_on[in_time] = later
    return goes_on


def _looks(part: Part, work: Work, name: str, between: Array) -> Array:
    """Run `part` on, in place, and take `vertical_spin` every `between` steps, shape (2, looks, cells)."""
    table = part.kernel.table(part.images)
    begun, goal, looks = table["done"].copy(), table["goal"].copy(), list(work.kept.get(f"{name} looks", ()))
    part.images[:] = work.kept.get(name, part.images)
    for look in range(len(looks), _LOOKS + 1):
        table["goal"] = begun + look * between
        table["status"][(table["status"] == TIME_LIMIT) & (table["done"] < table["goal"])] = RUNNING
        execute(part.kernel, part.images, stop_when_settled=False, chunk_blocks=UNTIL_ALL_STOP)
        looks.append(vertical_spin(*slow_states(table)))
        if look % _KEPT == 0:
            work.kept |= {name: part.images.copy(), f"{name} looks": np.array(looks)}
            work.after_chunk()
    table["goal"] = goal
    return np.array(looks).swapaxes(0, 1)


def _stays(table: Table, lowest: Array, highest: Array) -> Array:
    """Tell whether spins between two limits stay where no rattle grows enough to reverse them, shape (cells,).

    That is a stable range, or below `BEYOND` times n_c1 (`sweep.kernels.lanes`).
    """
    ends = table.columns(STABLE).T
    beyond = (lowest > BEYOND * ends[0]) & (highest < BEYOND * ends[1])
    return np.asarray(((lowest > ends[::2]) & (highest < ends[1::2])).any(axis=0) | beyond)
