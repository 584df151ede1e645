"""A run that draws samples in rounds, until it knows every probability as closely as asked."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr

from sweep.config import Config
from sweep.engine.enlarged import Earlier, Enlarged
from sweep.grid import SAMPLE
from sweep.results.dataset import with_probabilities
from sweep.results.store import Store

FIRST = 64
"""Samples of the first round; each further one doubles their number."""


class Sampled(Enlarged):
    """The samples of all rounds so far; an earlier run may have had some of them."""

    def __init__(self, config: Config, store: Store, earlier: Earlier | None) -> None:
        self._most = config.samples or 1
        super().__init__(config, store, earlier or Earlier(xr.Dataset(), np.full(config.grid.size, -1)))
        known = (self.earlier.cells >= 0).reshape(-1, self._most).all(axis=0)
        self._rows = int(np.argmin(known)) if not known.all() else self._most
        """Samples of all rounds; at first those that the earlier run has."""

    def grow(self, tile_size: Callable[[int], int]) -> bool:
        """Add the samples of the next round.  False if every probability is known closely enough, or there are no more.

        `tile_size` as for `Whole.grow`.
        """
        row = np.arange(self.grid.size) % self._most
        while self._rows < self._most and not (self._rows and self._narrow()):
            before, self._rows = self._rows, min(max(FIRST, 2 * self._rows), self._most)
            missing = (self.earlier.cells < 0) & (before <= row) & (row < self._rows)
            if self._add(np.flatnonzero(missing), tile_size):
                return True
        return False

    def dataset(self) -> xr.Dataset:
        """The labelled dataset over the samples of all rounds, in memory."""
        found = super().dataset()
        if "verified_cell" in found:
            cell = found["verified_cell"]
            found["verified_cell"] = (cell // self._most * self._rows + cell % self._most).assign_attrs(cell.attrs)
        return found

    def labelled(self) -> xr.Dataset:
        """Label the samples of all rounds, without a check of some of them."""
        found = super().labelled().isel({SAMPLE: slice(self._rows)})
        return with_probabilities(self.config, found.drop_dims("count"))

    def _narrow(self) -> bool:
        found = self.labelled()
        width = found["probability_high"] - found["probability_low"]
        return not (width > 2 * (self.config.until or 1)).any()
