"""The cells of a sweep, each one trajectory, in the C order of the axes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from math import prod
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from sweep.parameters import PARAMETERS, START

Array = NDArray[Any]

Tile = tuple[slice, ...]
"""A part of a grid: a range of each of its dimensions."""


class Sweepable(Protocol):
    """What a grid is made from, such as a `sweep.config.Config`."""

    @property
    def parameters(self) -> Mapping[str, Any]: ...
    @property
    def cases(self) -> Mapping[str, tuple[float, ...]] | None: ...


@dataclass(frozen=True)
class Grid:
    """Cells over axes, or a list of cases along the one dimension `case`."""

    axes: dict[str, Array]
    """Values by axis; empty for cases."""
    constants: dict[str, float]
    cases: dict[str, Array] | None = None

    @classmethod
    def of(cls, config: Sweepable) -> Grid:
        """The grid of all cells of a configuration."""
        values = config.parameters
        return cls(
            axes={name: np.array(v.numbers) for name, v in values.items() if v.is_axis},
            constants={name: v.numbers[0] for name, v in values.items() if not v.is_axis},
            cases=None if config.cases is None else {k: np.array(v) for k, v in config.cases.items()},
        )

    @property
    def dims(self) -> tuple[str, ...]:
        return ("case",) if self.cases is not None else tuple(self.axes)

    @property
    def shape(self) -> tuple[int, ...]:
        if self.cases is not None:
            return (len(next(iter(self.cases.values()))),)
        return tuple(map(len, self.axes.values()))

    @property
    def size(self) -> int:
        return prod(self.shape)

    def columns(self) -> dict[str, Array]:
        """Values of all parameters, axes and constants, each of shape (size,)."""
        if self.cases is not None:
            varying = self.cases
        else:
            mesh = np.meshgrid(*self.axes.values(), indexing="ij")
            varying = {name: values.ravel() for name, values in zip(self.axes, mesh, strict=True)}
        return varying | {name: np.full(self.size, value) for name, value in self.constants.items()}

    def tiles(self, cells: int) -> list[Tile]:
        """Tiles of about `cells` cells that cover the grid; each is contiguous in C order."""
        sides, inner = [1] * len(self.shape), self.size
        for position, length in enumerate(self.shape):
            inner //= length
            if inner <= cells:
                pieces = -(-length // max(1, cells // inner))
                sides[position:] = [-(-length // pieces), *self.shape[position + 1 :]]
                break
        ranges = [range(0, length, step) for length, step in zip(self.shape, sides, strict=True)]
        return [
            tuple(slice(i, min(i + step, n)) for i, step, n in zip(corner, sides, self.shape, strict=True))
            for corner in product(*ranges)
        ]

    def part(self, tile: Tile) -> Grid:
        """The grid of the cells of a tile."""
        if self.cases is not None:
            return Grid({}, self.constants, {name: values[tile[0]] for name, values in self.cases.items()})
        return Grid({n: v[at] for (n, v), at in zip(self.axes.items(), tile, strict=True)}, self.constants)

    def take(self, cells: Array) -> Grid:
        """The cells with these indices, as a list of cases."""
        if self.cases is not None:
            return Grid({}, self.constants, {name: values[cells] for name, values in self.cases.items()})
        if not self.axes:
            return Grid({}, {}, {name: np.full(len(cells), value) for name, value in self.constants.items()})
        places = np.unravel_index(cells, self.shape)
        return Grid({}, self.constants, {n: v[at] for (n, v), at in zip(self.axes.items(), places, strict=True)})

    def sample(self, cells: int) -> Grid:
        """About `cells` of the cells, spread evenly over each axis with both its ends; all if there are no more."""
        if self.size <= cells:
            return self
        each = max(2, int(cells ** (1 / sum(n > 1 for n in self.shape))))

        def thin(values: Array) -> Array:
            kept = np.linspace(0, len(values) - 1, min(each, len(values))).round().astype(int)
            return np.asarray(values[np.unique(kept)])

        if self.cases is not None:
            return Grid({}, self.constants, {name: thin(values) for name, values in self.cases.items()})
        return Grid({name: thin(values) for name, values in self.axes.items()}, self.constants)

    def first_cell(self, tile: Tile) -> int:
        """Index of the first cell of a tile, in the C order of the grid."""
        return int(np.ravel_multi_index([at.start for at in tile], self.shape)) if tile else 0

    def bodies(self) -> tuple[Grid, Array]:
        """The grid of the bodies, without the start parameters, and for each cell the index of its body in it."""
        if self.cases is not None:
            return self, np.arange(self.size)
        kept = {name: values for name, values in self.axes.items() if name not in START}
        place = np.arange(prod(map(len, kept.values()))).reshape([len(v) for v in kept.values()])
        for position, name in enumerate(self.axes):
            if name in START:
                place = np.repeat(np.expand_dims(place, position), len(self.axes[name]), position)
        constants = self.constants | {name: float(v[0]) for name, v in self.axes.items() if name in START}
        return Grid(kept, constants), place.ravel()


_TILE = 1 << 18
"""Cells examined at a time, when all cells are."""

BODY = tuple(p.name for p in PARAMETERS.values() if p.section in ("body", ""))
"""Names of the parameters of the body, gravity among them."""


def distinct(grid: Grid, names: tuple[str, ...]) -> Iterator[dict[str, Array]]:
    """Columns of cells that have every combination of the parameters `names`, a bounded number of cells at a time."""
    grid = Grid({n: v if n in names else v[:1] for n, v in grid.axes.items()}, grid.constants, grid.cases)
    return (grid.part(tile).columns() for tile in grid.tiles(_TILE))
