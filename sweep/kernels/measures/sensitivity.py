"""Tells how far a count can be trusted: a cell is run again from a start 1e-10 apart, in steps of other length.

Where the motion is chaotic, or a spin comes close to a critical one, differences of this size decide how often the spin
reverses, and no integration knows the count.  The second run costs as much as the first.  Following the linearised flow
instead would cost more: every right-hand side once again, and its derivative.

The kernel has nothing to do for it; the engine makes the runs (`sweep.engine.checks`).
"""

from __future__ import annotations

from dataclasses import dataclass

from sweep.kernels.measures.measurement import Measurement, measured
from sweep.models.model import COUNT
from sweep.units import NUMBER

SHORTER = 0.8
"""Ratio of the steps of further runs to those of the first, so that a count that depends on the step shows too."""


@dataclass(frozen=True)
class Sensitivity(Measurement):
    name = "sensitivity"
    summary = "range of counts that K runs from starts 1e-10 apart give: {sensitivity: K}, by default K = 1"
    asks = COUNT
    needs = ("reversals",)
    variables = {
        "reversals_low": measured("int16", NUMBER, "fewest spin reversals from starts 1e-10 apart"),
        "reversals_high": measured("int16", NUMBER, "most spin reversals from starts 1e-10 apart"),
    }  # fmt: skip
    bounds = (1, 100)
    count: int = 1
    """K, the number of runs beside the first."""

    @property
    def cost(self) -> float:
        return 1 + self.count / SHORTER
