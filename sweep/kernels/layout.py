"""Define where the quantities of a trajectory are: in a table of state rows, and in the group of lanes of a thread.

In the table each trajectory has a row, so that a quantity is a column.  A group is transposed: there a quantity is a
row, with one value per lane.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from traceback import extract_stack
from typing import Any

from sweep.faults import CompileError, suggestion
from sweep.jit import INTERPRETED
from sweep.models.model import Array, Model
from sweep.models.theory.stability import StableRanges

# Time per step and lane on one thread of a Zen 5 (slip model, AVX-512): 22.4 ns with 16 lanes, 24.2 ns with 8,
# 24.4 ns with 32.  In plain Python idle lanes would cost as much as the others.
LANES = 1 if INTERPRETED else 16

# A group computes a whole number of packs.
PACK = 1 if INTERPRETED else 8

# Steps between two checks at a lane.  With 128, checks add 1 % to the cost of a step on the slip model, and a
# trajectory that has settled runs on for 64 steps on average, out of 10^5.
BLOCK = 128


STABLE = tuple(f"stable.{name}" for name in StableRanges._fields)
"""The ranges of spin in which the rattle decays."""

# A spin beyond n_c1 by less than this factor can reverse no more, although the rattle grows there.
BEYOND = 1.5


@dataclass(frozen=True)
class Layout:
    """The names of the quantities of a state row, in order."""

    names: tuple[str, ...]
    model: Any = None
    """The model whose states and constants are among them."""

    @cached_property
    def _places(self) -> dict[str, int]:
        return {name: place for place, name in enumerate(self.names)}

    def __contains__(self, name: str) -> bool:
        return name in self._places

    def index(self, name: str) -> int:
        """Index of a quantity: its column in the table of state rows, and its row in a group.

        Raises
        ------
        CompileError
            if there is none of this name; it gives the place of whoever asked.
        """
        if name not in self._places:
            asked = next(each for each in reversed(extract_stack()) if each.filename != __file__)
            reason = f"no quantity {name!r} in the state rows{suggestion(name, self.names)}"
            raise CompileError([(asked.filename, asked.lineno or 1)], reason)
        return self._places[name]

    def at(self, name: str) -> int:
        """Index at which the lanes of a quantity begin in a group, taken as one array."""
        return self.index(name) * LANES


def constants_of(model: Model) -> tuple[str, ...]:
    """Names of the quantities that hold the constants of a model."""
    return tuple(f"constant.{name}" for name in model.constants._fields)


@dataclass(frozen=True)
class Table:
    """State rows, accessed by the names of their quantities: `table["spin"]` is a view of shape (cells,)."""

    rows: Array
    """Shape (cells, quantities)."""
    layout: Layout

    def __getitem__(self, name: str) -> Array:
        column: Array = self.rows[:, self.layout.index(name)]
        return column

    def __setitem__(self, name: str, values: Array | float) -> None:
        self.rows[:, self.layout.index(name)] = values

    def columns(self, names: Iterable[str]) -> Array:
        """A copy of several quantities, shape (cells, names)."""
        columns: Array = self.rows[:, [self.layout.index(name) for name in names]]
        return columns

    def set_columns(self, names: Iterable[str], values: Array | float) -> None:
        """Set several quantities to `values`, of shape (cells, names) or one number for all."""
        self.rows[:, [self.layout.index(name) for name in names]] = values
