"""The ripple-free spin of any rigid body: that of `sweep.models.theory.ripple`, generalised.

With the height h of the centre of mass and the matrix S of the radii of curvature at the lowest point, and without slip
at n = 0, to second order in the rattle,

    d(M · u)/dt = h (S12 (ω1² - ω2²) - (S11 - S22) ω1 ω2),
    M · u = J33 n + P,   P = Σ u_i ((J_ii + h² - J33) δ_ij - h S_ij) ω_j.

P is a ripple.  The right-hand side of the first line and P become forms of u and the angular momentum M about the
contact point, which is not affected by friction, and the rest follows as there.

If the third axis of the surface is not an axis of inertia, the spin ripples in first order too: n = (M · u + J13 ω1 +
J23 ω2) / J33.  Then only this ripple is removed.
"""

from __future__ import annotations

import numpy as np

from sweep.jit import inline
from sweep.models.general import rigid_body
from sweep.models.general.surfaces import Surface
from sweep.models.model import Array, Columns, Ripple, stack
from sweep.models.theory.ripple import FORM, for_each_body, matrix, ripple, ripple_free, ripple_of_states

MOMENTUM = ("P1", "P2", "h", "R11", "R12", "R22")
"""Coefficients of M = P ω + h (v2, -v1) + ω3 R u, to first order in the rattle, with R = h S."""

TURN = ("turn1", "turn2", "W11", "W12", "W22")
"""J13 / J33, J23 / J33, and the inverse of P without spin, for bodies whose third axis is not an axis of inertia."""


def of_velocities(surface: Surface, *, skew: bool) -> Ripple:
    """The ripple of the spin from states that begin with those of `slip`."""

    @inline
    def value(y, p, k):
        u1, u2, w1, w2, w3, v1, v2 = y[:7]
        M1 = k[4] * w1 + k[6] * v2 + w3 * (k[7] * u1 + k[8] * u2)
        M2 = k[5] * w2 - k[6] * v1 + w3 * (k[8] * u1 + k[9] * u2)
        return ripple(u1, u2, M1, M2, k)

    @inline
    def skew_value(y, p, k):
        return value(y, p, k) + k[10] * y[2] + k[11] * y[3]

    names = (*FORM, *MOMENTUM, *(TURN if skew else ()))
    return Ripple(names, lambda columns: _form(columns, surface)[: len(names)], skew_value if skew else value)


def of_momenta(surface: Surface, *, skew: bool) -> Ripple:
    """The ripple of the spin from the states of `sweep.models.stiff.form`."""

    @inline
    def skew_value(y, p, k):
        u1, u2, M1, M2, M3, v1, v2 = y
        w3 = M3 / p.J33
        m1 = M1 - k[6] * v2 - w3 * (k[7] * u1 + k[8] * u2) - k[10] * M3
        m2 = M2 + k[6] * v1 - w3 * (k[8] * u1 + k[9] * u2) - k[11] * M3
        turning = k[10] * (k[12] * m1 + k[13] * m2) + k[11] * (k[13] * m1 + k[14] * m2)
        return ripple(u1, u2, M1, M2, k) + turning

    names = (*FORM, *MOMENTUM, *TURN) if skew else FORM
    return Ripple(
        names, lambda columns: _form(columns, surface)[: len(names)], skew_value if skew else ripple_of_states
    )


def _form(columns: Columns, surface: Surface) -> tuple[Array, ...]:
    """Values of `FORM`, `MOMENTUM` and `TURN`, each of shape (cells,)."""
    body = {name: columns[name] for name in rigid_body.PARAMETERS if name in columns}
    return for_each_body(lambda bodies: _of_bodies(bodies, surface), body)


def _of_bodies(columns: Columns, surface: Surface) -> tuple[Array, ...]:
    p = rigid_body.constants(columns, surface)
    k11, k12, k22, h = surface.stiffness(p)
    P1, P2 = p.J11 + h**2, p.J22 + h**2
    R11, R12, R22 = h * (k11 + h), h * k12, h * (k22 + h)
    off = (R22 - R11) / (2 * P1 * P2)
    H = matrix(R12 / P1**2, off, off, -R12 / P2**2)
    of_P = matrix((P1 - p.J33 - R11) / P1, -R12 / P2, -R12 / P1, (P2 - p.J33 - R22) / P2)
    rocking = rigid_body.rocking(columns, surface)
    K = stack(ripple_free(rocking, H, of_P, p.J33))
    # Without two modes there is no slower period to average over.
    K[:, (np.minimum(*rigid_body.stiffness(columns, surface)) <= 0) | (p.J13 != 0) | (p.J23 != 0)] = 0
    turn = p.J13 / p.J33, p.J23 / p.J33, -rocking.B21, -rocking.B22, rocking.B12
    return *K, P1, P2, h, R11, R12, R22, *turn
