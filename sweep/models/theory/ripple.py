"""The ripple-free spin n* = n - Σ K_ij u_i M_j: the spin without its ripple due to the rattle.

A rattle makes the spin ripple at twice the frequencies of its two modes, and at their sum and difference.  Without
slip, at n = 0 and to second order in the rattle, this ripple is the bilinear form K of u and of the angular momentum M
about the contact point.  What is left in n* is the mean change of the spin that the paper describes (ndotab).

The contact force has no torque about the contact point, so that to second order, with J_i = I_i + c² and
ω_i = M_i / J_i,

    d(M · u)/dt = A12 (ω1² - ω2²) - (A11 - A22) ω1 ω2 = H(M),
    M · u = I3 n + P(u, M),   P = Σ_i ((1 - I3/J_i) u_i - (A u)_i / J_i) M_i.

P is a ripple.  H is written in the modes of the rocking (`sweep.models.theory.rocking`),

    u = Σ e_k q_k,   M = Σ f_k p_k,   q_k' = ν_k p_k,   p_k' = -ν_k q_k,   f_k = ν_k B⁻¹ e_k,

as Σ h_jk p_j p_k.  The part of it that oscillates is the derivative of Σ κ_jk q_j p_k with

    κ_kk = h_kk / 2 ν_k,   κ_12 = 2 h_12 ν_1 / (ν_1² - ν_2²),   κ_21 = -2 h_12 ν_2 / (ν_1² - ν_2²).

The rest, h_kk times the mean of p_k², changes the spin.  So I3 K is the form of κ less that of P.

For a small rolling rattle at n = 0, K leaves 1e-6 of the ripple (a = 10, b = 5, δ = 0.03; u = 1e-4): terms of fourth
order.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sweep.jit import inline
from sweep.models.model import Array, Columns, stack
from sweep.models.theory.rocking import Rocking

FORM = ("K11", "K12", "K21", "K22")

_APART = 1e-9
"""Share by which the squares of two frequencies have to differ: otherwise the spin is not averaged over the ripple at
their difference."""


def for_each_body(of: Callable[[Columns], tuple[Array, ...]], columns: Columns) -> tuple[Array, ...]:
    """The result of `of` for columns, computed once for identical cells."""
    bodies, which = np.unique(stack(tuple(columns.values())), axis=1, return_inverse=True)
    return tuple(each[which.reshape(-1)] for each in of(dict(zip(columns, bodies, strict=True))))


def ripple_free(of: Rocking, H: Array, P: Array, I3: Array) -> tuple[Array, ...]:
    """K11, K12, K21 and K22, each of shape (bodies,), for the forms H of M and P of u and M, shape (bodies, 2, 2)."""
    B11, B12, B21, B22, C11, C12, C21, C22 = of
    B, C = matrix(B11, B12, B21, B22), matrix(C11, C12, C21, C22)
    # Both are real, since rocking without friction keeps its energy.  NumPy 2.5 returns them as complex numbers.
    minus_squares, e = (values.real for values in np.linalg.eig(B @ C))
    # A body that is round about one axis has one mode only, and no slower period to average over.
    round_ = np.asarray((minus_squares >= 0).any(axis=1))
    squares = np.where(round_[:, None], 1.0, -minus_squares)
    e[round_] = np.eye(2)
    nu = np.sqrt(squares)
    f = np.linalg.inv(B) @ e * nu[:, None, :]
    h = np.swapaxes(f, 1, 2) @ H @ f
    apart = squares[:, 0] - squares[:, 1]
    mixed = np.divide(2 * h[:, 0, 1], apart, out=np.zeros_like(apart), where=np.abs(apart) > _APART * squares[:, 0])
    kappa = matrix(h[:, 0, 0] / (2 * nu[:, 0]), mixed * nu[:, 0], -mixed * nu[:, 1], h[:, 1, 1] / (2 * nu[:, 1]))
    kappa[round_] = 0
    K = (np.linalg.inv(np.swapaxes(e, 1, 2)) @ kappa @ np.linalg.inv(f) - P) / I3[:, None, None]
    return K[:, 0, 0], K[:, 0, 1], K[:, 1, 0], K[:, 1, 1]


def matrix(first, second, third, fourth) -> Array:
    """Matrices, shape (bodies, 2, 2), of their elements row by row."""
    return np.moveaxis(stack((first, second, third, fourth)), 0, -1).reshape(-1, 2, 2)


@inline
def ripple(u1, u2, M1, M2, k):
    """Σ K_ij u_i M_j; `k` begins with the coefficients of `FORM`."""
    return (k[0] * u1 + k[2] * u2) * M1 + (k[1] * u1 + k[3] * u2) * M2


@inline
def ripple_of_states(y, p, k):
    """`ripple` of a model whose first states are two coordinates and their momenta, or rates of unit mass."""
    return ripple(y[0], y[1], y[2], y[3], k)
