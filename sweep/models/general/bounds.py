"""Bound how hard a body of `general` can press, slip and turn, from its energy at the start.

The step of an explicit method, and the energy below which a law of friction is linear, follow.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sweep.models.general import rigid_body, starts
from sweep.models.general.common import Variant
from sweep.models.general.rigid_body import about_centre
from sweep.models.general.surfaces import Surface
from sweep.models.model import Array, Columns
from sweep.models.vectors import Vector


def faint_energy(speed: Array, columns: Columns, surface: Surface) -> Array:
    """Energy of a rattle whose slip velocity is below `speed`, per unit mass, shape (cells,).

    With ω = n u + o the slip v_p = v_g - x_p × o - n x_p × u is at most sqrt(2 E G) + |n| ρ.  G is the largest
    eigenvalue of 1 - [x_p] J⁻¹ [x_p], and ρ <= s sqrt(2 E / (g k)) the distance of the contact point from the
    vertical through G, with the larger radius of curvature s and the stiffness k.  This allows for spins up to
    sqrt(g/c).
    """
    c, g = columns["c"], rigid_body.gravity(columns)
    inverse = np.linalg.eigvalsh(rigid_body.matrix(rigid_body.inverse(rigid_body.inertia(columns))))[:, -1]
    stiffness, height = rigid_body.stiffness(columns, surface), rigid_body.height(columns)
    grip, arm = 1 + height**2 * inverse, height + np.maximum(*stiffness)
    per_root = np.sqrt(2 * grip) + np.sqrt(g / c) * arm * np.sqrt(2 / (g * np.minimum(*stiffness)))
    return np.asarray((speed / per_root) ** 2)


def couples_decay(scene: Variant, columns: Columns) -> Array:
    """Bound on the rate at which the couples of a scene damp the angular velocity, shape (cells,)."""
    rate, about_normal = np.zeros_like(columns["a"]), np.zeros_like(columns["a"])
    for couple in scene.couples:
        strength = couple.strongest(columns)
        if couple.about_normal:
            about_normal = about_normal + strength * hardest_turn(scene, columns)
        else:
            rate = rate + (strength * _hardest_press(scene, columns) if couple.needs_normal_force else strength)
    return np.asarray(rate / np.linalg.eigvalsh(rigid_body.matrix(rigid_body.inertia(columns)))[:, 0] + about_normal)


def _energy_start(columns: Columns, surface: Surface) -> Array:
    """Energy above rest at the start, per unit mass, shape (cells,)."""
    y = starts.slipping(columns, surface) if "slip1" in columns else (*starts.rolling(columns, surface), 0.0, 0.0)
    spin, rattle, inertia = rigid_body.energy_on(surface)(y, rigid_body.constants(columns, surface))
    return np.asarray(rattle + 0.5 * inertia * spin**2)


_AZIMUTHS, _SHARES, _ROUNDS = 4, 7, 6

# Number of tilts examined, and how far beyond the last approximation, which comes from below.
_FAINT, _FARTHEST, _BEYOND, _FLAT = 1e-6, 1.5, 1.01, 1e-30


def _attitudes(scene: Variant, columns: Columns) -> Iterator[tuple[Vector, Array]]:
    """Attitudes that a body may reach, at increasing tilts.

    Yields normals u with bounds on the normal force R, all of shape (azimuths, cells).

    A body tilts at most until the height of G takes up the whole energy at the start, E0.  If it tilts towards the
    azimuth ψ at the rate φ', then R - g <= r'' φ'², where r is the height of G at the tilt φ above that at rest, and

        φ'² <= 2 (E0 - g r) / (J_t + r'²),

    where J_t is the least moment of inertia about the axis of tilting, with free spin.  Where the energy may grow, E0
    allows for what it takes to fall over.
    """
    surface = scene.surface
    p, E0 = rigid_body.constants(columns, surface), _energy_start(columns, surface)
    psi = np.linspace(0, np.pi, _AZIMUTHS, endpoint=False)[:, None] - rigid_body.axes(columns)
    cos, sin = np.cos(psi), np.sin(psi)

    def tilted(phi: Array) -> Vector:
        return Vector(cos * np.sin(phi), sin * np.sin(phi), -np.cos(phi))

    def height(phi: Array) -> Array:
        """The height of G above that at rest, if the body is tilted by φ."""
        return np.asarray(surface.elevation(tilted(phi), p))

    if not scene.assumes.conservative:
        E0 = E0 + (p.g * height(np.full_like(psi, _FARTHEST))).max(axis=0)
    # The largest tilt that the energy allows.  Heights grow with its square at first, and more slowly later.
    k11, k12, k22, _ = surface.stiffness(p)
    energy = np.maximum(E0, 0) / p.g
    farthest = np.sqrt(2 * energy / np.maximum(k11 * cos**2 + 2 * k12 * cos * sin + k22 * sin**2, _FLAT))
    for _ in range(_ROUNDS):
        farthest = np.clip(farthest, _FAINT, _FARTHEST)
        farthest = farthest * np.sqrt(energy / np.maximum(height(farthest), _FLAT))
    farthest = np.minimum(_BEYOND * farthest, _FARTHEST)
    axis = Vector(-sin, cos, 0.0)
    for share in np.linspace(0, 1, _SHARES):
        phi, d = farthest * share, 1e-4
        r, ahead, behind = height(phi), height(phi + d), height(phi - d)
        slope, bend = (ahead - behind) / (2 * d), (ahead - 2 * r + behind) / d**2
        u = tilted(phi)
        turning, spinning = rigid_body.momentum(axis, p), rigid_body.momentum(u, p)
        least = axis.dot(turning) - axis.dot(spinning) ** 2 / u.dot(spinning)
        square = 2 * np.maximum(E0 - p.g * r, 0) / (least + slope**2)
        yield u, p.g + np.maximum(bend, 0) * square


def _hardest_press(scene: Variant, columns: Columns) -> Array:
    """Bound on the normal force over the trajectory, per unit mass, shape (cells,)."""
    return np.asarray(np.max([R for _, R in _attitudes(scene, columns)], axis=(0, 1)))


def hardest_turn(scene: Variant, columns: Columns) -> Array:
    """Bound on R uᵀ J⁻¹ u over the trajectory, shape (cells,): the decay of the spin per unit of its resistance."""
    p = rigid_body.constants(columns, scene.surface)
    return np.asarray(np.max([R * u.dot(about_centre(u, p)) for u, R in _attitudes(scene, columns)], axis=(0, 1)))


def strongest_grip(scene: Variant, columns: Columns) -> Array:
    """Bound on the decay rate of the slip per unit of friction's resistance, shape (cells,).

    Friction on a slip v changes it by -R k (1 + G) v with G = -[x_p] J⁻¹ [x_p], where [x] is the matrix of x ×.  One
    eigenvalue of G is zero, along x_p.  The sum of the others is the trace of G, and their product is
    |x_p|² x_pᵀ J x_p / det J.
    """
    p, contact = rigid_body.constants(columns, scene.surface), rigid_body.contact_on(scene.surface)
    volume = p.J11 * p.J22 * p.J33 - p.J11 * p.J23**2 - p.J22 * p.J13**2
    trace_of_inverse = p.inv_J11 + p.inv_J22 + p.inv_J33
    worst = np.zeros_like(columns["a"])
    for u, R in _attitudes(scene, columns):
        _, _, x_p, _, _ = contact(u.x, u.y, Vector(0.0, 0.0, 0.0), p)
        square = x_p.dot(x_p)
        half = 0.5 * (trace_of_inverse * square - x_p.dot(about_centre(x_p, p)))
        product = square * x_p.dot(rigid_body.momentum(x_p, p)) / volume
        largest = half + np.sqrt(np.maximum(half**2 - product, 0))
        worst = np.maximum(worst, (R * (1 + largest)).max(axis=0))
    return worst


def grip_at_rest(columns: Columns) -> Array:
    """The decay rate of the slip per unit of friction's resistance at upright rest, shape (cells,)."""
    i11, i22, _, i12, _, _ = rigid_body.inverse(rigid_body.inertia(columns))
    largest = 0.5 * (i11 + i22) + np.sqrt(0.25 * (i11 - i22) ** 2 + i12**2)
    return np.asarray(rigid_body.gravity(columns) * (1 + rigid_body.height(columns) ** 2 * largest))
