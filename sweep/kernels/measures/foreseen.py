"""The count by the slow equations (`sweep.models.ladder.slow`), for comparison with the simulated count."""

from __future__ import annotations

from sweep.kernels.measures.measurement import Measurement
from sweep.models.model import ENDING
from sweep.units import NUMBER
from sweep.variables import Variable


class Foreseen(Measurement):
    """Predict the count; nothing is measured in the kernel."""

    name = "foreseen"
    summary = "reversals by the slow equations, without the oscillations, and whether they are sure"
    asks = ENDING
    variables = {
        "reversals_foreseen": Variable(
            "int16", NUMBER, "spin reversals, foreseen", "Spin reversals by the slow equations of the `slow` model."
        ),
        "foreseen_sure": Variable(
            "int8", NUMBER, "is the foreseen count sure?",
            "Whether the foreseen count stays if terms of higher order change by a third and the start spin by 3 %.",
            {0: "unsure", 1: "sure"},
        ),
    }  # fmt: skip

    @property
    def cost(self) -> float:
        return 1.2
