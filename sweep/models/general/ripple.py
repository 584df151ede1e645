"""The ripple-free spin of any rigid body: that of `sweep.models.theory.ripple`, generalised.

With h = c - offset, the height of the centre of mass, and without slip at n = 0, to second order in the rattle,

    d(M · u)/dt = -h (s1 - s2) ω1 ω2,
    M · u = J33 n + P,   P = Σ u_i (J_ij + (h² - J33 - h s_i) δ_ij) ω_j

with the radii of curvature s at the lowest point; for the ellipsoid they are a²/c and b²/c.

P is a ripple.  In the eigenbasis of the rocking z' = L z, z = (u1, u2, ω1, ω2), with eigenvalues λ, the right-hand side
G of the first line is the derivative of κ_jk = G_jk / (λ_j + λ_k), but for the pairs with λ_j + λ_k = 0, which change
the spin.  So J33 K is the form of κ less that of P.  K is turned into a form of u and the angular momentum M about the
contact point, which is not affected by friction.

If the third axis of the ellipsoid is no axis of inertia, the spin ripples in first order too: n = (M · u + J13 ω1 + J23
ω2) / J33.  Only this ripple is taken away then.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sweep.jit import inline
from sweep.models.general import rigid_body
from sweep.models.general.surfaces import ELLIPSOID, Surface
from sweep.models.model import Array, Columns

NAMES = ("K11", "K12", "K21", "K22", "P11", "P12", "P22", "h", "turn1", "turn2", "J13", "J23")


def form(columns: Columns, surface: Surface = ELLIPSOID) -> tuple[Array, ...]:
    """Values of `NAMES`, each of shape (cells,): K, the matrix P of M = P ω at rest, and what M has of n, v and n."""
    names = sorted(set(rigid_body.PARAMETERS) & set(columns))
    bodies, which = np.unique(np.stack([columns[name] for name in names]), axis=1, return_inverse=True)
    values = _form(dict(zip(names, bodies, strict=True)), surface)
    return tuple(each[which.reshape(-1)] for each in values)


def _form(columns: Columns, surface: Surface) -> tuple[Array, ...]:
    J11, J22, J33, J12, J13, J23 = rigid_body.inertia(columns)
    h, g, (s1, s2) = rigid_body.height(columns), rigid_body.gravity(columns), surface.radii(columns)
    k1, k2 = rigid_body.stiffness(columns, surface)
    nothing, one = np.zeros_like(h), np.ones_like(h)
    P = _rows((J11 + h**2, J12), (J12, J22 + h**2))
    # u' = (ω2, -ω1), M' = g (k2 u2, -k1 u1)
    B, C = _rows((nothing, one), (-one, nothing)), _rows((nothing, g * k2), (-g * k1, nothing))
    L = np.zeros((len(h), 4, 4))
    L[:, :2, 2:], L[:, 2:, :2] = B, np.linalg.solve(P, C)
    G = np.zeros_like(L)
    G[:, 2, 3] = G[:, 3, 2] = -0.5 * h * (s1 - s2)

    rates, V = np.linalg.eig(L)
    # A body that is round about one axis, or falls over, has one mode only, and no slower period to average over.
    odd = (k1 <= 0) | (k2 <= 0)
    V[odd] = np.eye(4)
    sums = rates[:, :, None] + rates[:, None, :]
    slow = np.abs(sums) < 1e-9 * np.abs(rates).max(axis=1)[:, None, None]
    inverse = np.linalg.inv(V)
    Q = np.where(slow, 0, np.swapaxes(V, 1, 2) @ G @ V / np.where(slow, 1, sums))
    kappa = 2 * (np.swapaxes(inverse, 1, 2) @ Q @ inverse).real[:, :2, 2:]
    ripple = _rows((J11 + h**2 - J33 - h * s1, J12), (J12, J22 + h**2 - J33 - h * s2))
    K = (kappa - ripple) @ np.linalg.inv(P) / J33[:, None, None]
    K[odd | (J13 != 0) | (J23 != 0)] = 0
    entries = (K[:, 0, 0], K[:, 0, 1], K[:, 1, 0], K[:, 1, 1])
    return *entries, P[:, 0, 0], P[:, 0, 1], P[:, 1, 1], h, h * s1, h * s2, J13 / J33, J23 / J33


def _rows(first: tuple[Array, Array], second: tuple[Array, Array]) -> Array:
    return np.stack([np.stack(first, axis=-1), np.stack(second, axis=-1)], axis=-2)


@inline
def slipping(y: Any, p: Any, k: Any) -> Any:  # noqa: ARG001
    """n - n*, with M to first order in the rattle."""
    u1, u2, w1, w2, w3, v1, v2 = y
    M1 = k[4] * w1 + k[5] * w2 + k[7] * v2 + k[8] * w3 * u1
    M2 = k[5] * w1 + k[6] * w2 - k[7] * v1 + k[9] * w3 * u2
    return (k[0] * u1 + k[2] * u2) * M1 + (k[1] * u1 + k[3] * u2) * M2 + k[10] * w1 + k[11] * w2


@inline
def rolling(y: Any, p: Any, k: Any) -> Any:
    """As `slipping`, without slip."""
    u1, u2, w1, w2, w3 = y
    return slipping((u1, u2, w1, w2, w3, 0.0, 0.0), p, k)
