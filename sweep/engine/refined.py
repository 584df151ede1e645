"""Runs only the nodes near changes of the outcome, and infers the nodes between them."""

from __future__ import annotations

from collections.abc import Mapping
from math import prod

import numpy as np
import xarray as xr

from sweep.config import Config
from sweep.engine.refinement import UNKNOWN, Nodes, Outcomes, search
from sweep.engine.whole import Some
from sweep.grid import TILE, Array, distinct
from sweep.kernels.status import IMPOSSIBLE
from sweep.prediction import formulas
from sweep.results import dataset
from sweep.results.margins import Counts
from sweep.results.store import Store


class Refined(Some):
    """The requested nodes, with separate tiles for each pass.

    Each pass depends only on the results of earlier passes, so a resumed run builds the same tiles.
    """

    def __init__(self, config: Config, store: Store) -> None:
        super().__init__(config, store)
        size = self.grid.size
        self._outcomes = Outcomes(np.zeros(size, np.int32), np.full(size, UNKNOWN, np.int8))
        bad = [config.equations.impossible(columns) for columns in distinct(self.grid, tuple(self.grid.axes))]
        self._outcomes.status[np.concatenate(bad)] = IMPOSSIBLE  # impossible bodies need not be simulated
        self._inferred = Outcomes(*(each.copy() for each in self._outcomes))
        """Known outcomes of the nodes, simulated or inferred."""
        self._margins = {name: np.full(size, np.nan) for name in ("margin_more", "margin_fewer")}
        self._learned = 0
        """Tiles whose results are known."""
        specs, patch = (config.parameters[name].spec for name in self.grid.axes), 2 ** (config.refine + 1)
        refined = [i for i, spec in enumerate(specs) if isinstance(spec, dict) and self.grid.shape[i] > patch]
        """Indices of the axes that are ranges and longer than a patch."""
        self._shape = tuple(self.grid.shape[i] for i in refined)
        nodes = np.moveaxis(np.arange(size).reshape(self.grid.shape), refined, range(-len(refined), 0))
        self._maps: Nodes = nodes.reshape(-1, prod(self._shape) if refined else size)
        """Indices of the nodes of each map, one map for each value of the other axes."""
        self._open = [*range(len(self._maps))]
        """Maps that are not complete."""

    def grow(self) -> bool:
        """Add the nodes to simulate next, judging by all results so far; return False if there are none."""
        known = {**self._outcomes._asdict(), **self._margins}
        for i in range(self._learned, len(self.tiles)):
            found, cells = self.store.load(i), self.cells[self.tiles[i]]
            for name in known.keys() & found.keys():
                known[name][cells] = found[name]
        self._learned = len(self.tiles)
        asked = {i: self._searched(i) for i in self._open}
        self._open = [i for i, nodes in asked.items() if len(nodes)]
        return self._add(np.sort(np.concatenate([*asked.values()])))

    def _searched(self, i: int) -> Nodes:
        """Return the nodes of a map to simulate next, and update the known outcomes of the map."""
        nodes: Nodes = self._maps[i]
        known = Outcomes(*(each[nodes] for each in self._outcomes))
        if self._shape:
            counts = Counts.of({**known._asdict(), **{name: each[nodes] for name, each in self._margins.items()}})
            new, outcomes = search(self._shape, known, counts, self.config.refine)
        else:
            new, outcomes = np.flatnonzero(known.status == UNKNOWN), known
        for whole, part in zip(self._inferred, outcomes, strict=True):
            whole[nodes] = part
        return nodes[new]

    def dataset(self) -> xr.Dataset:
        """Return the labelled dataset over all nodes, in memory."""
        attributes = self._attributes(len(self.cells)) | {"simulated_share": len(self.cells) / self.grid.size}
        return dataset.label(self.config, self.grid, self._arrays(self._gather()), attributes)

    def _arrays(self, found: Mapping[str, Array]) -> dict[str, Array]:
        """Return all variables over the nodes or their bodies: by formula, simulated (`found`) or inferred."""
        arrays = dataset.assemble(
            self.grid, ((tile, formulas(self.config.tier, self.grid.part(tile))) for tile in self.grid.tiles(TILE))
        )
        # No flag means "not simulated", so flags that cannot be inferred are left out.
        others = {n for n in found.keys() - arrays.keys() if n in dataset.VARIABLES and not dataset.VARIABLES[n].flags}
        self._place(self.cells, {name: found[name] for name in others - {"reversals"}}, arrays)
        return arrays | self._inferred._asdict() | {"inferred": self._outcomes.status == UNKNOWN}
