"""The time of the first reversal."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sweep.jit import inline
from sweep.kernels.layout import Layout, Table
from sweep.kernels.measures.measurement import Measurement, measured
from sweep.models.model import SPIN, Array, Columns, Model
from sweep.units import TIME


class FirstReversal(Measurement):
    name = "first_reversal"
    summary = "time of the first reversal"
    asks = SPIN
    needs = ("reversals",)
    quantities = ("first_reversal",)

    variables = {"t_first_reversal": measured("float64", TIME, "time of the first reversal")}

    def start(self, model: Model, columns: Columns, rattle: Array) -> Mapping[str, Array | float]:
        return {"first_reversal": np.nan}

    def make_at_reversal(self, layout: Layout):
        FIRST = layout.at("first_reversal")

        @inline
        def at_reversal(group, lane, reverses, count, crossing):
            first = reverses & (count == 1.0)
            group[FIRST + lane] = crossing if first else group[FIRST + lane]

        return at_reversal

    def read(self, table: Table, times: Array) -> Mapping[str, Array]:
        return {"t_first_reversal": table["first_reversal"]}
