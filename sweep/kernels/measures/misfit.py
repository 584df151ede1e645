"""The misfit of a trajectory to a film: the sum of squares of (computed - seen) / error over the film's instants.

The engine computes it from samples once the trajectories have ended (`sweep.engine.misfits`).
"""

from __future__ import annotations

from dataclasses import dataclass

from sweep.kernels.measures.measurement import Measurement, measured
from sweep.models.model import SPIN
from sweep.units import NUMBER


@dataclass(frozen=True)
class Misfit(Measurement):
    name = spec = "misfit"
    summary = "sum of squares of (spin - film) / error over the instants of a film: {misfit: film.csv}"
    asks = SPIN
    variables = {
        "misfit": measured(
            "float64", NUMBER, "misfit of the film",
            "Sum of squares of (spin - film) / error over the instants of the film.",
        )
    }  # fmt: skip
