"""The surfaces on which a rigid body rolls and slips: the ellipsoid, and the elliptic paraboloid.

The axes are those of the surface, x and y along its principal curvatures at the lowest point of the body at rest, z
down; they begin at the centre of mass G, at the height h = c - offset above that point.  u is the upward normal of the
plane.  A variant of the equations is made for one surface and has no instruction of the other.  To add a surface, enter
its `Surface` in `SURFACES`.

Ellipsoid with the semi-axes a, b and c, its centre `offset` above G.  With A = diag(a², b², c²) and r = sqrt(uᵀ A u),

    x_p = -A u / r - offset ẑ,   -x_p · u = r + offset u3.

Paraboloid z = c (1 - a (x/c)² - b (y/c)²), its origin `offset` above G: c is the length in which it is measured, and a
and b are pure numbers.  With the radii of curvature at its lowest point, s1 = c/(2 a) and s2 = c/(2 b), and t = u/u3,

    x_p = (s1 t1, s2 t2, h - (s1 t1² + s2 t2²)/2),   -x_p · u = -u3 (h + (s1 t1² + s2 t2²)/2).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sweep.jit import inline
from sweep.models.model import Array, Columns
from sweep.units import NUMBER


@dataclass(frozen=True)
class Surface:
    """A surface.  Heights are those of G above the plane; lengths are in any unit."""

    name: str
    """As in the configuration."""
    constants: tuple[str, ...]
    of: Callable[[Columns], tuple[Array, ...]]
    """(columns) -> values of `constants`, each of shape (cells,)."""
    excess: Callable[[Columns], tuple[Array, Array]]
    """(columns) -> radii of curvature along x and y at the lowest point of the body at rest, less c and without loss of
    digits, each of shape (cells,)."""
    contact: Callable[..., Any]
    """Inline, (u1, u2, ω1, ω2, ω3, constants) -> (u3, 1/u3), the contact point x_p, u' = u × ω, and x_p', the velocity
    of the contact point in the body."""
    elevation: Callable[..., Any]
    """Inline, (u1, u2, u3, constants) -> the height above that at rest, quadratic in u1 and u2 and precise however
    small they are."""
    normal: Callable[[Columns, Array, Array], tuple[Array, Array, Array]]
    """(columns, x, y) -> u for the contact point at x and y, which has to be one."""
    homogeneous: bool
    """Whether the inertia is that of a homogeneous body unless it is given."""
    interior: str
    """Where the centre of mass has to lie, and what to do if it does not, in words."""
    outside: Callable[[Columns], Array]
    """(columns) -> whether it lies elsewhere, shape (cells,)."""
    bounds: str
    """For which offsets upright rest is stable, in words."""
    off: Callable[[Columns, Array, Array], Array] = lambda columns, x, y: np.zeros(np.shape(x), bool)
    """(columns, x, y) -> whether no point of it lies at x and y, shape (cells,); by default some does anywhere."""
    outline: str = ""
    """What holds of x and y within it, in words."""
    required: frozenset[str] = frozenset()
    """Parameters that have to be given, because their defaults in `sweep.parameters` are of an ellipsoid."""
    meanings: Mapping[str, Mapping[str, Any]] = field(default_factory=dict, hash=False)
    """Fields of a `Parameter` that differ from those in `sweep.parameters`, which are of an ellipsoid."""


def offset(columns: Columns) -> Array:
    """How far G lies below the ellipsoid's centre or the paraboloid's origin, shape (cells,)."""
    return columns["offset"] if "offset" in columns else np.zeros_like(columns["a"])


def _ellipsoid_excess(columns: Columns) -> tuple[Array, Array]:
    a, b, c = columns["a"], columns["b"], columns["c"]
    return (a**2 - c**2) / c, (b**2 - c**2) / c


@inline
def contact(u1, u2, w1, w2, w3, p):
    """As `Surface.contact`, of the ellipsoid."""
    a2, b2, c2 = p.a2, p.b2, p.c2
    u3 = -np.sqrt(1.0 - (u1 * u1 + u2 * u2))
    au1, au2, au3 = a2 * u1, b2 * u2, c2 * u3
    r = np.sqrt(u1 * au1 + u2 * au2 + u3 * au3)
    # One division is enough for both 1/r and 1/u3.
    shared = 1.0 / (r * u3)
    inv_r, inv_u3 = shared * u3, shared * r
    x, y, below = -au1 * inv_r, -au2 * inv_r, -au3 * inv_r

    du1, du2, du3 = u2 * w3 - u3 * w2, u3 * w1 - u1 * w3, u1 * w2 - u2 * w1
    s = (du1 * au1 + du2 * au2 + du3 * au3) * inv_r
    dx, dy, dz = -inv_r * (a2 * du1 + x * s), -inv_r * (b2 * du2 + y * s), -inv_r * (c2 * du3 + below * s)
    return (u3, inv_u3), (x, y, below - p.offset), (du1, du2, du3), (dx, dy, dz)


@inline
def _ellipsoid_elevation(u1, u2, u3, p):
    r = np.sqrt(p.a2 * u1 * u1 + p.b2 * u2 * u2 + p.c2 * u3 * u3)
    # r - c = (r² - c²) / (r + c) and 1 + u3 = (u1² + u2²) / (1 - u3)
    c = np.sqrt(p.c2)
    height = ((p.a2 - p.c2) * u1 * u1 + (p.b2 - p.c2) * u2 * u2) / (r + c)
    return height + p.offset * (u1 * u1 + u2 * u2) / (1.0 - u3)


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


@inline
def _paraboloid_contact(u1, u2, w1, w2, w3, p):
    u3 = -np.sqrt(1.0 - (u1 * u1 + u2 * u2))
    inv_u3 = 1.0 / u3
    t1, t2 = u1 * inv_u3, u2 * inv_u3
    x, y = p.radius1 * t1, p.radius2 * t2
    du1, du2, du3 = u2 * w3 - u3 * w2, u3 * w1 - u1 * w3, u1 * w2 - u2 * w1
    dt1, dt2 = (du1 - t1 * du3) * inv_u3, (du2 - t2 * du3) * inv_u3
    z = p.h - 0.5 * (x * t1 + y * t2)
    return (u3, inv_u3), (x, y, z), (du1, du2, du3), (p.radius1 * dt1, p.radius2 * dt2, -(x * dt1 + y * dt2))


@inline
def _paraboloid_elevation(u1, u2, u3, p):
    x, y = p.radius1 * u1 / u3, p.radius2 * u2 / u3
    # 1 + u3 = (u1² + u2²) / (1 - u3)
    return -0.5 * (x * u1 + y * u2) - p.h * (u1 * u1 + u2 * u2) / (1.0 - u3)


def _paraboloid_normal(columns: Columns, x: Array, y: Array) -> tuple[Array, Array, Array]:
    radius1, radius2 = _paraboloid_radii(columns)
    t1, t2 = x / radius1, y / radius2
    norm = np.sqrt(1 + t1**2 + t2**2)
    return -t1 / norm, -t2 / norm, -1 / norm


ELLIPSOID = Surface(
    name="ellipsoid",
    constants=("a2", "b2", "c2", "offset"),
    of=lambda columns: (*(columns[axis] ** 2 for axis in "abc"), offset(columns)),
    excess=_ellipsoid_excess,
    contact=contact,
    elevation=_ellipsoid_elevation,
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
    constants=("radius1", "radius2", "h"),
    of=lambda columns: (*_paraboloid_radii(columns), columns["c"] - offset(columns)),
    excess=_paraboloid_excess,
    contact=_paraboloid_contact,
    elevation=_paraboloid_elevation,
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
