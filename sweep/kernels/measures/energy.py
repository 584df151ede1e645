"""The energy balance: the work of friction must account for all the energy lost.

dE/dt = -μ R |v_p|² holds exactly, so a violation is an error that a run measures by itself.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sweep.jit import inline
from sweep.kernels.layout import BLOCK, Layout, Table
from sweep.kernels.measures.measurement import Measurement, Sample, Stretch, measured
from sweep.models.model import Array, Offer
from sweep.models.slow.estimate import Ending
from sweep.units import ENERGY_PER_MASS, NUMBER
from sweep.variables import Variable


class EnergyError(Measurement):
    name = "energy_error"
    summary = "largest violation of the energy balance: an error that a run measures by itself"
    asks = Offer.ENERGY
    by_default = True
    exact = False
    work = True
    quantities = ("work", "violation")

    variables = {
        "energy_error": measured(
            "float64", NUMBER, "largest error of the energy, relative",
            f"Largest violation of the energy balance, checked every {BLOCK} steps, relative to the start energy above "
            "rest.",
        )
    }  # fmt: skip
    series = {
        "energy": Variable("float64", ENERGY_PER_MASS, "energy above rest per mass"),
        "dissipated": Variable("float64", ENERGY_PER_MASS, "work against friction per mass"),
    }

    def make_step(self, layout: Layout, at_reversal):
        DISSIPATED = layout.at("work")

        @inline
        def step(group, lane, taken):
            group[DISSIPATED + lane] += taken.work if taken.accepted else 0.0

        return step

    def make_check(self, layout: Layout):
        DISSIPATED, VIOLATION, START = map(layout.at, (*self.quantities, "energy_start"))

        @inline
        def check(group, lane, seen):
            violation = abs(seen.total + group[DISSIPATED + lane] - group[START + lane])
            worst = group[VIOLATION + lane]
            group[VIOLATION + lane] = violation if violation > worst else worst

        return check

    def skip(self, table: Table, stretch: Stretch) -> None:
        table["work"] += stretch.work

    def sample(self, table: Table, seen: Sample) -> Mapping[str, Array]:
        return {"energy": seen.total, "dissipated": table["work"]}

    def read(self, table: Table, times: Array, left: Ending) -> Mapping[str, Array]:
        start, violation = table["energy_start"], table["violation"]
        return {"energy_error": np.divide(violation, start, out=violation.copy(), where=start > 0)}
