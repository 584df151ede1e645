"""A run that simulates the nodes near changes of the outcome alone, and infers those between."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import cached_property

import numpy as np
import xarray as xr

from sweep.config import Config
from sweep.engine import refinement
from sweep.engine.whole import attributes
from sweep.grid import Array, Grid, Tile
from sweep.models import TIERS
from sweep.prediction import formulas
from sweep.results import dataset
from sweep.results.store import Checkpoint, Memory, RunFiles

_TILE = 1 << 18
"""Cells of which the formulas are evaluated together."""


class Refined:
    """A growing table of cases: the nodes asked for so far, those of each pass in tiles of their own.

    What a pass finds decides on the next, so a run that goes on comes by the same tiles again.
    """

    def __init__(self, config: Config, checkpoint: Checkpoint | Memory) -> None:
        self.config, self.checkpoint = config, checkpoint
        self.grid = Grid.of(config)
        self.tiles: list[Tile] = []
        self._nodes = np.empty(0, np.intp)
        self._outcome = np.full(self.grid.shape, refinement.UNKNOWN, np.int32)
        self._learned = 0

    @cached_property
    def _refined(self) -> list[int]:
        """The axes that are ranges with room for a block."""
        specs = [self.config.parameters[name].spec for name in self.grid.axes]
        block = 2**self.config.refine
        return [i for i, spec in enumerate(specs) if isinstance(spec, dict) and self.grid.shape[i] > block]

    def grow(self, tile_size: Callable[[int], int]) -> bool:
        """Ask for the nodes that the outcomes of all tiles so far want simulated; False if there are none.

        Parameters
        ----------
        tile_size : cells a tile, by the number of cells
        """
        for i in range(self._learned, len(self.tiles)):
            self._outcome.ravel()[self._nodes[self.tiles[i]]] = _outcome(self.checkpoint.load(i))
        self._learned = len(self.tiles)
        more = refinement.missing(self._outcome, self._refined, self.config.refine)
        first, step = len(self._nodes), tile_size(len(more))
        self._nodes = np.concatenate([self._nodes, more])
        self.tiles += [(slice(i, min(i + step, len(self._nodes))),) for i in range(first, len(self._nodes), step)]
        return bool(len(more))

    def cases(self) -> Config:
        """The configuration that runs the nodes asked for so far."""
        at = np.unravel_index(self._nodes, self.grid.shape)
        columns = {
            name: tuple(values[i].tolist()) for (name, values), i in zip(self.grid.axes.items(), at, strict=True)
        }
        constants = {name: v for name, v in self.config.parameters.items() if not v.is_axis}
        return replace(self.config, refine=0, parameters=constants, cases=columns)

    def dataset(self) -> xr.Dataset:
        """The labelled dataset over all nodes, in memory."""
        words = attributes(self.config, len(self._nodes), map(self.checkpoint.load, range(len(self.tiles))))
        words["simulated_share"] = len(self._nodes) / self.grid.size
        return dataset.label(self.config, self.grid, self._arrays(), words)

    def save(self, files: RunFiles) -> None:
        files.save_tiles(self.dataset(), {}, [])

    def _arrays(self) -> dict[str, Array]:
        """All variables over the nodes or their bodies: by formula, simulated or inferred."""
        found = dataset.assemble(Grid.of(self.cases()), self._finished())
        arrays = dataset.assemble(self.grid, self._formulas())
        _, body = self.grid.bodies()
        for name, (over, spec) in dataset.layout(self.grid, found.keys() - arrays.keys()).items():
            # Flags have none that says "not simulated": those that cannot be inferred are left out.
            if spec.flags is None and name != "reversals":
                arrays[name] = np.full(over.size, np.nan)
                arrays[name][body[self._nodes] if spec.per_body else self._nodes] = found[name]
        source = refinement.sources(self._outcome, self._refined, self.config.refine).ravel()
        for name in ("reversals", "status"):
            simulated = np.empty(self.grid.size, found[name].dtype)
            simulated[self._nodes] = found[name]
            arrays[name] = simulated[source]
        arrays["inferred"] = self._outcome == refinement.UNKNOWN
        return arrays

    def _finished(self) -> Iterator[tuple[Tile, dict[str, Array]]]:
        for i, tile in enumerate(self.tiles):
            yield tile, self.checkpoint.load(i)

    def _formulas(self) -> Iterator[tuple[Tile, dict[str, Array]]]:
        for tile in self.grid.tiles(_TILE):
            yield tile, dataset.predicted(formulas(TIERS[self.config.model], self.grid.part(tile)))


def _outcome(found: Mapping[str, Array]) -> Array:
    """Count and status as one number."""
    return found["reversals"].astype(np.int32) * len(dataset.STATUSES) + found["status"].astype(np.int32)
