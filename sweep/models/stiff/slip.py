"""The slip model in variables in which only the slip is stiff.

The angular momentum about the contact point, M = I ω - x_p × v_g, takes the place of ω.  Neither friction
nor the normal force appears in

    u' = u × ω,   M' = s × v_g - ω × M - u × x_p,   s = v_0 - x_p',   v_g = v_p + v_0,

because forces at the contact point have no torque about it.  Here ω = I_P⁻¹ (M + x_p × v_p) with
I_P = I + |x_p|² - x_p x_pᵀ.  Friction appears only in the equation for the slip,

    v_p' = R G - rest,   G = T (u - μ v_p),   T = 1 - [x_p] I⁻¹ [x_p],   R = num / den,   den = u · G,

where [x_p] is the matrix of the cross product.  This is a 2 × 2 system, which an implicit formula solves by one
Newton step.  The motion is the same as in `slip`.

With a = A u, r² = u · a and D_i = I_i r² + |a|², one has r² I_P = D - a aᵀ.  The Sherman-Morrison formula inverts this
without a root or a quotient, so that a single division yields 1/r, 1/u3 and I_P⁻¹.
"""

from __future__ import annotations

import numpy as np

from sweep.jit import inline
from sweep.models import ellipsoid
from sweep.models.ladder import slip
from sweep.models.model import Array, Columns, Ripple, named, zeros
from sweep.models.stiff.form import StiffForm, in_momentum, newton_step, slopes
from sweep.models.theory.ripple import FORM, form, ripple_of_states
from sweep.models.theory.rocking import rocking


class Constants(named("I1", "I2", "I3", *slip.Constants._fields)):  # type: ignore[misc]
    """The moments of inertia and the constants of the slip model."""

    @classmethod
    def of(cls, columns: Columns) -> Constants:
        return cls(*ellipsoid.inertia(columns), *slip.Constants.of(columns))


@inline
def momentum(y, p):
    """The states (u1, u2, M1, M2, M3, v1, v2) from those of the slip model; `p` are `Constants`."""
    u1, u2, w1, w2, w3, v1, v2 = y
    u3 = -np.sqrt(1.0 - (u1 * u1 + u2 * u2))
    a1, a2, a3 = p.A11 * u1 + p.A12 * u2, p.A12 * u1 + p.A22 * u2, p.A33 * u3
    r = np.sqrt(u1 * a1 + u2 * a2 + u3 * a3)
    x, y_, z = -a1 / r, -a2 / r, -a3 / r
    v3 = -(v1 * u1 + v2 * u2) / u3
    g1, g2, g3 = v1 + y_ * w3 - z * w2, v2 + z * w1 - x * w3, v3 + x * w2 - y_ * w1
    M1, M2, M3 = p.I1 * w1 - (y_ * g3 - z * g2), p.I2 * w2 - (z * g1 - x * g3), p.I3 * w3 - (x * g2 - y_ * g1)
    return u1, u2, M1, M2, M3, v1, v2


