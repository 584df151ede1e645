"""Rolling without slip: the limit of infinite friction.  Energy is conserved.

The unknowns (u1, u2, ω1, ω2, ω3) are those of the slip model without the slip velocity: the contact point is at
rest, v_g = v_0 = x_p × ω, and the contact force is whatever keeps it so.  Eliminating this force gives

    I_P ω' = x_p × u - ω × I ω + x_p × (x_p' × ω + ω × v_0),   I_P = I + |x_p|² - x_p x_pᵀ,

a 3 × 3 system whose matrix is diagonal plus rank one, which the Sherman-Morrison formula solves.
"""

from __future__ import annotations

from collections import namedtuple
from functools import partial

from sweep.jit import inline
from sweep.models import attitude, ellipsoid
from sweep.models.ellipsoid import contact
from sweep.models.model import COUNT, ENERGY, REVERSAL_TIME, SPIN, Array, Columns, Model, Ripple
from sweep.models.theory.ripple import FORM, form, ripple
from sweep.models.theory.rocking import slower_period


class Constants(namedtuple("Constants", "A11 A12 A22 A33 inv_I1 inv_I2 inv_I3")):
    """Shape and inverse moments of inertia."""

    @classmethod
    def of(cls, columns: Columns) -> Constants:
        return cls(*ellipsoid.shape(columns), *(1 / moment for moment in ellipsoid.inertia(columns)))


@inline
def rhs(y, p):
    u1, u2, w1, w2, w3 = y
    (u3, _), (x, y_, z), (du1, du2, _), (dx, dy, dz) = contact(u1, u2, w1, w2, w3, p)
    I1, I2, I3 = 1.0 / p.inv_I1, 1.0 / p.inv_I2, 1.0 / p.inv_I3

    # s = v_0 - x_p', so that ω × s is dv_g/dt without the term in ω'
    s1, s2, s3 = y_ * w3 - z * w2 - dx, z * w1 - x * w3 - dy, x * w2 - y_ * w1 - dz
    # u + x_p' × ω + ω × v_0
    f1, f2, f3 = u1 + w2 * s3 - w3 * s2, u2 + w3 * s1 - w1 * s3, u3 + w1 * s2 - w2 * s1
    t1 = y_ * f3 - z * f2 - (I3 - I2) * w2 * w3
    t2 = z * f1 - x * f3 - (I1 - I3) * w3 * w1
    t3 = x * f2 - y_ * f1 - (I2 - I1) * w1 * w2

    square = x * x + y_ * y_ + z * z
    e1, e2, e3 = 1.0 / (I1 + square), 1.0 / (I2 + square), 1.0 / (I3 + square)
    g1, g2, g3 = e1 * x, e2 * y_, e3 * z
    shared = (g1 * t1 + g2 * t2 + g3 * t3) / (1.0 - (x * g1 + y_ * g2 + z * g3))
    dw1, dw2, dw3 = e1 * t1 + g1 * shared, e2 * t2 + g2 * shared, e3 * t3 + g3 * shared

    # R = (u + dv_g/dt) · u
    h1, h2, h3 = f1 + y_ * dw3 - z * dw2, f2 + z * dw1 - x * dw3, f3 + x * dw2 - y_ * dw1
    R = u1 * h1 + u2 * h2 + u3 * h3
    spin = u1 * w1 + u2 * w2 + u3 * w3
    return (du1, du2, dw1, dw2, dw3), (spin, 0.0, R, 1.0)


@inline
def energy(y, p):
    u1, u2, w1, w2, w3 = y
    return ellipsoid.energy((u1, u2, w1, w2, w3, 0.0, 0.0), p)


def ripple_coefficients(columns: Columns) -> tuple[Array, ...]:
    """K, I1 + c² and I2 + c²."""
    I1, I2, _ = ellipsoid.inertia(columns)
    return *form(columns), I1 + columns["c"] ** 2, I2 + columns["c"] ** 2


@inline
def _ripple(y, p, k):
    """K with M to first order in the rattle, which is all that K is good for."""
    u1, u2, w1, w2, w3 = y
    M1, M2 = k[4] * w1 + w3 * (p.A11 * u1 + p.A12 * u2), k[5] * w2 + w3 * (p.A12 * u1 + p.A22 * u2)
    return ripple(u1, u2, M1, M2, k)


def seen(contact, rhs, y: Array, p) -> dict[str, Array]:
    """Compute what a trajectory of any body shows beside spin and energy: contact point and normal force."""
    _, point, _, _ = contact(*y[:5], p)
    _, (_, _, R, _) = rhs(y, p)
    return {"contact_x": point[0], "contact_y": point[1], "normal_force": R}


MODEL = Model(
    name="noslip",
    summary="rolling without slip, the limit of infinite friction",
    states=("u1", "u2", "omega1", "omega2", "omega3"),
    spin_state=4,
    parameters=("a", "b", "c", "delta", "n0", "x0", "y0"),
    offers=frozenset({COUNT, SPIN, ENERGY, REVERSAL_TIME}),
    constants=Constants,
    start=ellipsoid.start,
    slower_period=slower_period,
    upright=lambda spin: (0.0, 0.0, 0.0, 0.0, -spin),
    rhs=rhs,
    energy=energy,
    tilt=ellipsoid.tilt,
    # Nothing damps an error: with 0.07 the energy drifts by a share of 2e-7 in t = 1000, with this by 6e-10.
    radians_a_step=0.022,
    ripple=Ripple((*FORM, "J1", "J2"), ripple_coefficients, _ripple),
    observe=partial(seen, contact, rhs),
    path=attitude.of_rolling(contact),
)
