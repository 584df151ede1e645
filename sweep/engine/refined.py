"""A run that simulates only the nodes near changes of the outcome, and infers the nodes between them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import numpy as np
import xarray as xr

from sweep.config import Config
from sweep.engine import refinement
from sweep.engine.whole import Some
from sweep.grid import Array, Tile
from sweep.kernels.status import IMPOSSIBLE
from sweep.prediction import formulas
from sweep.results import dataset
from sweep.results.store import Store

_STATUSES = max(dataset.STATUSES) + 1

_TILE = 1 << 18
"""Cells for which the formulas are evaluated at a time."""


class Refined(Some):
    """The nodes asked for so far, with tiles of their own for each pass.

    The outcomes of a pass alone decide what the next one asks for, so a resumed run builds the same tiles.
    """

    def __init__(self, config: Config, store: Store) -> None:
        super().__init__(config, store)
        self._outcome = np.full(self.grid.shape, refinement.UNKNOWN, np.int32)
        self._impossible = self._impossible_nodes()
        self._outcome.ravel()[self._impossible] = IMPOSSIBLE
        self._learned = 0
        """Tiles whose outcomes are known."""
        specs, patch = (config.parameters[name].spec for name in self.grid.axes), 2**config.refine
        self._refined = [i for i, spec in enumerate(specs) if isinstance(spec, dict) and self.grid.shape[i] > patch]
        """Indices of the axes that are ranges and longer than a patch."""

    def grow(self, tile_size: Callable[[int], int]) -> bool:
        """Add the nodes to simulate next, judging by the outcomes of all tiles so far.  False if there are none.

        `tile_size` as for `Whole.grow`.
        """
        for i in range(self._learned, len(self.tiles)):
            self._outcome.ravel()[self.cells[self.tiles[i]]] = _outcome(self.store.load(i))
        self._learned = len(self.tiles)
        return self._add(refinement.missing(self._outcome, self._refined, self.config.refine), tile_size)

    def dataset(self) -> xr.Dataset:
        """The labelled dataset over all nodes, in memory."""
        found, apart = self._gather()
        words = self._attributes(len(self.cells), apart) | {"simulated_share": len(self.cells) / self.grid.size}
        return dataset.label(self.config, self.grid, self._arrays(found), words)

    def _arrays(self, found: Mapping[str, Array]) -> dict[str, Array]:
        """All variables over the nodes or their bodies, by formula, simulated (`found`) or inferred."""
        arrays = dataset.assemble(self.grid, self._formulas())
        # No flag says "not simulated", so flags that cannot be inferred are left out.
        others = {n for n in found.keys() - arrays.keys() if n in dataset.VARIABLES and not dataset.VARIABLES[n].flags}
        self._place(self.cells, {name: found[name] for name in others - {"reversals"}}, arrays)
        source = refinement.sources(self._outcome, self._refined, self.config.refine).ravel()
        for name in ("reversals", "status"):
            simulated = np.empty(self.grid.size, found[name].dtype)
            simulated[self.cells] = found[name]
            simulated[self._impossible] = IMPOSSIBLE if name == "status" else 0
            arrays[name] = simulated[source]
        arrays["inferred"] = self._outcome == refinement.UNKNOWN
        return arrays

    def _impossible_nodes(self) -> Array:
        """Indices of the nodes without a possible body, whose outcome need not be simulated."""
        tiles = self.grid.tiles(_TILE)
        bad = (self.config.equations.impossible(self.grid.part(tile).columns()) for tile in tiles)
        return np.flatnonzero(np.concatenate(list(bad)))

    def _formulas(self) -> Iterator[tuple[Tile, dict[str, Array]]]:
        for tile in self.grid.tiles(_TILE):
            yield tile, dataset.predicted(formulas(self.config.tier, self.grid.part(tile)))


def _outcome(found: Mapping[str, Array]) -> Array:
    """Number of reversals and status of each cell, as one number."""
    return found["reversals"].astype(np.int32) * _STATUSES + found["status"].astype(np.int32)
