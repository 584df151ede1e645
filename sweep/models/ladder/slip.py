"""The full model: a rattleback that slips with viscous friction (Takano 2011, Ldot … visf).

Lengths are in c, times in sqrt(c/g).  The unknowns (u1, u2, ω1, ω2, ω3, v1, v2) are components along the body
axes of the upward normal u, the angular velocity ω and the slip velocity v_p of the contact point.
All of them except ω3 vanish in upright spin, so a rattle keeps its relative precision however small it is.

    u' = u × ω                                                        (omega)
    I ω' = x_p × F - ω × I ω,   F = R (u + f),   f = -μ v_p           (Ldot, visf)
    v_p' = F - u - x_p × ω' - ω × (v_p + v_0 - x_p'),   v_0 = x_p × ω   (vgdot, vgvp)

The normal force R follows from v_p · u = 0 (R).  Scalar triple products are rearranged so that
q = u × x_p is computed only once: (x_p × α) · u = q · α.
"""

from __future__ import annotations

from collections import namedtuple

import numpy as np

from sweep.jit import inline
from sweep.models import attitude, ellipsoid, model
from sweep.models.ellipsoid import contact
from sweep.models.model import COUNT, ENERGY, FORMULAS, MODES, REVERSAL_TIME, SPIN, Array, Columns, Model, Ripple
from sweep.models.theory.ripple import FORM, form, ripple
from sweep.models.theory.rocking import Body, frequencies, rocking, slower_period


class Constants(namedtuple("Constants", "A11 A12 A22 A33 inv_I1 inv_I2 inv_I3 ratio1 ratio2 ratio3 mu")):
    """Shape, inverse moments of inertia, the ratios in Euler's equations, and μ of the friction.

    `ratio1` is (I2 - I3) / I1; the others follow by cyclic permutation.
    """

    @classmethod
    def of(cls, columns: Columns) -> Constants:
        I1, I2, I3 = ellipsoid.inertia(columns)
        ratios = (I2 - I3) / I1, (I3 - I1) / I2, (I1 - I2) / I3
        return cls(*ellipsoid.shape(columns), 1 / I1, 1 / I2, 1 / I3, *ratios, columns["mu"])


energy = ellipsoid.energy


def start(columns: Columns) -> tuple[Array, ...]:
    """As that of the body, and v_p = 0."""
    states = ellipsoid.start(columns)
    rest = np.zeros_like(states[0])
    return *states, rest, rest


@inline
def rhs(y, p):
    u1, u2, w1, w2, w3, v1, v2 = y
    (u3, inv_u3), (x, y_, z), du, dx = contact(u1, u2, w1, w2, w3, p)
    v3 = -(v1 * u1 + v2 * u2) * inv_u3
    # u + f with f = -μ v_p (visf), the contact force per unit of R
    g1, g2, g3 = u1 - p.mu * v1, u2 - p.mu * v2, u3 - p.mu * v3
    # Euler's gyroscopic terms, and the torque of the contact force
    alpha = p.ratio1 * w2 * w3, p.ratio2 * w3 * w1, p.ratio3 * w1 * w2
    beta = p.inv_I1 * (y_ * g3 - z * g2), p.inv_I2 * (z * g1 - x * g3), p.inv_I3 * (x * g2 - y_ * g1)
    slopes, spin, R, denominator = motion(y, u3, v3, (x, y_, z), du, dx, (g1, g2), alpha, beta, 1.0)
    return slopes, (spin, dissipation(R, v1, v2, v3, p), R, denominator)


@inline
def dissipation(R, v1, v2, v3, p):
    """Power that friction dissipates, -R f · v_p >= 0."""
    return p.mu * R * (v1 * v1 + v2 * v2 + v3 * v3)


@inline
def motion(y, u3, v3, x_p, du, dx, g, alpha, beta, gravity):
    """The derivatives of the states, n, R, and the Painlevé denominator, of a body with any inertia on any surface.

    Parameters
    ----------
    x_p, du, dx : as of `contact`
    g : the contact force u + f per unit of R, its first two components
    alpha, beta : ω' = α + R β
    """
    u1, u2, w1, w2, w3, v1, v2 = y
    (x, y_, z), (du1, du2, du3), (dx1, dx2, dx3), (g1, g2) = x_p, du, dx, g
    (al1, al2, al3), (be1, be2, be3) = alpha, beta
    # s = v_0 - x_p'
    s1, s2, s3 = y_ * w3 - z * w2 - dx1, z * w1 - x * w3 - dx2, x * w2 - y_ * w1 - dx3
    q1, q2, q3 = u2 * z - u3 * y_, u3 * x - u1 * z, u1 * y_ - u2 * x
    denominator = 1.0 - (q1 * be1 + q2 * be2 + q3 * be3)
    R = (gravity + (s1 * du1 + s2 * du2 + s3 * du3) + (q1 * al1 + q2 * al2 + q3 * al3)) / denominator

    dw1, dw2, dw3 = al1 + R * be1, al2 + R * be2, al3 + R * be3
    s1, s2, s3 = s1 + v1, s2 + v2, s3 + v3
    dv1 = R * g1 - gravity * u1 - (y_ * dw3 - z * dw2) - (w2 * s3 - w3 * s2)
    dv2 = R * g2 - gravity * u2 - (z * dw1 - x * dw3) - (w3 * s1 - w1 * s3)
    return (du1, du2, dw1, dw2, dw3, dv1, dv2), u1 * w1 + u2 * w2 + u3 * w3, R, denominator


