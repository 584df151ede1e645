"""Decides which rattles are watched while they roll round and round, and when they will have wound down.

`sweep.kernels.measures.decay` does the watching.
"""

from __future__ import annotations

import numpy as np

from sweep.engine.cells import Cells
from sweep.grid import Array
from sweep.kernels.layout import BLOCK
from sweep.kernels.measures.decay import EVERY, LEFT, LOOKS, NEXT
from sweep.models.general import rigid_body, starts
from sweep.models.theory.rocking import frequencies

# Length of a window, as a share of the patience.
_WINDOW = 0.1

# A rattle rolls round if the body turns by more than one radian while its two modes gain half a radian on each other.
_ROLLS = 0.5


def whole_blocks(steps: Array) -> Array:
    """Return the steps, rounded up: adams continues only from the end of a block, where its history is complete."""
    return np.asarray(BLOCK * np.ceil(steps / BLOCK))


def watch(cells: Cells, images: Array) -> None:
    """Have `images` of cells at t = 0 watched, in place: from the start if they roll round, or in the last window."""
    table, patience = cells.kernel.table(images), cells.rules.patience
    if NEXT not in table.layout or patience is None:
        return
    surface = cells.model.variant.surface
    slower, faster = frequencies(rigid_body.rocking(cells.columns, surface))
    rolls = faster - slower < _ROLLS * np.abs(starts.spin(cells.columns, surface))
    table[EVERY] = every = whole_blocks(_WINDOW * patience / (LOOKS * table["step"]))
    last = whole_blocks(patience / table["step"]) - LOOKS * every
    table[NEXT] = np.where(rolls, 0.0, np.where(last < 0, np.inf, last))


def winds_down(cells: Cells) -> Array:
    """Return whose rattle will have wound down before `t_end`, so that the rest can be followed, (cells,)."""
    patience, t_end, left = cells.rules.patience or 0.0, cells.rules.t_end, cells.recorded(LEFT)
    return np.asarray((left > 0) & (left * _WINDOW * patience < t_end - patience))
