"""The definition of a reversal, computed for the reference tables without the package.

A reversal is a change of sign between the means, over successive windows, of the ripple-free spin

    n* = n - Σ K_ij u_i M_j   (i, j = 1, 2),   M = I ω - x_p × v_g,

with u the upward normal and M the angular momentum about the contact point, in the body's axes.  The window is the
period of the slower rocking about upright rest without slip.  K removes what this rocking does to n to second order
and without lasting effect: with z = (u1, u2, M1, M2), z' = L z and n' = zᵀ G z at n = 0 without slip, the spin minus
zᵀ Q z has only the secular part of n', if LᵀQ + Q L is the rest of G.  K is twice the u-M block of Q, the only one that
does not vanish.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import combinations_with_replacement
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

T_END = 30_000.0
"""Reversals are counted up to this time, in sqrt(c/g)."""

AMPLITUDE = 1e-10
"""Size of the rocking, in radians, from which L and G are computed.  Their error is its square, times (a/c)⁴ at worst.
Round-off stays relative, as no two terms of the rates cancel."""

SECULAR = 1e-6
"""A λ_i + λ_j below this share of the largest λ is zero but for round-off."""


def window_and_ripple(shape: Array, inertia: Array) -> tuple[float, Array]:
    """The window and K (2 × 2) of the body with the matrix `shape` of squared semi-axes and these moments, g = 1."""
    unit = np.sqrt(np.diag(shape)[:2].min() * inertia[:2].max())
    # Units in which u and M are of one size; n' is quadratic, so that products of two units turn into the values of G.
    basis = np.diag([1.0, 1.0, unit, unit])
    rates = {
        (i, j): rolling(AMPLITUDE * (basis[i] + basis[j]), shape, inertia)
        for i, j in combinations_with_replacement(range(4), 2)
    }
    linear = np.array([rates[i, i][0] for i in range(4)]).T / (2 * AMPLITUDE)
    G = np.empty((4, 4))
    for (i, j), (_, rate) in rates.items():
        alone = (rates[i, i][1] + rates[j, j][1]) / 4
        G[i, j] = G[j, i] = (rate - alone) / (2 * AMPLITUDE**2)
    values, modes = np.linalg.eig(linear / np.diag(basis)[:, None])
    sums = values[:, None] + values[None, :]
    secular = np.abs(sums) < SECULAR * np.abs(values).max()
    in_modes = modes.T @ G @ modes
    Q_modes = np.where(secular, 0.0, in_modes / np.where(secular, 1.0, sums))
    inverse = np.linalg.inv(modes)
    Q = (inverse.T @ Q_modes @ inverse).real
    return float(2 * np.pi / np.abs(values.imag).min()), 2 * Q[:2, 2:] / unit


def rolling(z: Array, shape: Array, inertia: Array) -> tuple[Array, float]:
    """(z', n') of z = (u1, u2, M1, M2) when the body rolls without slip and n = 0."""
    u = np.array([z[0], z[1], -np.sqrt(1 - z[0] ** 2 - z[1] ** 2)])
    height = np.sqrt(u @ shape @ u)
    x_p = -shape @ u / height
    about_contact = np.diag(inertia) + (x_p @ x_p) * np.eye(3) - np.outer(x_p, x_p)
    omega = np.linalg.solve(np.vstack([about_contact[:2], u]), [z[2], z[3], 0.0])
    du = np.cross(u, omega)
    dx_p = (x_p * (x_p @ du) - shape @ du) / height
    v_g, M = np.cross(x_p, omega), about_contact @ omega
    dM = np.cross(x_p, u) - np.cross(dx_p + np.cross(omega, x_p), v_g) - np.cross(omega, M)
    # ω' from the contact force that keeps v_g = x_p × ω; n' = u · ω' because u' is perpendicular to ω.
    force = u + np.cross(omega, v_g) + np.cross(dx_p, omega)
    torque = np.cross(x_p, force) - np.cross(omega, inertia * omega)
    return np.concatenate([du[:2], dM[:2]]), float(u @ np.linalg.solve(about_contact, torque))


@dataclass
class Means:
    """Means of n* over windows, from its integral after each half window."""

    window: float
    integrals: list[Any] = field(default_factory=lambda: [0.0])

    def averages(self, shift: int = 0) -> Array:
        """Means over successive windows that begin `shift` half windows after the start and end by `T_END`."""
        last = int(2 * T_END / self.window)
        return np.asarray(np.diff(np.array(self.integrals[: last + 1])[shift::2]) / self.window)

    def times(self, shift: int = 0) -> Array:
        """Zeros of the lines between two means of opposite sign, each at its window's centre."""
        means = self.averages(shift)
        k = np.flatnonzero(means[1:] * means[:-1] < 0)
        here, after = means[k], means[k + 1]
        return np.asarray(self.window * (shift / 2 + k + 0.5 + here / (here - after)))

    def reversals(self, shift: int = 0) -> int:
        return len(self.times(shift))

    def last_reversal(self) -> float:
        """The time of the last reversal; NaN if there is none."""
        return float(self.times()[-1]) if self.reversals() else float("nan")

    def closest(self, shift: int = 0) -> float:
        """How close to zero a mean turns back, or ends: close ones may be counted or not."""
        means = self.averages(shift).astype(float)
        rise = np.diff(means)
        turns = means[1:-1][rise[:-1] * rise[1:] <= 0]
        return float(np.abs(np.append(turns, means[-1])).min())
