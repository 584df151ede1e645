"""Measure how regularly the spin reverses: the mean length of a cycle, and how much cycles differ.

A cycle is the time from one reversal to the second after it, when the spin changes sign in the same sense.  Single
intervals would not do: the two modes grow at different rates, so that those of the two senses differ even in motion
that is perfectly periodic.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sweep.jit import inline
from sweep.kernels.layout import Layout, Table
from sweep.kernels.measures.measurement import Measurement, measured
from sweep.models.model import SPIN, Array
from sweep.units import NUMBER, TIME


class Cycles(Measurement):
    name = "cycles"
    summary = "mean time between a reversal and the second after it, and how much these times vary"
    asks = SPIN
    needs = ("reversals",)
    quantities = ("cycle_newest", "cycle_before", "cycle_first", "cycle_sum", "cycle_squares")

    variables = {
        "cycle_mean": measured(
            "float64", TIME, "mean time of a cycle", "Mean time from a spin reversal to the second after it."
        ),
        "cycle_variation": measured(
            "float64", NUMBER, "variation of the cycles",
            "Standard deviation of the times from a reversal to the second after it, divided by their mean.",
        ),
    }  # fmt: skip

    def make_at_reversal(self, layout: Layout):
        NEWEST, BEFORE, FIRST, SUM, SQUARES = map(layout.at, self.quantities)

        @inline
        def at_reversal(group, lane, reverses, count, crossing):
            newest, before, first = group[NEWEST + lane], group[BEFORE + lane], group[FIRST + lane]
            length = crossing - before
            begins, counts = reverses & (count == 3.0), reverses & (count > 2.5)
            first = length if begins else first
            # Of lengths that hardly differ, a sum of squares would lose the difference.
            longer = length - first
            group[FIRST + lane] = first
            group[SUM + lane] += longer if counts else 0.0
            group[SQUARES + lane] += longer * longer if counts else 0.0
            group[BEFORE + lane] = newest if reverses else before
            group[NEWEST + lane] = crossing if reverses else newest

        return at_reversal

    def read(self, table: Table, times: Array) -> Mapping[str, Array]:
        number = table["reversals"] - 2
        with np.errstate(divide="ignore", invalid="ignore"):
            longer = table["cycle_sum"] / number
            mean = np.where(number >= 1, table["cycle_first"] + longer, np.nan)
            spread = table["cycle_squares"] / number - longer**2
            variation = np.sqrt(np.maximum(spread, 0) * number / (number - 1)) / mean
        return {"cycle_mean": mean, "cycle_variation": np.where(number >= 2, variation, np.nan)}
