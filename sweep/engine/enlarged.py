"""A run that simulates only those cells that an earlier, smaller one has not computed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr

from sweep.config import Config
from sweep.engine import verification
from sweep.engine.earlier import Earlier
from sweep.engine.whole import attributes, gather
from sweep.grid import Array, Grid, Tile
from sweep.results import dataset, netcdf
from sweep.results.provenance import identify
from sweep.results.store import Store


class Enlarged:
    """A table of cases, the cells that have to be simulated, and the dataset of these and of the earlier run's."""

    def __init__(self, config: Config, store: Store, earlier: Earlier) -> None:
        self.config, self.store, self.earlier = config, store, earlier
        self.grid = Grid.of(config)
        self.tiles: list[Tile] = []
        self._missing = np.flatnonzero(earlier.cells < 0)

    def grow(self, tile_size: Callable[[int], int]) -> bool:
        """Add the tiles to simulate: all of them, once.  False if there are no more.

        `tile_size` as for `Whole.grow`.
        """
        if self.tiles or not len(self._missing):
            return False
        self.tiles = Grid.of(self.simulated()).tiles(tile_size(len(self._missing)))
        return True

    def simulated(self) -> Config:
        """The configuration whose cases are the missing cells, which `tiles` cover; they are not verified."""
        constants = {name: value for name, value in self.config.parameters.items() if not value.is_axis}
        columns = self.grid.columns()
        cases = {name: tuple(columns[name][self._missing].tolist()) for name in columns.keys() - constants.keys()}
        return replace(self.config, verify=0.0, parameters=constants, cases=cases)

    def dataset(self) -> xr.Dataset:
        """The labelled dataset over all cells, in memory."""
        arrays = self.earlier.arrays(self.grid)
        found, apart = gather(Grid.of(self.simulated()), self.tiles, self.store)
        _, body = self.grid.bodies()
        for name, (over, spec) in dataset.layout(self.grid, found).items():
            if name not in arrays:
                arrays[name] = np.zeros((over.size, *found[name].shape[1:]), spec.dtype)
            arrays[name][body[self._missing] if spec.per_body else self._missing] = found[name]
        words = attributes(self.config, len(self._missing), apart) | {"taken_over": self.earlier.words}
        words["config_hash"] = identify(self.config).again(self.earlier.rerun).config_hash
        labelled = dataset.label(self.config, self.grid, arrays, words)
        return dataset.beside(self.config, labelled, self._verified(arrays)) if self.config.verify else labelled

    def save(self, path: Path) -> None:
        """Write the labelled dataset."""
        netcdf.write(path, self.dataset())

    def _verified(self, arrays: dict[str, Array]) -> dict[str, Array]:
        """Those cells run again that a run of all of them at once runs again."""
        cells = verification.sound(verification.draw(self.grid.size, self.config.verify), arrays)
        first = {name: values[cells] for name, values in arrays.items() if name in verification.COMPARED}
        columns = {name: values[cells] for name, values in self.grid.columns().items()}
        return {"verified_cell": cells} | verification.verify(self.config, columns, first)
