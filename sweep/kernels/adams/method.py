"""The record of the stiff method, and the step that a tolerance requires."""

from __future__ import annotations

import numpy as np

from sweep.kernels.adams.kernel import AdamsKernel
from sweep.kernels.method import Method
from sweep.models import friction, slip, slip_split
from sweep.models.ellipsoid import inertia
from sweep.models.model import Array, Columns

# A model of the error in spin at t = 400.  `_ERROR` is twice the error at h ν = 0.274 (h = 0.125) in a case where the
# rattle raises R by a quarter (a = 10, b = 3, n0 = 0.05).  From there the error varies as the seventh power of h ν, as
# the power 4.5 of the rise in R, and, below μ = 60, where the slip does not relax fast within a step, as 1/μ^1.5.
_ERROR, _PHASE, _RISE, _GRIP = 1e-6, 0.274, 0.25, 60.0
_LONGEST_PHASE = 0.45


def accurate_step(columns: Columns, tolerance: float) -> Array:
    """Step, in sqrt(c/g), that keeps the error in spin at t = 400 within `tolerance`, shape (cells,)."""
    nu = slip_split.fastest_rocking(slip_split.Constants.of(columns))
    I1, I2, _ = inertia(columns)
    at_rest = 1 + columns["c"] ** 2 / np.minimum(I1, I2)
    rise = np.maximum(slip.strongest_grip(columns) / at_rest - 1, 0.02)
    resistance = np.maximum(friction.strongest_resistance(columns) * np.sqrt(columns["c"]), 1.0)
    error = _ERROR * (rise / _RISE) ** 4.5 * np.maximum(_GRIP / resistance, 1.0) ** 1.5
    return np.asarray(np.minimum(_PHASE * (tolerance / error) ** (1 / 7), _LONGEST_PHASE) / nu)


METHOD = Method(
    name="adams",
    summary="Adams formulas of orders eight and nine for the slow variables and BDF5 for the slip, for the slip model: "
    "friction does not limit its step",
    kernel=lambda model, measurements, tolerance: AdamsKernel(measurements, tolerance),  # noqa: ARG005
    accurate_step=lambda model, columns, tolerance: accurate_step(columns, tolerance),  # noqa: ARG005
    models=frozenset({slip.MODEL.name}),
    # On one thread start-up takes 4.6 to 6.4 µs, and a step of dopri5 22 ns.
    step_cost=0.64,
    start_up_cost=390.0,
)
