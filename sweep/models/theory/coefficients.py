"""Coefficients of the effective equations for shape, frequencies and friction (Takano 2011, p … f).

The paper sets c = 1.  Here lengths are first divided by c and rates multiplied by sqrt(c), with g = 1,
so that every coefficient is the paper's for a body of the same shape.
"""

from __future__ import annotations

from collections import namedtuple

import numpy as np

from sweep.models.model import Array, Columns

Coefficients = namedtuple("Coefficients", "p q s I3 J1 J2 theta nu1 nu2 f k1 k2 k3 k4 m1 m2 m3 m4")
"""The paper's symbols, each an array of shape (cells,), for bodies scaled to c = 1.

The labels of the paper's equations are in parentheses: p, q, s (p, q, s); J1, J2 (j1j2); I3; theta (tanth, exact); nu1
and nu2, the frequencies of the X and Y modes (nu1, nu2, but without the paper's expansion in δ); f (f); k1 … k4
(k1 … k4, exact); m1 … m4 (m12, m34).
"""


@np.errstate(divide="ignore", invalid="ignore", over="ignore")  # no friction; bodies that are hardly there
def coefficients(columns: Columns) -> Coefficients:
    """Coefficients for the bodies in `columns`, which need a, b, c, delta and mu."""
    c = columns["c"]
    a2, b2 = (columns["a"] / c) ** 2, (columns["b"] / c) ** 2
    mu = columns["mu"] * np.sqrt(c)
    cos_d, sin_d = np.cos(columns["delta"]), np.sin(columns["delta"])

    p = cos_d**2 / a2 + sin_d**2 / b2
    q = cos_d * sin_d * (1 / b2 - 1 / a2)
    s = sin_d**2 / a2 + cos_d**2 / b2
    J1, J2 = (b2 + 6) / 5, (a2 + 6) / 5

    # The rotation by θ turns Q = J⁻¹ P⁻¹ J⁻¹ into diag(ν1², ν2²).  A round body (0/0) needs no rotation.
    bottom = J1 * s - J2 * p
    theta = 0.5 * np.arctan(-2 * q * np.sqrt(J1 * J2) / np.where(bottom == 0, np.inf, bottom))
    cos, sin = np.cos(theta), np.sin(theta)
    det = p * s - q**2
    q11, q12, q22 = s / (J2 * det), -q / (np.sqrt(J1 * J2) * det), p / (J1 * det)
    nu1_sq = cos**2 * q11 + 2 * sin * cos * q12 + sin**2 * q22
    nu2_sq = sin**2 * q11 - 2 * sin * cos * q12 + cos**2 * q22

    f = np.sqrt(J2 / J1)
    k1 = -nu1_sq * sin * cos * (f - 1 / f)
    k2 = nu2_sq * (f * sin**2 + cos**2 / f)
    k3 = nu1_sq * (f * cos**2 + sin**2 / f)
    k4 = -nu2_sq * sin * cos * (f - 1 / f)
    slip = f / (J2 * mu)
    m1, m4 = slip * nu1_sq / nu2_sq * k2, slip * nu2_sq / nu1_sq * k3
    m2, m3 = slip * k4, slip * k1
    return Coefficients(
        p, q, s, (a2 + b2) / 5, J1, J2, theta, np.sqrt(nu1_sq), np.sqrt(nu2_sq), f,
        k1, k2, k3, k4, m1, m2, m3, m4,
    )  # fmt: skip


def normal_coordinates(columns: Columns) -> tuple[Array, Array]:
    """X and Y at the start (x0, y0), by (X, Y) = T J P (x, y) (xX); each of shape (cells,)."""
    k = coefficients({**columns, "mu": np.ones_like(columns["c"])})
    x, y = columns["x0"] / columns["c"], columns["y0"] / columns["c"]
    first, second = np.sqrt(k.J2) * (k.p * x + k.q * y), np.sqrt(k.J1) * (k.q * x + k.s * y)
    cos, sin = np.cos(k.theta), np.sin(k.theta)
    return cos * first + sin * second, cos * second - sin * first
