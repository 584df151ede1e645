"""A run that simulates only the nodes near changes of the outcome, and infers the nodes between them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np
import xarray as xr

from sweep.config import Config
from sweep.engine import refinement
from sweep.engine.whole import attributes, gather
from sweep.grid import Array, Grid, Tile
from sweep.kernels.status import IMPOSSIBLE
from sweep.prediction import formulas
from sweep.results import dataset, netcdf
from sweep.results.store import Store

_STATUSES = max(dataset.STATUSES) + 1

_TILE = 1 << 18
"""Cells for which the formulas are evaluated at a time."""


class Refined:
    """A growing table of cases: the nodes asked for so far, with tiles of their own for each pass.

    The outcomes of a pass alone decide what the next one asks for, so a resumed run builds the same tiles.
    """

    def __init__(self, config: Config, store: Store) -> None:
        self.config, self.store = config, store
        self.grid = Grid.of(config)
        self.tiles: list[Tile] = []
        self._nodes = np.empty(0, np.intp)
        self._outcome = np.full(self.grid.shape, refinement.UNKNOWN, np.int32)
        self._impossible = self._impossible_nodes()
        self._outcome.ravel()[self._impossible] = IMPOSSIBLE
        self._learned = 0
        """Tiles whose outcomes are known."""

    @cached_property
    def _refined(self) -> list[int]:
        """Indices of the axes that are ranges and longer than a patch."""
        specs = [self.config.parameters[name].spec for name in self.grid.axes]
        patch = 2**self.config.refine
        return [i for i, spec in enumerate(specs) if isinstance(spec, dict) and self.grid.shape[i] > patch]

    def grow(self, tile_size: Callable[[int], int]) -> bool:
        """Add the nodes to simulate next, judging by the outcomes of all tiles so far.  False if there are none.

        `tile_size` as for `Whole.grow`.
        """
        for i in range(self._learned, len(self.tiles)):
            self._outcome.ravel()[self._nodes[self.tiles[i]]] = _outcome(self.store.load(i))
        self._learned = len(self.tiles)
        more = refinement.missing(self._outcome, self._refined, self.config.refine)
        first, step = len(self._nodes), tile_size(len(more))
        self._nodes = np.concatenate([self._nodes, more])
        self.tiles += [(slice(i, min(i + step, len(self._nodes))),) for i in range(first, len(self._nodes), step)]
        return bool(len(more))

    def simulated(self) -> Config:
        """The configuration whose cases are the nodes asked for so far, which `tiles` cover."""
        at = np.unravel_index(self._nodes, self.grid.shape)
        columns = {
            name: tuple(values[i].tolist()) for (name, values), i in zip(self.grid.axes.items(), at, strict=True)
        }
        constants = {name: v for name, v in self.config.parameters.items() if not v.is_axis}
        return replace(self.config, refine=0, parameters=constants, cases=columns)

    def dataset(self) -> xr.Dataset:
        """The labelled dataset over all nodes, in memory."""
        found, apart = gather(Grid.of(self.simulated()), self.tiles, self.store)
        words = attributes(self.config, len(self._nodes), apart)
        words["simulated_share"] = len(self._nodes) / self.grid.size
        return dataset.label(self.config, self.grid, self._arrays(found), words)

    def save(self, path: Path) -> None:
        """Write the labelled dataset."""
        netcdf.write(path, self.dataset())

    def _arrays(self, found: Mapping[str, Array]) -> dict[str, Array]:
        """All variables over the nodes or their bodies, by formula, simulated (`found`) or inferred."""
        arrays = dataset.assemble(self.grid, self._formulas())
        _, body = self.grid.bodies()
        for name, (over, spec) in dataset.layout(self.grid, found.keys() - arrays.keys()).items():
            # No flag says "not simulated", so flags that cannot be inferred are left out.
            if spec.flags is None and name != "reversals":
                arrays[name] = np.full((over.size, *found[name].shape[1:]), np.nan)
                arrays[name][body[self._nodes] if spec.per_body else self._nodes] = found[name]
        source = refinement.sources(self._outcome, self._refined, self.config.refine).ravel()
        for name in ("reversals", "status"):
            simulated = np.empty(self.grid.size, found[name].dtype)
            simulated[self._nodes] = found[name]
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
