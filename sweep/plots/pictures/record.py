"""Define the record of a picture: what it needs of a dataset, its axes, and how it is drawn."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import xarray as xr

from sweep.results.dataset import VARIABLES


@dataclass(frozen=True)
class Picture:
    """A way to show a variable of a dataset, or a quantity derived from its variables.

    A variable without a record has one of these defaults: a map over two axes, and curves or points over fewer.
    """

    name: str
    needs: tuple[str, ...] = ()
    """Variables and dimensions that a dataset must have; by default the variable of this name."""
    derive: Callable[[xr.Dataset], xr.DataArray] | None = None
    """Computes the quantity from the dataset; None for a variable of the dataset."""
    compares: tuple[str, ...] = ()
    """The simulated variable and its prediction, which are drawn next to this comparison of them."""
    together: tuple[str, ...] = ()
    """Dimensions that a panel shows together: they are an axis only on request.  On maps, each of the three values that
    vary most from cell to cell gets a panel."""
    draw: Callable[[Any, xr.Dataset, str], None] | None = None
    """Draws a panel with fewer than two axes: gets the axes of matplotlib, the part of the dataset, which includes the
    quantity, and the name of the horizontal axis or ""."""
    over_axis: bool = True
    """Whether `draw` draws over an axis of the dataset too.  Otherwise each value of the axes gets a panel."""
    scale: str = ""
    """Colour scale, a function of `sweep.plots.scales`; by default `counts` of integers and `continuous` of others."""
    words: Mapping[str, str] = field(default_factory=dict)
    """Legend entries for kinds of cell (`sweep.plots.marks.WORDS`).  The kinds `time_limit` and `uncertain` are marked
    only if they have an entry here."""
    theory: bool = False
    """Whether lines of theory explain it."""
    boundaries: bool = False
    """Whether boundaries of counts are drawn over it."""
    rank: int = 0
    """A dataset without a named picture shows the one of highest rank that it has; never one of rank 0."""

    @property
    def requires(self) -> tuple[str, ...]:
        """The variables and dimensions that a dataset must have."""
        return self.needs or (self.name,)

    @property
    def simulated(self) -> bool:
        """Whether a failed simulation leaves the cell without a value."""
        sound = (VARIABLES[name].of_sound_runs for name in self.requires if name in VARIABLES)
        return "time_limit" in self.words or any(sound)
