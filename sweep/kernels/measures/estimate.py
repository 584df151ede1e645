"""The count by the slow equations (`sweep.models.ladder.slow`), for comparison with the simulated count."""

from __future__ import annotations

from sweep.kernels.measures.measurement import Kind
from sweep.models.model import Offer
from sweep.units import NUMBER
from sweep.variables import Variable


class Estimate(Kind):
    """Predict the count; nothing is measured in the kernel."""

    name = "estimate"
    summary = "reversals by the slow equations, without the oscillations, and whether they are certain"
    asks = Offer.ENDING
    exact = False
    variables = {
        "reversals_estimated": Variable(
            "int16", NUMBER, "spin reversals, estimated", "Spin reversals by the slow equations of the `slow` model."
        ),
        "estimate_certain": Variable(
            "int8", NUMBER, "is the estimated count certain?",
            "Whether the estimated count stays if terms of higher order change by a third and the start spin by 3 %.",
            {0: "uncertain", 1: "certain"},
        ),
    }  # fmt: skip

    @property
    def cost(self) -> float:
        return 1.2
