"""From finished tiles to the dataset, in memory or on disk."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from sweep.config import Config
from sweep.grid import Array, Grid, Tile
from sweep.results import dataset
from sweep.results.provenance import provenance
from sweep.results.store import Checkpoint, Memory, RunFiles


def attributes(config: Config, cells: int, tiles: Iterable[Mapping[str, Array]]) -> dict[str, Any]:
    """Where the numbers of a finished run come from, and what its `cells`, in `tiles`, have cost."""
    seconds, cpus = 0.0, set[str]()
    for tile in tiles:
        seconds += float(tile["seconds"])
        cpus.add(str(tile["cpu"]))
    return provenance(config, seconds, cells, cpus)


@dataclass(frozen=True)
class Whole:
    """A finished run, in tiles."""

    config: Config
    grid: Grid
    tiles: Sequence[Tile]
    checkpoint: Checkpoint | Memory

    def dataset(self) -> xr.Dataset:
        """The labelled dataset, in memory."""
        return self._frame(dataset.assemble(self.grid, self._tiles()))

    def save(self, files: RunFiles) -> None:
        """Write the labelled dataset tile by tile, a chunk each."""
        variables = {}
        at = dict(zip(self.grid.dims, self.tiles[0], strict=True))
        for name, (over, spec) in dataset.layout(self.grid, self.checkpoint.load(0)).items():
            empty = np.broadcast_to(np.zeros((), spec.dtype), over.shape)
            chunks = tuple(at[dim].stop for dim in over.dims)
            variables[name] = xr.Variable(over.dims, empty, dataset.described(spec)), chunks
        blocks = (block for tile, arrays in self._tiles() for block in dataset.blocks(self.grid, tile, arrays))
        files.save_tiles(self._frame({}), variables, blocks)

    def _tiles(self) -> Iterator[tuple[Tile, dict[str, Array]]]:
        for i, tile in enumerate(self.tiles):
            yield tile, self.checkpoint.load(i)

    def _frame(self, arrays: Mapping[str, Array]) -> xr.Dataset:
        """Coordinates, attributes and what is not over the cells, with `arrays`."""
        again = dict[str, list[Array]]()
        for _, tile in self._tiles():
            for name in tile:
                if name.startswith("verified_"):
                    again.setdefault(name, []).append(tile[name])
        words = attributes(self.config, self.grid.size, (tile for _, tile in self._tiles()))
        framed = dataset.label(self.config, self.grid, arrays, words)
        return dataset.beside(framed, {n: np.concatenate(v) for n, v in again.items()}) if again else framed
