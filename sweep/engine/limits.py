"""How finely a run is divided.  No number depends on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Limits:
    """Sizes of chunks, tiles and batches."""

    chunk_seconds: float = 0.7
    """Length of a chunk in s.  Progress, checkpoints and Ctrl-C wait for the end of a chunk."""
    chunk_blocks: int | None = None
    """Blocks of steps in a chunk; by default as many as take `chunk_seconds`."""
    tile: int | None = None
    """Cells per tile: a dying worker loses one tile, and the file stores one tile as a chunk; by default a 32nd of all
    cells, within bounds."""
    batch: int = 32_768
    """Cells simulated together (50 MB of state rows).  Lanes idle only at the end of each batch of tiles."""

    def tile_of(self, cells: int) -> int:
        """Return the cells per tile of a run of this many `cells`."""
        return self.tile or int(np.clip(cells // 32, 1024, 8192))


LIMITS = Limits()
"""Those of all runs of this process."""
