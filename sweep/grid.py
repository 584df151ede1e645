"""Defines the cells of a sweep, each one trajectory, in the C order of the axes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sweep.parameters import PARAMETERS, START

Array = NDArray[Any]

Tile = tuple[slice, ...]
"""A part of a grid: a range of each of its dimensions."""


CASE, SAMPLE = "case", "sample"
"""Names of the dimension along the rows of a table: listed cases, or drawn samples."""


@dataclass(frozen=True)
class Grid:
    """Cells over axes and, as the last dimension, over the rows of a table of parameters if there is one."""

    axes: dict[str, Array]
    """Values by axis."""
    constants: dict[str, float]
    table: dict[str, Array] = field(default_factory=dict)
    """Columns of the table by parameter, each of shape (rows,)."""
    row: str = CASE
    """Name of the dimension along the rows of the table."""
    assemble: Callable[[Mapping[str, Array]], dict[str, Array]] = dict
    """Computes the parameters of the model from those that the configuration gives, by name, of shape (cells,)."""

    @property
    def dims(self) -> tuple[str, ...]:
        return (*self.axes, *([self.row] if self.table else []))

    @property
    def shape(self) -> tuple[int, ...]:
        rows = {len(column) for column in self.table.values()}  # all columns have the same length
        return (*map(len, self.axes.values()), *rows)

    @property
    def size(self) -> int:
        return prod(self.shape)

    def columns(self) -> dict[str, Array]:
        """Return the parameters of the model, each of shape (size,), besides those that the configuration gives."""
        return self.assemble(self.given())

    def given(self) -> dict[str, Array]:
        """Return values of all parameters of the configuration, axes and constants, each of shape (size,)."""
        mesh = np.meshgrid(*map(np.arange, self.shape), indexing="ij")
        return self._at([place.ravel() for place in mesh]) | {
            name: np.full(self.size, value) for name, value in self.constants.items()
        }

    def _at(self, places: Sequence[Any]) -> dict[str, Array]:
        """Return values of everything that varies, at these indices along each dimension."""
        found = {name: values[at] for (name, values), at in zip(self.axes.items(), places, strict=False)}
        return found | {name: values[places[-1]] for name, values in self.table.items()}

    def part(self, places: Sequence[Any]) -> Grid:
        """Return the grid over these places along each dimension, such as a tile."""
        found = self._at(places)
        axes, table = ({name: found[name] for name in names} for names in (self.axes, self.table))
        return replace(self, axes=axes, table=table)

    def tiles(self, cells: int) -> list[Tile]:
        """Return tiles of about `cells` cells that cover the grid; each is contiguous in C order."""
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

    def take(self, cells: Array) -> Grid:
        """Return the cells with these indices, as a list of cases."""
        if not self.shape:
            table = {name: np.full(len(cells), value) for name, value in self.constants.items()}
            return replace(self, constants={}, table=table)
        return replace(self, axes={}, table=self._at(np.unravel_index(cells, self.shape)), row=CASE)

    def sample(self, cells: int) -> Grid:
        """Return about `cells` of the cells, evenly spaced along each dimension including its ends; at most all."""
        if self.size <= cells:
            return self
        each = max(2, int(cells ** (1 / sum(n > 1 for n in self.shape))))
        places = [np.unique(np.linspace(0, n - 1, min(each, n)).round().astype(int)) for n in self.shape]
        return self.part(places)

    def of_bodies(self) -> Grid:
        """Return the grid of the bodies, without the start parameters. Every case is a separate body."""
        fixed = {name: float(values[0]) for name, values in self._at([slice(1)] * len(self.shape)).items()}
        kept = {name: values for name, values in self.axes.items() if name not in START}
        table = self.table if self.row == CASE or set(self.table) - START else {}
        constants = self.constants | {name: fixed[name] for name in fixed if name not in {**kept, **table}}
        return replace(self, axes=kept, constants=constants, table=table)

    def bodies(self) -> tuple[Grid, Array]:
        """Return the grid of the bodies, and for each cell the index of its body."""
        bodies = self.of_bodies()
        own = [n if dim in bodies.dims else 1 for dim, n in zip(self.dims, self.shape, strict=True)]
        return bodies, np.broadcast_to(np.arange(bodies.size).reshape(own), self.shape).ravel()


TILE = 1 << 18
"""Number of cells examined at a time, when all cells are."""

BODY = tuple(p.name for p in PARAMETERS.values() if p.section in ("body", ""))
"""Names of the parameters of the body, including gravity."""


def distinct(grid: Grid, names: tuple[str, ...]) -> Iterator[dict[str, Array]]:
    """Yield columns of cells with every combination of the parameters `names`, a bounded number of cells at a time."""
    grid = replace(grid, axes={n: v if n in names else v[:1] for n, v in grid.axes.items()})
    return (grid.part(tile).columns() for tile in grid.tiles(TILE))
