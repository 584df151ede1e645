"""A run that simulates every cell, and the dataset its finished tiles make."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from sweep.config import Config
from sweep.config.bodies import described_impossible
from sweep.grid import Array, Grid, Tile
from sweep.results import dataset, netcdf
from sweep.results.provenance import provenance
from sweep.results.store import Store

Apart = dict[str, Array]
"""What a tile holds apart from the results of its cells: its cost, and the cells that were run again."""


def gather(grid: Grid, tiles: Sequence[Tile], store: Store) -> tuple[dict[str, Array], list[Apart]]:
    """Arrays over all cells (or bodies) of `grid`, and what the tiles hold apart from them."""
    apart: list[Apart] = []

    def read() -> Iterator[tuple[Tile, dict[str, Array]]]:
        for i, tile in enumerate(tiles):
            arrays = store.load(i)
            apart.append(_apart(arrays))
            yield tile, arrays

    return dataset.assemble(grid, read()), apart


def attributes(config: Config, cells: int, apart: Iterable[Apart]) -> dict[str, Any]:
    """Where the numbers of a finished run come from, and what its `cells` have cost."""
    seconds, cpus = 0.0, set[str]()
    for tile in apart:
        seconds += float(tile["seconds"])
        cpus.add(str(tile["cpu"]))
    return provenance(config, seconds, cells, cpus) | described_impossible(config)


def _apart(arrays: Mapping[str, Array]) -> Apart:
    return {n: values for n, values in arrays.items() if n in ("seconds", "cpu") or n.startswith("verified_")}


class Whole:
    """All cells of a configuration, in tiles."""

    def __init__(self, config: Config, store: Store) -> None:
        self.config, self.store = config, store
        self.grid = Grid.of(config)
        self.tiles: list[Tile] = []

    def grow(self, tile_size: Callable[[int], int]) -> bool:
        """Add the tiles to simulate next: all of them, once.  False if there are no more.

        Parameters
        ----------
        tile_size : cells per tile, by the number of cells
        """
        if self.tiles:
            return False
        self.tiles = self.grid.tiles(tile_size(self.grid.size))
        return True

    def simulated(self) -> Config:
        """The configuration whose cells `tiles` cover."""
        return self.config

    def dataset(self) -> xr.Dataset:
        """The labelled dataset, in memory."""
        return self._frame(*gather(self.grid, self.tiles, self.store))

    def save(self, path: Path) -> None:
        """Write the labelled dataset, each tile as one chunk; it need not fit into memory.

        Every tile is read twice: the file begins with what the tiles hold apart from their cells.
        """
        tails, apart = dict[str, tuple[int, ...]](), list[Apart]()
        for i in range(len(self.tiles)):
            arrays = self.store.load(i)
            tails |= {name: values.shape[1:] for name, values in arrays.items()}
            apart.append(_apart(arrays))
        variables = {}
        first = dict(zip(self.grid.dims, self.tiles[0], strict=True))
        for name, (over, spec) in dataset.layout(self.grid, tails).items():
            empty = np.broadcast_to(np.zeros((), spec.dtype), over.shape + tails[name])
            chunks = tuple(first[dim].stop for dim in over.dims) + tails[name]
            words = dataset.described(spec, self.config.units)
            variables[name] = xr.Variable(dataset.dims(over, spec), empty, words), chunks
        blocks = (
            block for i, tile in enumerate(self.tiles) for block in dataset.blocks(self.grid, tile, self.store.load(i))
        )
        frame = self._frame({}, apart).assign_coords(dataset.numbers_along(tails))
        netcdf.write(path, frame, variables, blocks)

    def _frame(self, arrays: Mapping[str, Array], apart: Sequence[Apart]) -> xr.Dataset:
        """A dataset of `arrays` with coordinates, attributes, and the cells that were run again."""
        framed = dataset.label(self.config, self.grid, arrays, attributes(self.config, self.grid.size, apart))
        names = dict.fromkeys(name for tile in apart for name in tile if name.startswith("verified_"))
        again = {name: np.concatenate([tile[name] for tile in apart if name in tile]) for name in names}
        return dataset.beside(self.config, framed, again) if again else framed
