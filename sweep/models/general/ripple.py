"""The ripple-free spin of any rigid body: that of `sweep.models.theory.ripple`, generalised.

With h = c - offset, the height of the centre of mass, and without slip at n = 0, to second order in the rattle,

    d(M · u)/dt = -h (s1 - s2) ω1 ω2,
    M · u = J33 n + P,   P = Σ u_i (J_ij + (h² - J33 - h s_i) δ_ij) ω_j

with the radii of curvature s at the lowest point; for the ellipsoid they are a²/c and b²/c.

P is a ripple.  The right-hand side of the first line and P become forms of u and the angular momentum M about the
contact point, which is not affected by friction, and the rest is as it is there.

If the third axis of the ellipsoid is no axis of inertia, the spin ripples in first order too: n = (M · u + J13 ω1 + J23
ω2) / J33.  Only this ripple is taken away then.
"""

from __future__ import annotations

import numpy as np

from sweep.jit import inline
from sweep.models.general import rigid_body
from sweep.models.general.surfaces import ELLIPSOID, Surface
from sweep.models.model import Array, Columns, stack
from sweep.models.theory.ripple import FORM, for_each_body, matrix, ripple, ripple_free

NAMES = (*FORM, "P11", "P12", "P22", "h", "turn1", "turn2", "J13", "J23")


def form(columns: Columns, surface: Surface = ELLIPSOID) -> tuple[Array, ...]:
    """Values of `NAMES`, each of shape (cells,): K, the matrix P of M = P ω at rest, and what M has of n, v and n."""
    body = {name: columns[name] for name in rigid_body.PARAMETERS if name in columns}
    return for_each_body(lambda bodies: _form(bodies, surface), body)


def _form(columns: Columns, surface: Surface) -> tuple[Array, ...]:
    J11, J22, J33, J12, J13, J23 = rigid_body.inertia(columns)
    h, (k1, k2) = rigid_body.height(columns), rigid_body.stiffness(columns, surface)
    s1, s2 = k1 + h, k2 + h
    P = matrix(J11 + h**2, J12, J12, J22 + h**2)
    omega = np.linalg.inv(P)
    G = matrix(0.0, -0.5 * h * (k1 - k2), -0.5 * h * (k1 - k2), 0.0)
    of_P = matrix(J11 + h**2 - J33 - h * s1, J12, J12, J22 + h**2 - J33 - h * s2)
    K = stack(ripple_free(rigid_body.rocking(columns, surface), omega @ G @ omega, of_P @ omega, J33))
    # Without two modes there is no slower period to average over.
    K[:, (k1 <= 0) | (k2 <= 0) | (J13 != 0) | (J23 != 0)] = 0
    return *K, J11 + h**2, J12, J22 + h**2, h, h * s1, h * s2, J13 / J33, J23 / J33


@inline
def slipping(y, p, k):
    """n - n*, with M to first order in the rattle."""
    u1, u2, w1, w2, w3, v1, v2 = y
    M1 = k[4] * w1 + k[5] * w2 + k[7] * v2 + k[8] * w3 * u1
    M2 = k[5] * w1 + k[6] * w2 - k[7] * v1 + k[9] * w3 * u2
    return ripple(u1, u2, M1, M2, k) + k[10] * w1 + k[11] * w2


@inline
def rolling(y, p, k):
    """As `slipping`, without slip."""
    u1, u2, w1, w2, w3 = y
    return slipping((u1, u2, w1, w2, w3, 0.0, 0.0), p, k)
