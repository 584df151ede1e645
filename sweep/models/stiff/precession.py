"""How a circular rattle decays.

The two rocking frequencies of a nearly round body are nearly the same, and its rattle becomes circular: the contact
point runs round and round, and neither the spin nor the rattle ripples.  Only the little slip that such a motion needs
takes energy from it, which can last 10⁶ sqrt(c/g).  As the rattle is not small, the slow equations do not describe it
(`sweep.models.slow.estimate`).  But the contact force has no torque about the contact point, so that the angular
momentum about it along the vertical,

    d (M·u)/dt = h (S12 (ω1² - ω2²) - (S11 - S22) ω1 ω2),

changes by an amount that averages to zero while the contact point goes round (docs/explanation/reversal.md).  The spin
tends to M·u/J33 while the rattle decays.
"""

from __future__ import annotations

import numpy as np

from sweep.jit import inline


@inline
def vertical_spin(y, spin, rattle, inertia):
    """The spin M·u/J33 that would remain without rattle, and the square of the spin that would hold all the energy.

    `y` are the states of `stiff.slip`, and the other arguments are the results of its `energy`.  The results are in
    sqrt(g/c) and g/c. The second, less the square of the first, is the energy that a rattle can lose; it is the only
    one of the three without ripple.
    """
    u1, u2, M1, M2, M3, _, _ = y
    vertical = (u1 * M1 + u2 * M2 - np.sqrt(1.0 - u1 * u1 - u2 * u2) * M3) / inertia
    return vertical, 2.0 * rattle / inertia + spin * spin
