"""A rigid body with a surface of `sweep.models.general.surfaces`: any inertia, and the centre of mass at any height.

The body axes are those of the surface, x along a, y along b, z down, and begin at the centre of mass G; u is the
upward normal of the plane in these axes.  J is the matrix of inertia about G divided by the mass.  The equations hold
in any units: gravity g is one of the constants.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from sweep.jit import inline
from sweep.models import ellipsoid
from sweep.models.general.surfaces import ELLIPSOID, Surface, offset
from sweep.models.model import Array, Columns
from sweep.models.theory.rocking import Rocking, longer_period

INERTIA = ("J11", "J22", "J33", "J12", "J13", "J23")

MOMENTS = ("Ixx", "Iyy", "Izz")
PRODUCTS = ("Ixy", "Ixz", "Iyz")
"""Elements of the matrix of inertia, as parameters.  Either all of `MOMENTS` are given, or none of either."""

PARAMETERS = ("a", "b", "c", "offset", "delta", "mass", *MOMENTS, *PRODUCTS, "gravity")
"""All parameters of a body.  `delta` and the elements of inertia exclude each other; mass and gravity belong to SI."""


def gravity(columns: Columns) -> Array:
    """g, shape (cells,); 1 where the units are the paper's."""
    return columns["gravity"] if "gravity" in columns else np.ones_like(columns["a"])


def mass(columns: Columns) -> Array:
    """The mass, shape (cells,); 1 where the units are the paper's."""
    return columns["mass"] if "mass" in columns else np.ones_like(columns["a"])


def spin_unit(columns: Columns) -> Array:
    """sqrt(g/c), shape (cells,)."""
    return np.asarray(np.sqrt(gravity(columns) / columns["c"]))


def inertia(columns: Columns) -> tuple[Array, ...]:
    """J11, J22, J33, J12, J13 and J23, each of shape (cells,).

    Without moments of inertia among the parameters they are those of the homogeneous ellipsoid, as the paper defines
    them, about axes that are turned by δ against those of the ellipsoid.
    """
    nothing = np.zeros_like(columns["a"])
    if MOMENTS[0] in columns:
        given = (columns.get(name, nothing) for name in (*MOMENTS, *PRODUCTS))
        return tuple(element / mass(columns) for element in given)
    J1, J2, J3 = ellipsoid.inertia(columns)
    cos, sin = np.cos(columns["delta"]), np.sin(columns["delta"])
    return J1 * cos**2 + J2 * sin**2, J1 * sin**2 + J2 * cos**2, J3, (J1 - J2) * sin * cos, nothing, nothing


def inverse(J: tuple[Array, ...]) -> tuple[Array, ...]:
    """The inverse of a symmetric matrix, elements in the order of `INERTIA`."""
    J11, J22, J33, J12, J13, J23 = J
    C11, C22, C33 = J22 * J33 - J23**2, J11 * J33 - J13**2, J11 * J22 - J12**2
    C12, C13, C23 = J13 * J23 - J12 * J33, J12 * J23 - J13 * J22, J12 * J13 - J11 * J23
    determinant = J11 * C11 + J12 * C12 + J13 * C13
    return tuple(C / determinant for C in (C11, C22, C33, C12, C13, C23))


def matrix(elements: tuple[Array, ...]) -> Array:
    """Elements in the order of `INERTIA` as matrices, shape (cells, 3, 3)."""
    J11, J22, J33, J12, J13, J23 = np.broadcast_arrays(*elements)
    rows = ((J11, J12, J13), (J12, J22, J23), (J13, J23, J33))
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def height(columns: Columns) -> Array:
    """How high G is above the plane at upright rest, shape (cells,)."""
    return columns["c"] - offset(columns)


def stiffness(columns: Columns, surface: Surface = ELLIPSOID) -> tuple[Array, Array]:
    """Second derivatives of the height of G with respect to u1 and u2 at upright rest, each of shape (cells,)."""
    first, second = surface.excess(columns)
    return first + offset(columns), second + offset(columns)


