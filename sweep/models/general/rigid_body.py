"""A rigid body with a surface of `sweep.models.general.surfaces`: any inertia, and the centre of mass at any height.

The axes of the states begin at the centre of mass G, z down; x and y are the principal axes of the inertia about z, so
that J12 = 0.  They are turned about z by an angle α against the axes of the surface; for the paper's body, whose
inertia is given by δ, α = δ.  u is the upward normal of the plane.  J is the matrix of inertia about G divided by the
mass.  The equations hold in any units: gravity g is one of the constants.

Functions of constants take those from `constants`, or those of a scene (`sweep.models.general.common`), in which
whatever vanishes is the number 0.
"""

from __future__ import annotations

from collections import namedtuple
from functools import cache
from typing import Any

import numpy as np

from sweep.models.general.surfaces import ELLIPSOID, Surface, offset
from sweep.models.model import Array, Columns
from sweep.models.theory.rocking import Rocking, longer_period
from sweep.models.vectors import Symmetric, Vector, along_turned

INERTIA = ("J11", "J22", "J33", "J13", "J23")

INVERSE = ("inv_J11", "inv_J22", "inv_J33", "inv_J12", "inv_J13", "inv_J23")

DIFFERENCES = ("D1", "D2", "D3")
"""J22 - J33, J33 - J11 and J11 - J22."""

BODY = ("g", *INERTIA, *INVERSE, *DIFFERENCES)
"""Names of the constants of a body, besides those of its surface."""

MOMENTS = ("Ixx", "Iyy", "Izz")
PRODUCTS = ("Ixy", "Ixz", "Iyz")
"""Elements of the matrix of inertia, as parameters.  Either all of `MOMENTS` are given, or no element at all."""

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


def homogeneous(columns: Columns) -> tuple[Array, Array, Array]:
    """I1, I2, I3 of the homogeneous ellipsoid by the paper's definition (for small δ), each of shape (cells,)."""
    a2, b2, c2 = columns["a"] ** 2, columns["b"] ** 2, columns["c"] ** 2
    return (b2 + c2) / 5, (a2 + c2) / 5, (a2 + b2) / 5


def about_surface(columns: Columns) -> tuple[Array, ...]:
    """J11, J22, J33, J12, J13 and J23 in the axes of the surface, each of shape (cells,).

    Without moments of inertia among the parameters they are those of the homogeneous ellipsoid, about axes that are
    turned by δ against those of the ellipsoid.
    """
    nothing = np.zeros_like(columns["a"])
    if MOMENTS[0] in columns:
        given = (columns.get(name, nothing) for name in (*MOMENTS, *PRODUCTS))
        return tuple(element / mass(columns) for element in given)
    J1, J2, J3 = homogeneous(columns)
    J11, J12, J22 = along_turned(J1, J2, -columns["delta"])
    return J11, J22, J3, J12, nothing, nothing


def axes(columns: Columns) -> Array:
    """α, shape (cells,): within ± 45 degrees where moments of inertia are given."""
    if MOMENTS[0] not in columns:
        return columns["delta"]
    J11, J22, _, J12, _, _ = about_surface(columns)
    return np.asarray(0.5 * np.arctan2(np.where(J11 < J22, -2.0, 2.0) * J12, np.abs(J11 - J22)))


def turned(first: Array, second: Array, angle: Array) -> tuple[Array, Array]:
    """The components of a vector along axes that are turned by `angle` about z."""
    cos, sin = np.cos(angle), np.sin(angle)
    return first * cos + second * sin, second * cos - first * sin


def inertia(columns: Columns) -> tuple[Array, ...]:
    """The values of `INERTIA`, each of shape (cells,)."""
    J11, J22, J33, J12, J13, J23 = about_surface(columns)
    if MOMENTS[0] not in columns:
        return *homogeneous(columns), J13, J23
    angle = axes(columns)
    cos, sin = np.cos(angle), np.sin(angle)
    mixed = 2 * J12 * sin * cos
    about_x, about_y = J11 * cos**2 + mixed + J22 * sin**2, J11 * sin**2 - mixed + J22 * cos**2
    return about_x, about_y, J33, *turned(J13, J23, angle)


