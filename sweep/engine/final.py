"""Runs cells until their counts are final, or until nothing tells when that will be.

Where the rattle is small, the slow equations tell what is still to come.  Where it rolls round and round, as in nearly
round bodies, how it winds down is measured.
"""

from __future__ import annotations

import numpy as np

from sweep.engine.executor import Work
from sweep.engine.plan import Part
from sweep.engine.winding import whole_blocks, wind_down
from sweep.grid import Array
from sweep.kernels.measures.resting_spin import endings
from sweep.kernels.status import RUNNING, SETTLED, TIME_LIMIT
from sweep.models.model import MODES
from sweep.models.stiff.modes import bending

# Error of the slow equations in spin, relative to the fastest spin that the energy allows: at least this, and so many
# times what they neglect.  Of 576 cells of `configs/mu_b.yaml` at n0 = 0.05, stopped at t = 5000 and at 30 000, none
# that this settled had another count at t = 10⁶.
_LEAST, _NEGLECTED = 0.02, 3.0

# Where the error is larger than this share, the slow equations foresee nothing.
_LARGEST = 0.2


def run(part: Part, work: Work, name: str, most: Array | float = np.inf) -> None:
    """Run `part` to its ends, in place.

    A cell that meets the configuration's `patience` goes on to `t_end` only if it can be foreseen that its spin
    reverses once more, or that its rattle has wound down before.  Parameters as of `Work.run`.
    """
    patience, table = part.config.integrator.patience, part.kernel.table(part.images)
    first = most if patience is None else np.minimum(most, whole_blocks(patience / table["step"]))
    work.run(name, part.kernel, part.images, settle=part.settles, most=first)
    on = settle(part) if part.settles else np.zeros(len(part.cells), bool)
    if patience is None or not part.settles:
        return
    rest = np.flatnonzero(_late(part) & ~on)
    on[rest] = wind_down(part, rest, work, f"{name} winding", patience)
    rows = np.flatnonzero(on)
    if len(rows):
        later = part.take(rows)
        later.kernel.table(later.images)["status"] = RUNNING
        limit = np.broadcast_to(most, len(part.cells))[rows]
        work.run(f"{name} later", later.kernel, later.images, settle=later.settles, most=limit)
        settle(later)
        part.images[rows] = later.images


def _late(part: Part) -> Array:
    """Tell which cells are at their limit of time, and can be shown to have settled, shape (cells,)."""
    late = part.kernel.table(part.images)["status"] == TIME_LIMIT
    return np.asarray(late & (MODES in part.kernel.model.offers and "reversals" in part.kernel.measure))


def settle(part: Part) -> Array:
    """Settle the cells at their limit of time that can be shown to reverse no more, in place.

    Returns
    -------
    Where a further reversal can be foreseen, shape (cells,).
    """
    table, late = part.kernel.table(part.images), _late(part)
    if not late.any():
        return late
    left = endings(table, late)
    fastest = np.sqrt(2 * np.maximum(table["energy"], 0) / part.inertia)
    error = np.maximum(_NEGLECTED * bending(part.columns) * fastest**2, _LEAST)
    final = (left.reversals == 0) & (left.nearest_approach > error * fastest)
    table["status"][late & final] = SETTLED
    return np.asarray(late & ~final & np.isfinite(left.reversals) & (error < _LARGEST))
