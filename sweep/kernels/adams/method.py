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

# Two bounds on the error in spin at t = 400.  The first is that of the Adams formulas, the second that of BDF5, which
# matters where the slip does not relax fast.  θ is the phase of the fastest motion in a step, ρ the share by which the
# rattle may raise the decay rate of the slip, n the fastest spin within reach, μ the resistance of friction:
#
#     7.6 θ⁷ ρ^1.54 (1 + ρ)^1.6 n^0.45,    0.074 θ⁴ ρ^0.81 n^1.01 min(1, 30/μ)²
#
# They are the 97 % quantiles, by linear programming, of the errors of 300 cells from a wide domain
# (data/reference_wide.csv) at twelve steps each, with μ > 30 and μ < 30; the power of 1 + ρ is raised from 0.65, as the
# worst cells have large rattles.  A cell scatters about them by a factor of
# ten, whatever else is taken into account: how strongly an error grows is decided by the motion itself.
_LONGEST_PHASE = 0.4


def accurate_step(model: Model, columns: Columns, motion: Array, tolerance: float) -> Array:
    """Step that keeps the error in spin at t = 400 sqrt(c/g) within `tolerance`, in the model's units, shape (cells,).

    Parameters
    ----------
    motion : the `fastest_motion`, shape (cells,)
    """
    form = forms.of(model)
    assert form is not None
    rise = np.maximum(form.rise(columns), 1e-6)
    reach = np.maximum(linear.fastest_spin(form.full, columns) * form.time_unit(columns), 1e-6)
    adams = 7.6 * rise**1.54 * (1 + rise) ** 1.6 * reach**0.45
    bdf = 0.074 * rise**0.81 * reach**1.01 * np.minimum(1, 30 / np.maximum(form.resistance(columns), 30)) ** 2
    phase = np.minimum((tolerance / adams) ** (1 / 7), (tolerance / bdf) ** (1 / 4))
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
    # On one thread start-up takes 4.6 to 6.4 µs, and a step of dopri5 22 ns.
    step_cost=0.64,
    start_up_cost=390.0,
    compile_seconds=14.0,
    foresight=WORTHWHILE,
)