def ripple_coefficients(columns: Columns) -> tuple[Array, ...]:
    """K, and I1 + c², I2 + c² and c."""
    I1, I2, _ = ellipsoid.inertia(columns)
    c = columns["c"]
    return *form(columns), I1 + c**2, I2 + c**2, c


@inline
def _ripple(y, p, k):
    """K with M to first order in the rattle, which is all that K is good for."""
    u1, u2, w1, w2, w3, v1, v2 = y
    M1 = k[4] * w1 + k[6] * v2 + w3 * (p.A11 * u1 + p.A12 * u2)
    M2 = k[5] * w2 - k[6] * v1 + w3 * (p.A12 * u1 + p.A22 * u2)
    return ripple(u1, u2, M1, M2, k)


def observe(y: Array, p: Constants) -> dict[str, Array]:
    """Compute what a trajectory shows beside spin and energy: contact point, slip v_p, v̇_p, v̇_0 and normal force.

    v̇_p is the derivative in the body axes; v̇_0 is the derivative in space, (d/dt) v_0 in the paper.
    """
    u1, u2, w1, w2, w3, v1, v2 = y
    _, point, _, moving = contact(u1, u2, w1, w2, w3, p)
    slopes, (_, _, R, _) = rhs(y, p)
    omega, slope = y[2:5], np.stack(slopes[2:5])
    x_p, dx_p = np.stack(point), np.stack(moving)

    def cross(a: Array, b: Array) -> Array:
        return np.cross(a, b, axis=0)

    dv0 = cross(dx_p, omega) + cross(x_p, slope) + cross(omega, cross(x_p, omega))
    return {
        "contact_x": x_p[0],
        "contact_y": x_p[1],
        "slip_1": v1,
        "slip_2": v2,
        "slip_rate_1": slopes[5],
        "slip_rate_2": slopes[6],
        "v0_rate_1": dv0[0],
        "v0_rate_2": dv0[1],
        "normal_force": R,
    }


def fastest_decay(columns: Columns) -> Array:
    """Bound on the rate at which friction stops the slip, over the whole trajectory, in sqrt(g/c), shape (cells,)."""
    return np.asarray(columns["mu"] * strongest_grip(columns))


def strongest_grip(columns: Columns) -> Array:
    """Bound on the decay rate of the slip per unit of friction's resistance, shape (cells,).

    It is 1 + c²/I1 at rest and grows with the rattle.  The slip velocity relaxes at the rate
    μ R (1 + z²/I + ρ²/I3), where ρ is the distance of the contact point from the z axis and I the smallest moment
    of inertia.  Both R and the bracket grow with the rattle, which can take up the whole energy above rest, E0.  For
    rocking about one axis, with the centre of mass at height r,

        R - 1 <= r'' φ'^2,   φ'^2 = 2 (E0 - (r - c)) / (J + |x_p|²),

    so the largest product over the heights c … c + E0 bounds the rate.  Near rest, r'' φ'^2 is at most 2 E0 ν² for the
    faster rocking ν, and this defines J for the long axis: where the axes of inertia are turned far against those of
    the ellipsoid, J is smaller than I2.  On 300 cells with |δ| <= 0.5 (data/reference_wide.csv) the bound was reached
    (0.9 to 1.0 of it in half of them) and never exceeded; with J = I2 it was exceeded up to 2.7 times.
    """
    a, b, c = columns["a"], columns["b"], columns["c"]
    I1, I2, I3 = ellipsoid.inertia(columns)
    smallest = np.minimum(I1, I2)
    spin, rattle, inertia = energy(start(columns), Constants.of(columns))
    energy_start = rattle + 0.5 * inertia * spin**2
    _, nu = frequencies(rocking(Body.of(columns)))
    worst = np.zeros_like(energy_start)
    with np.errstate(divide="ignore", invalid="ignore"):
        long = np.fmin(I2, np.where(a > c, (a**2 - c**2) / (c * nu**2) - c**2, np.inf))
    for share in np.linspace(0, 1, 9):
        for axis, J in ((a, long), (b, I1)):
            excess = axis**2 - c**2
            r = c + share * energy_start
            with np.errstate(divide="ignore", invalid="ignore"):
                tilt = np.nan_to_num(np.clip((r**2 - c**2) / excess, 0, 1))  # sin² of the angle φ
            r = np.sqrt(c**2 + excess * tilt)
            rho2, z2 = axis**4 * tilt / r**2, c**4 * (1 - tilt) / r**2
            curvature = (excess * (1 - 2 * tilt) - excess**2 * tilt * (1 - tilt) / r**2) / r
            R = 1 + np.maximum(curvature, 0) * 2 * (1 - share) * energy_start / (J + rho2 + z2)
            worst = np.maximum(worst, R * (1 + z2 / smallest + rho2 / I3))
    return np.asarray(worst)


MODEL = Model(
    name="slip",
    summary="full equations with viscous slip friction (Takano 2011, Ldot … visf)",
    states=("u1", "u2", "omega1", "omega2", "omega3", "v1", "v2"),
    spin_state=4,
    parameters=("a", "b", "c", "delta", "mu", "n0", "x0", "y0"),
    offers=frozenset({COUNT, SPIN, ENERGY, MODES, FORMULAS, REVERSAL_TIME, model.LINEAR}),
    constants=Constants,
    start=start,
    slower_period=slower_period,
    fastest_decay=fastest_decay,
    upright=lambda spin: (0.0, 0.0, 0.0, 0.0, -spin, 0.0, 0.0),
    rhs=rhs,
    energy=energy,
    ripple=Ripple((*FORM, "J1", "J2", "c"), ripple_coefficients, _ripple),
    tilt=ellipsoid.tilt,
    observe=observe,
    path=attitude.of_slipping(contact),
)
