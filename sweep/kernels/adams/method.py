"""The record of the stiff method, and the step that a tolerance requires."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sweep.kernels.adams.kernel import AdamsKernel
from sweep.kernels.adams.stretches import WORTHWHILE
from sweep.kernels.measures.measurement import Measurement
from sweep.kernels.method import Method
from sweep.models.model import Array, Columns, Model
from sweep.models.stiff import forms
from sweep.models.theory import linear

# The error in spin at t = 400 is about n ρ θ⁶, within a factor of ten for most of 877 wide cells, where θ is the phase
# of the fastest motion in a step, ρ the share by which the rattle may raise the decay rate of the slip, and n the
# fastest spin within reach.  How strongly an error grows is decided by the motion itself, and found by the run
# (`sweep.engine.errors`).
_POWER = 6
_LONGEST_PHASE = 0.4


def accurate_step(model: Model, columns: Columns, motion: Array, tolerance: float) -> Array:
    """Step at which the error in spin at t = 400 sqrt(c/g) is about `tolerance`, in the model's units, shape (cells,).

    Parameters
    ----------
    motion : the `fastest_motion`, shape (cells,)
    """
    form = forms.of(model)
    assert form is not None
    rise, reach = form.rise(columns), linear.fastest_spin(form.full, columns) * form.time_unit(columns)
    phase = (tolerance / np.maximum(rise * reach, tolerance)) ** (1 / _POWER)
    return np.asarray(np.minimum(phase, _LONGEST_PHASE) / np.maximum(motion, form.damping(columns)))


def _kernel(model: Model, measurements: Sequence[Measurement], tolerance: float) -> AdamsKernel:
    form = forms.of(model)
    assert form is not None
    return AdamsKernel(form, measurements, tolerance)


METHOD = Method(
    name=AdamsKernel.method,
    code=1,
    summary="Adams formulas of orders eight and nine for the slow variables and BDF5 for the slip, for the slip model: "
    "friction does not limit its step",
    kernel=_kernel,
    accurate_step=accurate_step,
    runs=lambda model: forms.of(model) is not None,
    # On one thread start-up takes 8 to 11 µs, and a step of dopri5 22 ns.
    step_cost=0.64,
    start_up_cost=650.0,
    compile_seconds=14.0,
    companion=1.35,
    error_order=4,
    foresight=WORTHWHILE,
)