@inline
def slow(u1, u2, M1, M2, M3, v1, v2, p):
    """The slow derivatives (u1', u2', M1', M2', M3'), and the `Geometry` that `newton` needs."""
    A11, A12, A22, A33 = p.A11, p.A12, p.A22, p.A33
    c3 = 1.0 - (u1 * u1 + u2 * u2)
    u3 = -np.sqrt(c3)
    a1, a2, a3 = A11 * u1 + A12 * u2, A12 * u1 + A22 * u2, A33 * u3
    r2 = u1 * a1 + u2 * a2 + A33 * c3
    r = np.sqrt(r2)
    b1, b2, b3 = a1 * a1, a2 * a2, a3 * a3
    square = b1 + b2 + b3
    D1, D2, D3 = p.I1 * r2 + square, p.I2 * r2 + square, p.I3 * r2 + square
    E1, E2, E3 = D2 * D3, D1 * D3, D1 * D2
    DD = D1 * E1
    det = DD - (b1 * E1 + b2 * E2 + b3 * E3)
    ru, Z = r * u3, det * DD
    shared = 1.0 / (ru * Z)
    inv_Z, of_Z = shared * ru, shared * Z
    minus_inv_r, inv_u3 = -(of_Z * u3), of_Z * r
    x, y, z = a1 * minus_inv_r, a2 * minus_inv_r, a3 * minus_inv_r

    t1, t2 = u1 * inv_u3, u2 * inv_u3
    v3 = -(v1 * t1 + v2 * t2)
    K1, K2, K3 = M1 + (y * v3 - z * v2), M2 + (z * v1 - x * v3), M3 + (x * v2 - y * v1)
    aEK = a1 * (E1 * K1) + a2 * (E2 * K2) + a3 * (E3 * K3)
    k = r2 * inv_Z
    w1, w2, w3 = (k * E1) * (det * K1 + a1 * aEK), (k * E2) * (det * K2 + a2 * aEK), (k * E3) * (det * K3 + a3 * aEK)

    du1, du2, du3 = u2 * w3 - u3 * w2, u3 * w1 - u1 * w3, u1 * w2 - u2 * w1
    dux = du1 * x + du2 * y + du3 * z
    dx = minus_inv_r * ((A11 * du1 + A12 * du2) - x * dux)
    dy = minus_inv_r * ((A12 * du1 + A22 * du2) - y * dux)
    dz = minus_inv_r * (A33 * du3 - z * dux)
    u, M, v, w, du = (u1, u2, u3), (M1, M2, M3), (v1, v2, v3), (w1, w2, w3), (du1, du2, du3)
    return slopes(u, M, v, (t1, t2), (x, y, z), w, du, (dx, dy, dz), 1.0)


@inline
def newton(u1, u2, v1, v2, geometry, p, gamma, b1, b2):
    x, y, z, w1, w2, w3 = geometry.x, geometry.y, geometry.z, geometry.w1, geometry.w2, geometry.w3
    i1, i2, i3 = p.inv_I1, p.inv_I2, p.inv_I3
    alpha = p.ratio1 * w2 * w3, p.ratio2 * w3 * w1, p.ratio3 * w1 * w2
    xx, yy, zz = x * x, y * y, z * z
    T11, T22, T33 = 1.0 + zz * i2 + yy * i3, 1.0 + zz * i1 + xx * i3, 1.0 + yy * i1 + xx * i2
    T12, T13, T23 = -(x * i3) * y, -(z * i2) * x, -(y * z) * i1
    return newton_step(u1, u2, v1, v2, geometry, alpha, (T11, T12, T13, T22, T23, T33), p.mu, 1.0, gamma, b1, b2)


@inline
def power(R, v1, v2, geometry, p):
    """Power of friction at a point with slip (v1, v2) and normal force R."""
    v3 = -(v1 * geometry.t1 + v2 * geometry.t2)
    return slip.dissipation(R, v1, v2, v3, p)


STIFF_MODEL = in_momentum(slip.MODEL, Constants, momentum, slow, Ripple(FORM, form, ripple_of_states))
"""The slip model in these variables, for methods that use `slow` and `newton` in place of a right-hand side."""


def _rise(columns: Columns) -> Array:
    I1, I2, _ = ellipsoid.inertia(columns)
    return np.asarray(slip.strongest_grip(columns) / (1 + columns["c"] ** 2 / np.minimum(I1, I2)) - 1)


PAPER_FORM = StiffForm(
    full=slip.MODEL,
    model=STIFF_MODEL,
    momentum=momentum,
    slow=slow,
    newton=newton,
    power=power,
    rocking=rocking,
    time_unit=lambda columns: np.sqrt(columns["c"]),
    slip_decay=lambda columns: 2.2 * columns["mu"] + 2.2,
    rise=_rise,
    damping=zeros,
)