def rocking(columns: Columns, surface: Surface = ELLIPSOID) -> Rocking:
    """The rocking about upright rest without slip, at zero angular momentum about the vertical."""
    J11, J22, J33, J12, J13, J23 = inertia(columns)
    h2, g = height(columns) ** 2, gravity(columns)
    P11, P22, P12 = J11 + h2 - J13**2 / J33, J22 + h2 - J23**2 / J33, J12 - J13 * J23 / J33
    det = P11 * P22 - P12**2
    k1, k2 = stiffness(columns, surface)
    # u1' = ω2, u2' = -ω1
    return Rocking(-P12 / det, P11 / det, -P22 / det, P12 / det, 0.0, g * k2, -g * k1, 0.0)


def slower_period(columns: Columns, surface: Surface = ELLIPSOID) -> Array:
    """Period of the slower rocking, shape (cells,); infinite for a body that is round about one axis."""
    return longer_period(rocking(columns, surface))


@inline
def momentum(w1, w2, w3, p):
    """J ω."""
    L1 = p.J11 * w1 + p.J12 * w2 + p.J13 * w3
    L2 = p.J12 * w1 + p.J22 * w2 + p.J23 * w3
    return L1, L2, p.J13 * w1 + p.J23 * w2 + p.J33 * w3


@inline
def gyroscopic(w1, w2, w3, p):
    """-ω × J ω."""
    L1, L2, L3 = momentum(w1, w2, w3, p)
    return w3 * L2 - w2 * L3, w1 * L3 - w3 * L1, w2 * L1 - w1 * L2


@inline
def about_centre(t1, t2, t3, p):
    """J⁻¹ t: ω' by a torque about the centre of mass."""
    a1 = p.inv_J11 * t1 + p.inv_J12 * t2 + p.inv_J13 * t3
    a2 = p.inv_J12 * t1 + p.inv_J22 * t2 + p.inv_J23 * t3
    return a1, a2, p.inv_J13 * t1 + p.inv_J23 * t2 + p.inv_J33 * t3


@inline
def about_contact(t1, t2, t3, x, y, z, p):
    """J_P⁻¹ t with J_P = J + |x_p|² - x_p x_pᵀ, by the adjugate: ω' by a torque about a contact point at rest."""
    P11, P22, P33 = p.J11 + y * y + z * z, p.J22 + z * z + x * x, p.J33 + x * x + y * y
    P12, P13, P23 = p.J12 - x * y, p.J13 - x * z, p.J23 - y * z
    C11, C22, C33 = P22 * P33 - P23 * P23, P11 * P33 - P13 * P13, P11 * P22 - P12 * P12
    C12, C13, C23 = P13 * P23 - P12 * P33, P12 * P23 - P13 * P22, P12 * P13 - P11 * P23
    inv = 1.0 / (P11 * C11 + P12 * C12 + P13 * C13)
    a1 = inv * (C11 * t1 + C12 * t2 + C13 * t3)
    a2 = inv * (C12 * t1 + C22 * t2 + C23 * t3)
    return a1, a2, inv * (C13 * t1 + C23 * t2 + C33 * t3)


@cache
def energy_on(surface: Surface):
    """Inline (states of `slip`, constants) -> (spin n, energy of the rattle, J33), per unit mass.

    As `sweep.models.ellipsoid.energy`; but if J13 or J23 does not vanish, one term is n² times a small quantity.
    """
    contact, elevation = surface.contact, surface.elevation

    @inline
    def energy(y, p):
        u1, u2, w1, w2, w3, v1, v2 = y
        (u3, _), x_p, _, _ = contact(u1, u2, w1, w2, w3, p)
        height = p.g * elevation(u1, u2, u3, p)
        n, rattle = ellipsoid.split_energy((u1, u2, u3), (w1, w2, w3), (v1, v2), x_p, (p.J11, p.J22, p.J33), height)
        return n, rattle + (p.J12 * w1 * w2 + p.J13 * w1 * w3 + p.J23 * w2 * w3), p.J33

    return energy
