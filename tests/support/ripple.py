"""The ripple-free spin found a second way: numerically, from a rolling body, in the eigenbasis of its rocking."""

import numpy as np

from sweep.models.ladder import noslip
from sweep.models.model import take


def rolling(states: np.ndarray, body: dict[str, np.ndarray]) -> np.ndarray:
    """(u1, u2, ω1, ω2, ω3) at n = 0 from z = (u1, u2, M1, M2), to first order, with ω3 such that u · ω = 0."""
    b2, a2, c2 = (float(body[name][0]) ** 2 for name in ("b", "a", "c"))
    u, omega = states[:2], states[2:] / np.array([(b2 + c2) / 5 + c2, (a2 + c2) / 5 + c2])
    return np.array([*u, *omega, u @ omega])


def form(body: dict[str, np.ndarray]) -> np.ndarray:
    """K, shape (2, 2): twice the u-M block of Q, Q_ij = G_ij / (λ_i + λ_j), from n' = zᵀ G z and z' = L z."""
    constants, size = take(noslip.MODEL.constants.of(body), 0), 1e-3 * float((body["c"] / body["a"])[0]) ** 2
    moments = np.array([1.0, 1.0, *(1 / (rolling(np.array([0, 0, 1.0, 0]), body)[2:3])),
                        *(1 / (rolling(np.array([0, 0, 0, 1.0]), body)[3:4]))])  # fmt: skip

    def slopes(z: np.ndarray) -> tuple[np.ndarray, float]:
        y = rolling(z, body)
        dy = np.array(noslip.MODEL.rhs(tuple(y), constants)[0])
        u = np.array([*y[:2], -np.sqrt(1 - y[:2] @ y[:2])])
        return dy[:4] * moments, float(u @ dy[2:])

    axes = size * np.eye(4)
    L = np.array([slopes(z)[0] / size for z in axes]).T
    G = np.array([[(slopes(i + j)[1] - slopes(i - j)[1]) / (4 * size**2) for j in axes] for i in axes])
    rates, V = np.linalg.eig(L)
    sums = rates[:, None] + rates
    resonant = np.abs(sums) < 1e-6
    Q = np.where(resonant, 0, (V.T @ G @ V) / np.where(resonant, 1, sums))
    inverse = np.linalg.inv(V)
    return np.asarray((2 * inverse.T @ Q @ inverse).real[:2, 2:])
