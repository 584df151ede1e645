"""The slowly varying amplitudes of the two rattles and the spin (Takano 2011, ndotab, abdot).

    I3 n' = -k1 A²/2 + k4 B²/2,   A' = -a1 A / 2,   B' = -a4 B / 2,   a1 = m1 - n k1,   a4 = m4 + n k4

A = sqrt(ν1² + 1) X0 and B = sqrt(ν2² + 1) Y0 for a start at X0, Y0.  The paper's (abdef) has ν² - 1
(and x0 for Y0); but the average of k1 (X X'' - X²) that it takes is -k1 (ν1² + 1) X0² / 2, and only
with that sign do the effective equations tend to these.  Without friction N² + A² + B²,
N = sqrt(I3) n, and A^γ B, γ = k4/k1, are conserved.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sweep.jit import inline
from sweep.models.coefficients import coefficients, normal_coordinates
from sweep.models.model import Array, Columns, Model


def constants(columns: Columns) -> tuple[Array, ...]:
    """k1, k4 and m1, m4 in halves, I3; in units of the body (c = 1) but for time, in sqrt(c/g)."""
    k, c = coefficients(columns), columns["c"]
    rate = 1 / np.sqrt(c)
    return k.k1 / 2, k.k4 / 2, k.m1 * rate / 2, k.m4 * rate / 2, k.I3 * c


def start(columns: Columns) -> tuple[Array, ...]:
    k = coefficients(columns)
    X, Y = normal_coordinates(columns)
    return np.sqrt(k.nu1**2 + 1) * X, np.sqrt(k.nu2**2 + 1) * Y, columns["n0"]


@inline
def upright(n: Any) -> Any:
    return (0.0, 0.0, n)


@inline
def rhs(y: Any, p: Any) -> Any:
    A, B, n = y
    k1, k4, m1, m4, I3 = p
    a1, a4 = m1 - n * k1, m4 + n * k4
    A2, B2 = A * A, B * B
    return (-a1 * A, -a4 * B, (k4 * B2 - k1 * A2) / I3), (n, m1 * A2 + m4 * B2, 1.0, 1.0)


@inline
def energy(y: Any, p: Any) -> Any:
    A, B, n = y
    return n, 0.5 * (A * A + B * B), p[4]


def observe(y: Array, p: Array) -> dict[str, Array]:  # noqa: ARG001
    return {"amplitude_1": y[0], "amplitude_2": y[1]}


MODEL = Model(
    name="averaged",
    summary="slow amplitudes of the two rattles and the spin (Takano 2011, ndotab, abdot)",
    states=("A", "B", "n"),
    spin_state=2,
    parameters=("a", "b", "c", "delta", "mu", "n0", "x0", "y0"),
    measures=("reversals", "energy_error", "first_reversal"),
    constants=constants,
    start=start,
    upright=upright,
    rhs=rhs,
    energy=energy,
    observe=observe,
)
