"""Says which rattles are watched while they roll round and round, and when they will have wound down.

What is seen of them is in `sweep.kernels.measures.decay`.
"""

from __future__ import annotations

import numpy as np

from sweep.engine.cells import Cells
from sweep.grid import Array
from sweep.kernels.layout import BLOCK
from sweep.kernels.measures.decay import EVERY, LEFT, LOOKS, NEXT
from sweep.models.general import rigid_body, starts
from sweep.models.theory.rocking import frequencies

# A window, as a share of the patience.
_WINDOW = 0.1

# A rattle rolls round where the body turns by more than one radian while its two modes gain half of one on each other.
_ROLLS = 0.5


def whole_blocks(steps: Array) -> Array:
    """So many steps, rounded up: adams goes on only from the end of a block, where its history is that of the state."""
    return np.asarray(BLOCK * np.ceil(steps / BLOCK))


def watch(cells: Cells, images: Array) -> None:
    """Let `images` of cells at t = 0 be watched, in place: from the start if they roll round, or in the last window."""
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
    """Tell whose rattle will have wound down before `t_end`, so that what then happens can be followed, (cells,)."""
    table, (patience, t_end) = cells.kernel.table(cells.images), (cells.rules.patience or 0.0, cells.rules.t_end)
    left = table[LEFT] if LEFT in table.layout else np.zeros(len(cells.cells))
    return np.asarray((left > 0) & (left * _WINDOW * patience < t_end - patience))
