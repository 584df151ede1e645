"""A rigid body with a surface of `sweep.models.general.surfaces`: any inertia, and the centre of mass at any height.

The body axes are those of the surface, x along a, y along b, z down, and begin at the centre of mass G; u is the
upward normal of the plane in these axes.  J is the matrix of inertia about G divided by the mass.  The equations hold
in any units: gravity g is one of the constants.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from sweep.jit import inline
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


def shape_names(surface: Surface) -> tuple[str, ...]:
    """The constants of a surface, and g."""
    return *surface.constants, "g"


def shape(columns: Columns, surface: Surface) -> tuple[Array, ...]:
    """Values of `shape_names`, each of shape (cells,)."""
    return *surface.of(columns), gravity(columns)


def inertia(columns: Columns) -> tuple[Array, ...]:
    """J11, J22, J33, J12, J13 and J23, each of shape (cells,).

    Without moments of inertia among the parameters they are those of the homogeneous ellipsoid, as the paper defines
    them, about axes that are turned by δ against those of the ellipsoid.
    """
    nothing = np.zeros_like(columns["a"])
    if MOMENTS[0] in columns:
        given = (columns.get(name, nothing) for name in (*MOMENTS, *PRODUCTS))
        return tuple(element / mass(columns) for element in given)
    a2, b2, c2 = columns["a"] ** 2, columns["b"] ** 2, columns["c"] ** 2
    J1, J2, J3 = (b2 + c2) / 5, (a2 + c2) / 5, (a2 + b2) / 5
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
def gyroscopic(w1: Any, w2: Any, w3: Any, p: Any) -> Any:
    """-ω × J ω."""
    L1 = p.J11 * w1 + p.J12 * w2 + p.J13 * w3
    L2 = p.J12 * w1 + p.J22 * w2 + p.J23 * w3
    L3 = p.J13 * w1 + p.J23 * w2 + p.J33 * w3
    return w3 * L2 - w2 * L3, w1 * L3 - w3 * L1, w2 * L1 - w1 * L2


@cache
def energy_on(surface: Surface) -> Any:
    """Inline (u1, u2, ω1, ω2, ω3, v1, v2, constants) -> (spin n, energy of the rattle, J33), per unit mass.

    As `sweep.models.ellipsoid.energy`.

    With ω = n u + o, o ⊥ u, every term except J33 n²/2 is quadratic in small quantities and is computed as such.  (If
    J13 or J23 does not vanish, one is n² times a small quantity.)
    """
    elevation = surface.elevation

    @inline
    def energy(u1: Any, u2: Any, w1: Any, w2: Any, w3: Any, v1: Any, v2: Any, p: Any) -> Any:
        u3 = -np.sqrt(1.0 - (u1 * u1 + u2 * u2))
        n = u1 * w1 + u2 * w2 + u3 * w3
        o1, o2 = w1 - n * u1, w2 - n * u2
        o3 = -(u1 * o1 + u2 * o2) / u3
        D1, D2 = p.J11 - p.J33, p.J22 - p.J33
        spin_part = n * n * (
            0.5 * (D1 * u1 * u1 + D2 * u2 * u2) + p.J12 * u1 * u2 + u3 * (p.J13 * u1 + p.J23 * u2)
        )  # fmt: skip
        cross_part = n * (
            D1 * u1 * o1 + D2 * u2 * o2 + p.J12 * (u1 * o2 + u2 * o1)
            + p.J13 * (u1 * o3 + u3 * o1) + p.J23 * (u2 * o3 + u3 * o2)
        )  # fmt: skip
        tilt_part = 0.5 * (p.J11 * o1 * o1 + p.J22 * o2 * o2 + p.J33 * o3 * o3) + (
            p.J12 * o1 * o2 + p.J13 * o1 * o3 + p.J23 * o2 * o3
        )

        height, x, y, z = elevation(u1, u2, u3, p)
        v3 = -(v1 * u1 + v2 * u2) / u3
        g1, g2, g3 = v1 + y * w3 - z * w2, v2 + z * w1 - x * w3, v3 + x * w2 - y * w1
        drift = 0.5 * (g1 * g1 + g2 * g2 + g3 * g3)
        return n, spin_part + cross_part + tilt_part + p.g * height + drift, p.J33

    return energy
