"""Bounds on what a body of `general` may do, from its energy at the start: how hard it presses, slips and turns.

The step of an explicit method, and the energy below which a law of friction is linear, follow.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from sweep.models.general import rigid_body, starts
from sweep.models.general.common import record
from sweep.models.general.couples import Couple
from sweep.models.general.surfaces import ELLIPSOID, Surface
from sweep.models.model import Array, Columns


def faint_energy(speed: Array, columns: Columns, surface: Surface) -> Array:
    """Energy of a rattle whose slip velocity is below `speed`, per unit mass, shape (cells,).

    With ω = n u + o the slip v_p = v_g - x_p × o - n x_p × u is at most sqrt(2 E G) + |n| ρ.  G is the largest
    eigenvalue of 1 - [x_p] J⁻¹ [x_p], and ρ <= s sqrt(2 E / (g k)) the distance of the contact point from the
    vertical through G, with the larger radius of curvature s and the stiffness k.  Spins up to sqrt(g/c) are allowed
    for.
    """
    c, g = columns["c"], rigid_body.gravity(columns)
    inverse = np.linalg.eigvalsh(rigid_body.matrix(rigid_body.inverse(rigid_body.inertia(columns))))[:, -1]
    stiffness, height = rigid_body.stiffness(columns, surface), rigid_body.height(columns)
    grip, arm = 1 + height**2 * inverse, height + np.maximum(*stiffness)
    per_root = np.sqrt(2 * grip) + np.sqrt(g / c) * arm * np.sqrt(2 / (g * np.minimum(*stiffness)))
    return np.asarray((speed / per_root) ** 2)


def couples_decay(couples: Sequence[Couple], columns: Columns, surface: Surface) -> Array:
    """Bound on the rate at which couples damp the angular velocity, shape (cells,)."""
    rate, about_normal = np.zeros_like(columns["a"]), np.zeros_like(columns["a"])
    for couple in couples:
        strength = couple.strongest(columns)
        if couple.about_normal:
            about_normal = about_normal + strength * hardest_turn(columns, surface)
        else:
            rate = rate + (strength * _hardest_press(columns, surface) if couple.needs_normal_force else strength)
    return np.asarray(rate / np.linalg.eigvalsh(rigid_body.matrix(rigid_body.inertia(columns)))[:, 0] + about_normal)


def _energy_start(columns: Columns, surface: Surface) -> Array:
    """Energy above rest at the start, per unit mass, shape (cells,)."""
    y = starts.slipping(columns, surface) if "slip1" in columns else (*starts.rolling(columns, surface), 0.0, 0.0)
    spin, rattle, inertia = rigid_body.energy_on(surface)(y, record(surface).of(columns))
    return np.asarray(rattle + 0.5 * inertia * spin**2)


_AZIMUTHS, _SHARES = 12, 9


def _attitudes(columns: Columns, surface: Surface) -> Iterator[tuple[Array, Array]]:
    """Attitudes that a body may reach, for more and more tilted ones.

    Yields normals u, shape (azimuths, cells, 3), with bounds on the normal force R, shape (azimuths, cells).

    A body tilts at most until the height of G takes up the whole energy at the start, E0.  If it tilts towards the
    azimuth ψ at the rate φ', then R - g <= r'' φ'², where r is the height of G at the tilt φ above that at rest, and

        φ'² <= 2 (E0 - g r) / (J_t + r'²),

    where J_t is the least moment of inertia about the axis of tilting, with free spin.
    """
    constants, g = record(surface).of(columns), rigid_body.gravity(columns)
    E0, J = _energy_start(columns, surface), rigid_body.matrix(rigid_body.inertia(columns))
    psi = np.linspace(0, np.pi, _AZIMUTHS, endpoint=False)[:, None]
    cos, sin = np.cos(psi), np.sin(psi)

    def height(phi: Array) -> Array:
        """The height of G above that at rest, if the body is tilted by φ."""
        return np.asarray(surface.elevation(cos * np.sin(phi), sin * np.sin(phi), -np.cos(phi), constants))

    # The largest tilt that the energy allows, by bisection; heights grow with the tilt, at least at first.
    low, high = np.zeros((_AZIMUTHS, E0.size)), np.full((_AZIMUTHS, E0.size), 1.5)
    for _ in range(40):
        middle = (low + high) / 2
        within = g * height(middle) < E0
        low, high = np.where(within, middle, low), np.where(within, high, middle)
    axis = np.concatenate([-sin, cos, 0 * sin], axis=-1)[:, None]
    for share in np.linspace(0, 1, _SHARES):
        phi, d = high * share, 1e-4
        r, ahead, behind = height(phi), height(phi + d), height(phi - d)
        slope, bend = (ahead - behind) / (2 * d), (ahead - 2 * r + behind) / d**2
        u = np.stack([cos * np.sin(phi), sin * np.sin(phi), -np.cos(phi)], axis=-1)
        tt, tu, uu = (_product(p, J, q) for p, q in ((axis, axis), (axis, u), (u, u)))
        square = 2 * np.maximum(E0 - g * r, 0) / (tt - tu**2 / uu + slope**2)
        yield u, g + np.maximum(bend, 0) * square


def _product(p: Array, matrix: Array, q: Array) -> Array:
    """Pᵀ M q, of vectors of shape (..., cells, 3) and matrices of shape (cells, 3, 3)."""
    return np.asarray(np.einsum("...i,...ij,...j->...", p, matrix, q))


def _hardest_press(columns: Columns, surface: Surface) -> Array:
    """Bound on the normal force over the trajectory, per unit mass, shape (cells,)."""
    return np.asarray(np.max([R for _, R in _attitudes(columns, surface)], axis=(0, 1)))


def hardest_turn(columns: Columns, surface: Surface) -> Array:
    """Bound on R uᵀ J⁻¹ u over the trajectory, shape (cells,): the decay of the spin per unit of its resistance."""
    inverse = rigid_body.matrix(rigid_body.inverse(rigid_body.inertia(columns)))
    found = [R * _product(u, inverse, u) for u, R in _attitudes(columns, surface)]
    return np.asarray(np.max(found, axis=(0, 1)))


def strongest_grip(columns: Columns, surface: Surface = ELLIPSOID) -> Array:
    """Bound on the decay rate of the slip per unit of friction's resistance, shape (cells,).

    Friction on a slip v changes it by -R k (1 - [x_p] J⁻¹ [x_p]) v, where [x] is the matrix of x ×.
    """
    constants = record(surface).of(columns)
    inverse = rigid_body.matrix(rigid_body.inverse(rigid_body.inertia(columns)))
    worst = np.zeros_like(columns["a"])
    for u, R in _attitudes(columns, surface):
        _, point, _, _ = surface.contact(u[..., 0], u[..., 1], 0.0, 0.0, 0.0, constants)
        x_p = np.stack(point, axis=-1)
        X = np.cross(np.eye(3), x_p[..., None, :])
        G = X @ inverse @ np.swapaxes(X, -1, -2)
        # One eigenvalue is zero, along x_p; the larger of the others follows from the traces of G and G².
        trace, squares = np.trace(G, axis1=-2, axis2=-1), (G * G).sum(axis=(-1, -2))
        largest = 0.5 * (trace + np.sqrt(np.maximum(2 * squares - trace**2, 0)))
        worst = np.maximum(worst, (R * (1 + largest)).max(axis=0))
    return worst
