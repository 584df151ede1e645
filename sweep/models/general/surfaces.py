"""The surfaces on which a rigid body rolls and slips: the ellipsoid, and the elliptic paraboloid.

Each is given in the axes of the states (`sweep.models.general.rigid_body`), which are turned by an angle α about z,
down, against the axes of the surface: x and y along its principal curvatures at the lowest point of the body at rest.
They begin at the centre of mass G, at the height h = c - offset above that point.  u is the upward normal of the
plane.  To add a surface, enter its `Surface` in `SURFACES`.

Ellipsoid with the semi-axes a, b and c, its centre `offset` above G.  With the matrix A of the squared semi-axes and
r = sqrt(uᵀ A u),

    x_p = -A u / r - offset ẑ,   -x_p · u = r + offset u3.

Takano (2011) uses an expansion of this (xp, u).

Paraboloid z = c (1 - a (x/c)² - b (y/c)²), its origin `offset` above G: c is the length in which it is measured, and a
and b are pure numbers.  With the matrix S of the radii of curvature at its lowest point, c/(2 a) and c/(2 b), and
t = u/u3,

    x_p = (S t, h - tᵀ S t / 2),   -x_p · u = -u3 (h + tᵀ S t / 2).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sweep.models.model import Array, Columns
from sweep.models.vectors import Symmetric, Vector, along_turned
from sweep.units import NUMBER


@dataclass(frozen=True)
class Surface:
    """A surface.  Heights are those of G above the plane; lengths are in any unit."""

    name: str
    """As in the configuration."""
    constants: tuple[str, ...]
    of: Callable[[Columns, Array], tuple[Array, ...]]
    """(columns, α) -> values of `constants`, each of shape (cells,)."""
    excess: Callable[[Columns], tuple[Array, Array]]
    """(columns) -> radii of curvature along the axes of the surface at the lowest point of the body at rest, less c and
    without loss of digits, each of shape (cells,)."""
    point: Callable[..., Any]
    """(u, u3², constants) -> (a, ρ, ρ²): the contact point is x_p = -a/ρ."""
    velocity: Callable[..., Any]
    """(u' = u × ω, x_p, 1/ρ, u/u3, 1/u3, constants) -> x_p', the velocity of the contact point in the body."""
    elevation: Callable[..., Any]
    """(u, constants) -> the height of G above that at rest, quadratic in u1 and u2 and precise however small
    they are."""
    stiffness: Callable[..., Any]
    """(constants) -> (k11, k12, k22, h): the second derivatives of that by u1 and u2 at rest, and the height there."""
    normal: Callable[[Columns, Array, Array], tuple[Array, Array, Array]]
    """(columns, x, y) -> u for a possible contact point at x and y; all in the axes of the surface."""
    homogeneous: bool
    """Whether the inertia is that of a homogeneous body unless it is given."""
    interior: str
    """Words for messages: where the centre of mass has to lie, and what to change."""
    outside: Callable[[Columns], Array]
    """(columns) -> whether the centre of mass lies elsewhere, shape (cells,)."""
    bounds: str
    """Words for messages: the offsets for which upright rest is stable."""
    off: Callable[[Columns, Array, Array], Array] = lambda columns, x, y: np.zeros(np.shape(x), bool)
    """(columns, x, y) -> whether the surface has no point at x and y, shape (cells,); by default it has one
    everywhere."""
    outline: str = ""
    """Words for messages: the condition on x and y within the outline."""
    required: frozenset[str] = frozenset()
    """Parameters that have to be given, because their defaults in `sweep.parameters` are for an ellipsoid."""
    meanings: Mapping[str, Mapping[str, Any]] = field(default_factory=dict, hash=False)
    """Fields of a `Parameter` that differ from those in `sweep.parameters`, which describe an ellipsoid."""


def offset(columns: Columns) -> Array:
    """How far G lies below the ellipsoid's centre or the paraboloid's origin, shape (cells,)."""
    return columns["offset"] if "offset" in columns else np.zeros_like(columns["a"])


def _ellipsoid_excess(columns: Columns) -> tuple[Array, Array]:
    a, b, c = columns["a"], columns["b"], columns["c"]
    return (a**2 - c**2) / c, (b**2 - c**2) / c


def _ellipsoid_matrix(columns: Columns, angle: Array) -> tuple[Array, ...]:
    """A11, A12, A22 and A33, and the offset."""
    return *along_turned(columns["a"] ** 2, columns["b"] ** 2, angle), columns["c"] ** 2, offset(columns)


def _ellipsoid_point(u: Vector, c3, p):
    A = Symmetric(p.A11, p.A22, p.A33, p.A12, 0.0, 0.0).of(u)
    r2 = u.x * A.x + u.y * A.y + p.A33 * c3
    r = np.sqrt(r2)
    return A + Vector(0.0, 0.0, p.offset * r), r, r2


def _ellipsoid_velocity(du: Vector, x_p: Vector, inv_r, t, inv_u3, p) -> Vector:
    """x_p' = -(A u' - x (u' · x)) / r with x = -A u / r."""
    x = x_p + Vector(0.0, 0.0, p.offset)
    return (x.times(du.dot(x)) - Symmetric(p.A11, p.A22, p.A33, p.A12, 0.0, 0.0).of(du)).times(inv_r)


def _ellipsoid_elevation(u: Vector, p):
    A = Symmetric(p.A11, p.A22, p.A33, p.A12, 0.0, 0.0)
    # r - c = (r² - c²) / (r + c) and 1 + u3 = (u1² + u2²) / (1 - u3)
    r, square = np.sqrt(u.dot(A.of(u))), u.x * u.x + u.y * u.y
    excess = (p.A11 - p.A33) * u.x * u.x + 2.0 * p.A12 * u.x * u.y + (p.A22 - p.A33) * u.y * u.y
    return excess / (r + np.sqrt(p.A33)) + p.offset * square / (1.0 - u.z)


def _ellipsoid_stiffness(p):
    c = np.sqrt(p.A33)
    return (p.A11 - p.A33) / c + p.offset, p.A12 / c, (p.A22 - p.A33) / c + p.offset, c - p.offset


def _ellipsoid_normal(columns: Columns, x: Array, y: Array) -> tuple[Array, Array, Array]:
    """The point has to lie within the outline of the body seen from above."""
    a, b, c = columns["a"], columns["b"], columns["c"]
    w1, w2 = x / a**2, y / b**2
    w3 = np.sqrt(1 - (x * w1 + y * w2)) / c
    norm = np.sqrt(w1**2 + w2**2 + w3**2)
    return -w1 / norm, -w2 / norm, -w3 / norm


def _paraboloid_radii(columns: Columns) -> tuple[Array, Array]:
    return columns["c"] / (2 * columns["a"]), columns["c"] / (2 * columns["b"])


def _paraboloid_excess(columns: Columns) -> tuple[Array, Array]:
    a, b, c = columns["a"], columns["b"], columns["c"]
    return c * (0.5 - a) / a, c * (0.5 - b) / b


def _paraboloid_matrix(columns: Columns, angle: Array) -> tuple[Array, ...]:
    """S11, S12 and S22, and h."""
    return *along_turned(*_paraboloid_radii(columns), angle), columns["c"] - offset(columns)


def _paraboloid_point(u: Vector, c3, p):
    s1, s2 = p.S11 * u.x + p.S12 * u.y, p.S12 * u.x + p.S22 * u.y
    return Vector(-s1 * u.z, -s2 * u.z, 0.5 * (u.x * s1 + u.y * s2) - p.h * c3), c3, c3 * c3


def _paraboloid_velocity(du: Vector, x_p: Vector, inv_c3, t, inv_u3, p) -> Vector:
    dt1, dt2 = (du.x - t[0] * du.z) * inv_u3, (du.y - t[1] * du.z) * inv_u3
    return Vector(p.S11 * dt1 + p.S12 * dt2, p.S12 * dt1 + p.S22 * dt2, -(x_p.x * dt1 + x_p.y * dt2))


def _paraboloid_elevation(u: Vector, p):
    across = u.x * (p.S11 * u.x + p.S12 * u.y) + u.y * (p.S12 * u.x + p.S22 * u.y)
    # 1 + u3 = (u1² + u2²) / (1 - u3)
    return -0.5 * across / u.z - p.h * (u.x * u.x + u.y * u.y) / (1.0 - u.z)


def _paraboloid_stiffness(p):
    return p.S11 - p.h, p.S12, p.S22 - p.h, p.h


def _paraboloid_normal(columns: Columns, x: Array, y: Array) -> tuple[Array, Array, Array]:
    radius1, radius2 = _paraboloid_radii(columns)
    t1, t2 = x / radius1, y / radius2
    norm = np.sqrt(1 + t1**2 + t2**2)
    return -t1 / norm, -t2 / norm, -1 / norm


ELLIPSOID = Surface(
    name="ellipsoid",
    constants=("A11", "A12", "A22", "A33", "offset"),
    of=_ellipsoid_matrix,
    excess=_ellipsoid_excess,
    point=_ellipsoid_point,
    velocity=_ellipsoid_velocity,
    elevation=_ellipsoid_elevation,
    stiffness=_ellipsoid_stiffness,
    normal=_ellipsoid_normal,
    homogeneous=True,
    interior="the ellipsoid; keep |offset| < c",
    outside=lambda columns: np.abs(offset(columns)) >= columns["c"],
    bounds="offset > c - a²/c and offset > c - b²/c",
    off=lambda columns, x, y: (x / columns["a"]) ** 2 + (y / columns["b"]) ** 2 >= 1,
    outline="(x/a)² + (y/b)² < 1 in the body's axes",
)

_SHAPE = "The paraboloid is z = c (1 - a (x/c)^2 - b (y/c)^2)."

PARABOLOID = Surface(
    name="paraboloid",
    constants=("S11", "S12", "S22", "h"),
    of=_paraboloid_matrix,
    excess=_paraboloid_excess,
    point=_paraboloid_point,
    velocity=_paraboloid_velocity,
    elevation=_paraboloid_elevation,
    stiffness=_paraboloid_stiffness,
    normal=_paraboloid_normal,
    homogeneous=False,
    interior="the paraboloid; keep offset < c",
    outside=lambda columns: offset(columns) >= columns["c"],
    bounds="offset > c - c/(2 a) and offset > c - c/(2 b)",
    required=frozenset({"a", "b"}),
    meanings={
        "a": {"units": NUMBER, "long_name": "coefficient a of the paraboloid", "description": _SHAPE},
        "b": {"units": NUMBER, "long_name": "coefficient b of the paraboloid", "description": _SHAPE},
        "c": {"long_name": "height c of the paraboloid's origin", "description": "Its height above the lowest point."},
        "offset": {"description": "Depth of the centre of mass below the paraboloid's origin."},
    },
)

SURFACES: dict[str, Surface] = {surface.name: surface for surface in (ELLIPSOID, PARABOLOID)}
