"""Runs cells until their counts are final: where the rattle is small, the slow equations tell what is still to come."""

from __future__ import annotations

import numpy as np

from sweep.engine.plan import Part
from sweep.engine.work import Work
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

    A cell that meets the configuration's `patience` goes on to `t_end` only if a further reversal can be foreseen.
    Parameters as of `Work.run`.
    """
    patience, table = part.config.integrator.patience, part.kernel.table(part.images)
    first = most if patience is None else np.minimum(most, np.ceil(patience / table["step"]))
    work.run(name, part.kernel, part.images, settle=part.settles, most=first)
    rows = np.flatnonzero(settle(part)) if part.settles else np.empty(0, int)
    if patience is not None and len(rows):
        on = part.take(rows)
        on.kernel.table(on.images)["status"] = RUNNING
        on_most = most if np.ndim(most) == 0 else np.asarray(most)[rows]
        work.run(f"{name} later", on.kernel, on.images, settle=True, most=on_most)
        settle(on)
        part.images[rows] = on.images


def settle(part: Part) -> Array:
    """Settle the cells at their limit of time that can be shown to reverse no more, in place.

    Returns
    -------
    Where a further reversal can be foreseen, shape (cells,).
    """
    table = part.kernel.table(part.images)
    late = table["status"] == TIME_LIMIT
    if not (MODES in part.kernel.model.offers and "reversals" in part.kernel.measure and late.any()):
        return np.zeros(len(late), bool)
    left = endings(table, late)
    _, _, inertia = part.kernel.model.energy(*part.kernel.unpack(part.images))
    fastest = np.sqrt(2 * np.maximum(table["energy"], 0) / inertia)
    error = np.maximum(_NEGLECTED * bending(part.columns) * fastest**2, _LEAST)
    final = (left.reversals == 0) & (left.nearest_approach > error * fastest)
    table["status"][late & final] = SETTLED
    return np.asarray(late & ~final & np.isfinite(left.reversals) & (error < _LARGEST))