def inverse(J: tuple[Array, ...]) -> tuple[Array, ...]:
    """The values of `INVERSE` from those of `INERTIA`."""
    J11, J22, J33, J13, J23 = J
    adjugate, determinant = Symmetric(J11, J22, J33, np.zeros_like(J11), J13, J23).adjugate()
    return tuple(each / determinant for each in adjugate)


def constants(columns: Columns, surface: Surface = ELLIPSOID):
    """All constants of bodies on a surface, each of shape (cells,)."""
    return _record(surface)(*values(columns, surface))


@cache
def _record(surface: Surface):
    return namedtuple("Body", (*surface.constants, *BODY))


def values(columns: Columns, surface: Surface) -> tuple[Array, ...]:
    """The values of the surface's constants and of `BODY`, each of shape (cells,)."""
    J = J11, J22, J33, _, _ = inertia(columns)
    differences = J22 - J33, J33 - J11, J11 - J22
    return *surface.of(columns, axes(columns)), gravity(columns), *J, *inverse(J), *differences


def matrix(elements: tuple[Array, ...]) -> Array:
    """Symmetric matrices, shape (cells, 3, 3), of the elements 11, 22, 33, 12, 13 and 23; 12 may be left out, as 0."""
    J11, J22, J33, J12, J13, J23 = np.broadcast_arrays(
        *elements[:3], *([0.0] if len(elements) == 5 else []), *elements[3:]
    )
    rows = ((J11, J12, J13), (J12, J22, J23), (J13, J23, J33))
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def height(columns: Columns) -> Array:
    """Height of G above the plane at upright rest, shape (cells,)."""
    return columns["c"] - offset(columns)


def stiffness(columns: Columns, surface: Surface = ELLIPSOID) -> tuple[Array, Array]:
    """Second derivatives of the height of G at upright rest along the axes of the surface, each of shape (cells,)."""
    first, second = surface.excess(columns)
    return first + offset(columns), second + offset(columns)


@cache
def rocking_on(surface: Surface):
    """(constants) -> the rocking about upright rest without slip, at zero angular momentum about the vertical."""

    def rocking(p):
        k11, k12, k22, h = surface.stiffness(p)
        P11, P22 = p.J11 + h * h - p.J13 * p.J13 / p.J33, p.J22 + h * h - p.J23 * p.J23 / p.J33
        P12 = -p.J13 * p.J23 / p.J33
        det = P11 * P22 - P12 * P12
        # u1' = ω2, u2' = -ω1
        turning = -P12 / det, P11 / det, -P22 / det, P12 / det
        return Rocking(*turning, p.g * k12, p.g * k22, -p.g * k11, -p.g * k12)

    return rocking


def rocking(columns: Columns, surface: Surface = ELLIPSOID) -> Rocking:
    """The rocking of bodies about upright rest; its elements have the shape (cells,)."""
    return Rocking(*np.broadcast_arrays(*rocking_on(surface)(constants(columns, surface))))


def slower_period(columns: Columns, surface: Surface = ELLIPSOID) -> Array:
    """Period over which the spin is averaged (`sweep.models.theory.rocking.longer_period`), shape (cells,)."""
    return longer_period(rocking(columns, surface))


def momentum(w: Vector, p) -> Vector:
    """J ω."""
    return Vector(p.J11 * w.x + p.J13 * w.z, p.J22 * w.y + p.J23 * w.z, p.J13 * w.x + p.J23 * w.y + p.J33 * w.z)


