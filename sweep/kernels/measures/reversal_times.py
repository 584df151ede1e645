"""The times of the first K reversals, K from the configuration: `measure: [reversals, {reversal_times: 12}]`.

After a step only the latest times are shifted along; a check moves them to their places.  Written in every step, five
times or more kept LLVM from vectorising the loop over lanes: 115 ns a step and lane in place of 21.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sweep.jit import inline
from sweep.kernels.layout import LANES, Layout, Table
from sweep.kernels.measures.measurement import Measurement, measured
from sweep.models.model import Array, Columns, Model, Offer
from sweep.models.slow.estimate import Ending
from sweep.units import TIME

LATEST = ("newest_reversal", "second_newest_reversal", "third_newest_reversal")
"""If there are more than three reversals between two checks, which are windows apart, the earlier ones have no time."""


@dataclass(frozen=True)
class ReversalTimes(Measurement):
    name = "reversal_times"
    summary = "times of the first K reversals: {reversal_times: K}, by default K = 10"
    asks = Offer.SPIN
    needs = ("reversals",)
    variables = {"reversal_times": measured("float64", TIME, "time of each spin reversal", along=("reversal",))}
    bounds = (1, 1000)
    count: int = 10
    """K, the number of reversals whose times are kept."""

    @property
    def times(self) -> tuple[str, ...]:
        """The quantities that hold the K times."""
        return tuple(f"reversal_time{k}" for k in range(self.count))

    @property
    def quantities(self) -> tuple[str, ...]:
        return (*LATEST, "recorded", *self.times)

    def start(self, model: Model, columns: Columns, rattle: Array) -> Mapping[str, Array | float]:
        return dict.fromkeys((*LATEST, *self.times), np.nan)

    def make_at_reversal(self, layout: Layout):
        NEWEST, SECOND, THIRD = map(layout.at, LATEST)

        @inline
        def at_reversal(group, lane, reverses, count, crossing):
            newest, second = group[NEWEST + lane], group[SECOND + lane]
            group[THIRD + lane] = second if reverses else group[THIRD + lane]
            group[SECOND + lane] = newest if reverses else second
            group[NEWEST + lane] = crossing if reverses else newest

        return at_reversal

    def make_check(self, layout: Layout):
        COUNT, RECORDED, FIRST, NEWEST = map(layout.at, ("reversals", "recorded", self.times[0], LATEST[0]))
        most, kept = self.count, len(LATEST)

        @inline
        def check(group, lane, seen):
            count = int(group[COUNT + lane])
            for k in range(int(group[RECORDED + lane]), min(count, most)):
                age = count - 1 - k
                group[FIRST + k * LANES + lane] = group[NEWEST + age * LANES + lane] if age < kept else np.nan
            group[RECORDED + lane] = count

        return check

    def read(self, table: Table, times: Array, left: Ending) -> Mapping[str, Array]:
        return {"reversal_times": table.columns(self.times)}
