"""The body: an ellipsoid on a plane, with principal axes of inertia rotated by δ against those of the ellipsoid.

The body axes are the principal axes of inertia, z downward; u is the upward normal of the plane in these axes.
Let A be the matrix of the squared semi-axes, rotated by δ into the axes of inertia.  Then r = sqrt(uᵀ A u) is the
height of the centre of mass, and x_p = -A u / r is the contact point.  Both are exact for the ellipsoid, where
Takano (2011) uses an expansion (xp, u).
"""

from __future__ import annotations

import numpy as np

from sweep.jit import inline
from sweep.models.model import Array, Columns


def shape(columns: Columns) -> tuple[Array, Array, Array, Array]:
    """A11, A12, A22, A33: the squared semi-axes as a matrix in the axes of inertia, each of shape (cells,)."""
    a2, b2, c2 = columns["a"] ** 2, columns["b"] ** 2, columns["c"] ** 2
    cos, sin = np.cos(columns["delta"]), np.sin(columns["delta"])
    return a2 * cos**2 + b2 * sin**2, (b2 - a2) * sin * cos, a2 * sin**2 + b2 * cos**2, c2


def inertia(columns: Columns) -> tuple[Array, Array, Array]:
    """I1, I2, I3 of the homogeneous ellipsoid by the paper's definition (for small δ), each of shape (cells,)."""
    a2, b2, c2 = columns["a"] ** 2, columns["b"] ** 2, columns["c"] ** 2
    return (b2 + c2) / 5, (a2 + c2) / 5, (a2 + b2) / 5


def start(columns: Columns) -> tuple[Array, ...]:
    """u1, u2, ω1, ω2 and ω3 at rest except for the spin n0, ω = n0 u, with the contact point at (x0, y0).

    That has to lie within the outline of the body seen from above.
    """
    A11, A12, A22, A33 = shape(columns)
    x, y, n0 = columns["x0"], columns["y0"], columns["n0"]
    det = A11 * A22 - A12**2
    # x_p = -A u / r means u ∝ -A⁻¹ x_p.
    w1, w2 = (A22 * x - A12 * y) / det, (A11 * y - A12 * x) / det
    w3 = np.sqrt(1 - (x * w1 + y * w2)) / np.sqrt(A33)
    norm = np.sqrt(w1**2 + w2**2 + w3**2)
    u1, u2, u3 = -w1 / norm, -w2 / norm, -w3 / norm
    return u1, u2, n0 * u1, n0 * u2, n0 * u3


@inline
def tilt(y):
    """sin² of the angle between u and the z axis, from states that begin with u1 and u2."""
    return y[0] * y[0] + y[1] * y[1]


@inline
def contact(u1, u2, w1, w2, w3, p):
    """(u3, 1/u3), the contact point x_p, u', and the velocity x_p' of the contact point in the body.

    u' = u × ω (omega) and x_p' = -(A u' + x_p (u' · A u) / r) / r.  `p` holds A11 … A33.
    """
    A11, A12, A22, A33 = p.A11, p.A12, p.A22, p.A33
    u3 = -np.sqrt(1.0 - (u1 * u1 + u2 * u2))
    au1, au2, au3 = A11 * u1 + A12 * u2, A12 * u1 + A22 * u2, A33 * u3
    r = np.sqrt(u1 * au1 + u2 * au2 + u3 * au3)
    # One division is enough for both 1/r and 1/u3.
    shared = 1.0 / (r * u3)
    inv_r, inv_u3 = shared * u3, shared * r
    x, y, z = -au1 * inv_r, -au2 * inv_r, -au3 * inv_r

    du1, du2, du3 = u2 * w3 - u3 * w2, u3 * w1 - u1 * w3, u1 * w2 - u2 * w1
    s = (du1 * au1 + du2 * au2 + du3 * au3) * inv_r
    dx = -inv_r * (A11 * du1 + A12 * du2 + x * s)
    dy = -inv_r * (A12 * du1 + A22 * du2 + y * s)
    dz = -inv_r * (A33 * du3 + z * s)
    return (u3, inv_u3), (x, y, z), (du1, du2, du3), (dx, dy, dz)


@inline
def energy(y, p):
    """(spin n, energy of the rattle, I3), where the energy above rest is the energy of the rattle + I3 n²/2.

    `y` are the states of `slip`, and `p` holds A11 … A33 and the inverse moments of inertia, inv_I1 … inv_I3.
    """
    u1, u2, w1, w2, w3, v1, v2 = y
    A11, A12, A22, A33 = p.A11, p.A12, p.A22, p.A33
    I1, I2, I3 = 1.0 / p.inv_I1, 1.0 / p.inv_I2, 1.0 / p.inv_I3

    u3 = -np.sqrt(1.0 - (u1 * u1 + u2 * u2))
    au1, au2, au3 = A11 * u1 + A12 * u2, A12 * u1 + A22 * u2, A33 * u3
    r = np.sqrt(u1 * au1 + u2 * au2 + u3 * au3)
    # r - c = (r² - c²)/(r + c)
    c = np.sqrt(A33)
    height = ((A11 - A33) * u1 * u1 + 2.0 * A12 * u1 * u2 + (A22 - A33) * u2 * u2) / (r + c)
    x_p = -au1 / r, -au2 / r, -au3 / r
    n, rattle = split_energy((u1, u2, u3), (w1, w2, w3), (v1, v2), x_p, (I1, I2, I3), height)
    return n, rattle, I3


@inline
def split_energy(u, w, v, x_p, moments, height):
    """(spin n, energy of the rattle) of any body whose energy of height is `height`, without products of inertia.

    E = ωᵀIω/2 + |v_g|²/2 + `height` is split by means of ω = n u + o, o ⊥ u.  Every term except I3 n²/2 is quadratic in
    small quantities and is computed as such: no difference of numbers of order one is taken.
    """
    (u1, u2, u3), (w1, w2, w3), (v1, v2), (x, y, z), (I1, I2, I3) = u, w, v, x_p, moments
    n = u1 * w1 + u2 * w2 + u3 * w3
    o1, o2 = w1 - n * u1, w2 - n * u2
    o3 = -(u1 * o1 + u2 * o2) / u3
    spin_part = 0.5 * n * n * ((I1 - I3) * u1 * u1 + (I2 - I3) * u2 * u2)
    cross_part = n * ((I1 - I3) * u1 * o1 + (I2 - I3) * u2 * o2)
    tilt_part = 0.5 * (I1 * o1 * o1 + I2 * o2 * o2 + I3 * o3 * o3)

    v3 = -(v1 * u1 + v2 * u2) / u3
    g1, g2, g3 = v1 + y * w3 - z * w2, v2 + z * w1 - x * w3, v3 + x * w2 - y * w1
    drift = 0.5 * (g1 * g1 + g2 * g2 + g3 * g3)
    return n, spin_part + cross_part + tilt_part + height + drift