def gyroscopic(w: Vector, p) -> Vector:
    """-ω × J ω."""
    xy, xz, yz = w.x * w.y, w.x * w.z, w.y * w.z
    return Vector(
        p.D1 * yz + p.J23 * (w.z * w.z - w.y * w.y) - p.J13 * xy,
        p.D2 * xz + p.J13 * (w.x * w.x - w.z * w.z) + p.J23 * xy,
        p.D3 * xy + p.J13 * yz - p.J23 * xz,
    )


def about_centre(torque: Vector, p) -> Vector:
    """J⁻¹ t: ω' by a torque about the centre of mass."""
    return inverse_of(p).of(torque)


def inverse_of(p) -> Symmetric:
    """J⁻¹."""
    return Symmetric(*(getattr(p, name) for name in INVERSE))


def about_contact(a: Vector, square, p) -> tuple[Symmetric, Any]:
    """The adjugate C and the determinant of ρ² J_P, for x_p = -a/ρ and `square` = ρ²: J_P⁻¹ = ρ² C / det.

    J_P = J + |x_p|² - x_p x_pᵀ is the inertia about the contact point.
    """
    xx, yy, zz = a.x * a.x, a.y * a.y, a.z * a.z
    return Symmetric(
        p.J11 * square + (yy + zz), p.J22 * square + (zz + xx), p.J33 * square + (xx + yy),
        -(a.x * a.y), p.J13 * square - a.x * a.z, p.J23 * square - a.y * a.z,
    ).adjugate()  # fmt: skip


@cache
def contact_on(surface: Surface):
    """(u1, u2, ω, constants) -> (u, 1/u3, x_p, u' = u × ω (omega), and x_p', its velocity in the body)."""

    def contact(u1, u2, w, p):
        c3 = 1.0 - (u1 * u1 + u2 * u2)
        u = Vector(u1, u2, -np.sqrt(c3))
        a, rho, _ = surface.point(u, c3, p)
        # One division is enough for both 1/ρ and 1/u3.
        shared = 1.0 / (rho * u.z)
        inv_rho, inv_u3 = shared * u.z, shared * rho
        x_p, du = (-a).times(inv_rho), u.cross(w)
        return u, inv_u3, x_p, du, surface.velocity(du, x_p, inv_rho, (u1 * inv_u3, u2 * inv_u3), inv_u3, p)

    return contact


@cache
def energy_on(surface: Surface):
    """(states that begin with those of `slip`, constants) -> (spin n, energy of the rattle, J33), per unit mass.

    E = ωᵀJω/2 + |v_g|²/2 + g height is split using ω = n u + o, o ⊥ u.  Every term except J33 n²/2 is quadratic
    in small quantities and is computed as such: no difference of numbers of order one is taken.  But if J13 or J23 does
    not vanish, one term is n² times a small quantity.
    """

    def energy(y, p):
        u1, u2, w1, w2, w3, v1, v2 = y[:7]
        c3 = 1.0 - (u1 * u1 + u2 * u2)
        u, w = Vector(u1, u2, -np.sqrt(c3)), Vector(w1, w2, w3)
        a, rho, _ = surface.point(u, c3, p)
        n = u.dot(w)
        o1, o2 = w1 - n * u1, w2 - n * u2
        o3 = -(u1 * o1 + u2 * o2) / u.z
        d1, d2 = -p.D2, p.D1
        spin_part = 0.5 * n * n * (d1 * u1 * u1 + d2 * u2 * u2)
        cross_part = n * (d1 * u1 * o1 + d2 * u2 * o2)
        tilt_part = 0.5 * (p.J11 * o1 * o1 + p.J22 * o2 * o2 + p.J33 * o3 * o3)
        v_g = Vector(v1, v2, -(v1 * u1 + v2 * u2) / u.z) + (-a).times(1.0 / rho).cross(w)
        rattle = spin_part + cross_part + tilt_part + p.g * surface.elevation(u, p) + 0.5 * v_g.dot(v_g)
        return n, rattle + (p.J13 * w1 + p.J23 * w2) * w3, p.J33

    return energy
