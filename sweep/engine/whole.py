"""Run all cells of a configuration, and make the dataset from the finished tiles."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from sweep.config import Config
from sweep.config.cross_checks import described_impossible
from sweep.engine import limits
from sweep.grid import Array, Tile
from sweep.results import dataset, netcdf
from sweep.results.provenance import provenance
from sweep.results.store import Store


class Whole:
    """All cells of a configuration, in tiles."""

    def __init__(self, config: Config, store: Store) -> None:
        self.config, self.store = config, store
        self.grid = config.grid
        self.tiles: list[Tile] = []

    def grow(self) -> bool:
        """Add the tiles to simulate next: all of them, once. Return False if there are no more."""
        if self.tiles:
            return False
        self.tiles = self.grid.tiles(limits.LIMITS.tile_of(self.grid.size))
        return True

    def simulated(self) -> Config:
        """The configuration whose cells `tiles` cover."""
        return self.config

    def dataset(self) -> xr.Dataset:
        """Return the labelled dataset, in memory."""
        return self._labelled(self._gather())

    def save(self, path: Path) -> None:
        """Write the labelled dataset, tile by tile; it may be larger than memory.

        Every tile is read twice, since the file begins with its total cost.
        """
        if self.config.samples:  # a probability needs all samples together
            netcdf.write(path, self.dataset())
            return
        tails = {name: values.shape[1:] for name, values in self.store.load(0).items()}
        first = dict(zip(self.grid.dims, self.tiles[0], strict=True))
        empty, sizes = dict[str, Array](), dict[str, tuple[int, ...]]()
        for name, (over, spec) in dataset.layout(self.grid, tails).items():
            empty[name] = np.broadcast_to(np.zeros((), spec.dtype), over.shape + tails[name])
            sizes[name] = tuple(first[dim].stop for dim in over.dims) + tails[name]
        pieces = (piece for tile, arrays in self._finished() for piece in dataset.pieces(self.grid, tile, arrays))
        netcdf.write(path, self._labelled(empty), sizes, pieces)

    def _cut(self, cells: int) -> bool:
        """Simulate this many more cases, in separate tiles; return False if there are none."""
        first, step = self.tiles[-1][0].stop if self.tiles else 0, limits.LIMITS.tile_of(cells)
        self.tiles += [(slice(i, min(i + step, first + cells)),) for i in range(first, first + cells, step)]
        return cells > 0

    def _gather(self) -> dict[str, Array]:
        """Collect arrays over all simulated cells (or bodies)."""
        return dataset.assemble(self.simulated().grid, self._finished())

    def _finished(self) -> Iterator[tuple[Tile, dict[str, Array]]]:
        """Yield the tiles one after another, with their contents."""
        return ((tile, self.store.load(i)) for i, tile in enumerate(self.tiles))

    def _labelled(self, arrays: Mapping[str, Array]) -> xr.Dataset:
        """Label `arrays` over all cells with coordinates and attributes."""
        return dataset.label(self.config, self.grid, arrays, self._attributes(self.grid.size))

    def _attributes(self, cells: int) -> dict[str, Any]:
        """Return the provenance attributes of a finished run, and the cost of its `cells`."""
        costs = [(float(tile["seconds"]), str(tile["cpu"])) for _, tile in self._finished()]
        seconds, cpus = sum(seconds for seconds, _ in costs), {cpu for _, cpu in costs}
        return provenance(self.config, seconds, cells, cpus) | described_impossible(self.config)
