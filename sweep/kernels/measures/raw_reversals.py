"""Raw reversals: every change of sign of the spin from one step to the next, including those due to the ripple."""

from __future__ import annotations

from collections.abc import Mapping

from sweep.jit import inline
from sweep.kernels.layout import Layout, Table
from sweep.kernels.measures.measurement import Measurement, Stretch, measured
from sweep.models.model import COUNT, Array, Columns, Model
from sweep.units import NUMBER


class RawReversals(Measurement):
    name = "raw_reversals"
    summary = "number of sign changes of the spin itself, which ripples with the rattle"
    asks = COUNT
    quantities = ("raw_reversals", "earlier_spin")

    variables = {"raw_reversals": measured("int16", NUMBER, "sign changes of the spin, with ripple")}

    def start(self, model: Model, columns: Columns, rattle: Array) -> Mapping[str, Array | float]:
        spin, _, _ = model.energy(model.start(columns), model.constants.of(columns))
        return {"earlier_spin": spin}

    def make_step(self, layout: Layout, at_reversal):
        COUNT, EARLIER = map(layout.at, self.quantities)

        @inline
        def step(group, lane, taken):
            earlier = group[EARLIER + lane]
            group[COUNT + lane] += 1.0 if taken.accepted & (taken.spin * earlier < 0.0) else 0.0
            group[EARLIER + lane] = taken.spin if taken.accepted else earlier

        return step

    def skip(self, table: Table, stretch: Stretch) -> None:
        table["raw_reversals"] += stretch.spin * table["earlier_spin"] < 0
        table["earlier_spin"] = stretch.spin
