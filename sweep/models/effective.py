"""Two coupled oscillators and a spin: the slip eliminated (Takano 2011, eqx, eqy, eqn).

    X'' + ν1² X + a1 X' + a2 Y' = 0,   Y'' + ν2² Y + a3 X' + a4 Y' = 0
    I3 n' = (X, Y) (K D² - K - S D) (X, Y)ᵀ

with a1 = m1 - n k1, a2 = -m2 - n k2, a3 = -m3 + n k3, a4 = m4 + n k4 (ai).  Derived anew from
(J1doty2)-(I3dotn2), with (X, Y) = T J P (x, y), the printed K, S and a_i are right; the matrix N
printed above them lacks its friction, N = [[1/(J2 μ), -n], [n, 1/(J1 μ)]].
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sweep.jit import inline
from sweep.models.coefficients import coefficients, normal_coordinates
from sweep.models.model import Array, Columns, Model


def constants(columns: Columns) -> tuple[Array, ...]:
    """Frequencies squared, k, m and S's coefficients, I3; scaled to the body (c = 1) but for time."""
    k, c = coefficients(columns), columns["c"]
    rate = 1 / np.sqrt(c)
    nu1, nu2 = k.nu1**2, k.nu2**2
    mu = columns["mu"] * np.sqrt(c)
    with np.errstate(divide="ignore"):
        slip = rate / mu
    root = np.sqrt(k.J1 * k.J2)
    ks, ms = (k.k1, k.k2, k.k3, k.k4), (k.m1 * rate, k.m2 * rate, k.m3 * rate, k.m4 * rate)
    return nu1 / c, nu2 / c, *ks, *ms, nu1, nu2, root, slip, 1 / c, k.I3 * c


def start(columns: Columns) -> tuple[Array, ...]:
    X, Y = normal_coordinates(columns)
    rest = np.zeros_like(X)
    return X, Y, rest, rest, columns["n0"]


@inline
def upright(n: Any) -> Any:
    return (0.0, 0.0, 0.0, 0.0, n)


@inline
def rhs(y: Any, p: Any) -> Any:
    X, Y, dX, dY, n = y
    w1, w2, k1, k2, k3, k4, m1, m2, m3, m4, nu1, nu2, root, slip, gravity, inertia = p
    ddX = -w1 * X - (m1 - n * k1) * dX + (m2 + n * k2) * dY
    ddY = -w2 * Y + (m3 - n * k3) * dX - (m4 + n * k4) * dY

    s1, s2 = nu1 * (n * root * k3 - k1 * slip), nu2 * (n * root * k1 + k3 * slip)
    s3, s4 = nu1 * (n * root * k4 - k2 * slip), nu2 * (n * root * k2 + k4 * slip)
    gX, gY = ddX - gravity * X, ddY - gravity * Y
    first = k1 * gX - k3 * gY - s1 * dX - s2 * dY
    second = k2 * gX - k4 * gY - s3 * dX - s4 * dY
    return (dX, dY, ddX, ddY, (X * first + Y * second) / (gravity * inertia)), (n, 0.0, 1.0, 1.0)


@inline
def energy(y: Any, p: Any) -> Any:
    X, Y, dX, dY, n = y
    return n, 0.5 * (dX * dX + dY * dY + p[0] * X * X + p[1] * Y * Y) / p[14], p[15]


def observe(y: Array, p: Array) -> dict[str, Array]:  # noqa: ARG001
    return {"mode_1": y[0], "mode_2": y[1]}


MODEL = Model(
    name="effective",
    summary="two coupled oscillators and the spin, slip eliminated (Takano 2011, eqx, eqy, eqn)",
    states=("X", "Y", "dX", "dY", "n"),
    spin_state=4,
    parameters=("a", "b", "c", "delta", "mu", "n0", "x0", "y0"),
    measures=("reversals", "first_reversal"),
    constants=constants,
    start=start,
    upright=upright,
    rhs=rhs,
    energy=energy,
    observe=observe,
)
