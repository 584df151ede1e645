"""Rolling without slip: the limit of infinite friction.  Energy is conserved.

The unknowns (u1, u2, ω1, ω2, ω3) are those of the slip model without the slip velocity: the contact
point rests, v_g = x_p × ω, and the contact force is whatever keeps it so.  Eliminating it,

    I_P ω' = x_p × u - ω × I ω + x_p × (x_p' × ω + ω × v_0),   I_P = I + |x_p|² - x_p x_pᵀ,

a 3 × 3 system of a diagonal and a rank-one part, which Sherman and Morrison's formula solves.
"""

from __future__ import annotations

from typing import Any

from sweep.jit import inline
from sweep.models import ellipsoid
from sweep.models.ellipsoid import contact
from sweep.models.model import Array, Columns, Model


def constants(columns: Columns) -> tuple[Array, ...]:
    """Shape and inverse moments of inertia: seven arrays."""
    return (*ellipsoid.shape(columns), *(1 / moment for moment in ellipsoid.inertia(columns)))


def start(columns: Columns) -> tuple[Array, ...]:
    """At rest but for the spin n0, with contact point (x0, y0): ω = n0 u."""
    u1, u2, u3 = ellipsoid.start(columns)
    n0 = columns["n0"]
    return u1, u2, n0 * u1, n0 * u2, n0 * u3


@inline
def upright(n: Any) -> Any:
    return (0.0, 0.0, 0.0, 0.0, -n)


@inline
def rhs(y: Any, p: Any) -> Any:
    u1, u2, w1, w2, w3 = y
    A11, A12, A22, A33, i1, i2, i3 = p
    (u3, _), (x, y_, z), (du1, du2, _), (dx, dy, dz) = contact(u1, u2, w1, w2, w3, A11, A12, A22, A33)
    I1, I2, I3 = 1.0 / i1, 1.0 / i2, 1.0 / i3

    # v_0 - x_p', whose ω × … is minus the part of dv_g/dt without ω'
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
def energy(y: Any, p: Any) -> Any:
    u1, u2, w1, w2, w3 = y
    return ellipsoid.energy(u1, u2, w1, w2, w3, 0.0, 0.0, p)


def observe(y: Array, p: Array) -> dict[str, Array]:
    """Contact point and normal force."""
    _, point, _, _ = contact(*y, *p[:4])
    _, (_, _, R, _) = rhs(y, p)
    return {"contact_x": point[0], "contact_y": point[1], "normal_force": R}


MODEL = Model(
    name="noslip",
    summary="rolling without slip, the limit of infinite friction",
    states=("u1", "u2", "omega1", "omega2", "omega3"),
    spin_state=4,
    parameters=("a", "b", "c", "delta", "n0", "x0", "y0"),
    measures=("reversals", "energy_error", "first_reversal"),
    constants=constants,
    start=start,
    upright=upright,
    rhs=rhs,
    energy=energy,
    # Nothing dissipates an error: 0.07 drifts by 2e-7 of the energy in t = 1000, this by 6e-10.
    radians_a_step=0.022,
    observe=observe,
)
