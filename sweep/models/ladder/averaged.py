"""Averaged equations for the slowly varying amplitudes of the two rattling modes and the spin.

They are those of Takano (2011, ndotab, abdot):

    I3 n' = -k1 A²/2 + k4 B²/2,   A' = -a1 A / 2,   B' = -a4 B / 2,   a1 = m1 - n k1,   a4 = m4 + n k4

For a start at X0, Y0 the amplitudes are A = sqrt(ν1² + 1) X0 and B = sqrt(ν2² + 1) Y0.  The paper's (abdef) has
ν² - 1 instead, and x0 in place of Y0.  But the average that it takes, of k1 (X X'' - X²), is
-k1 (ν1² + 1) X0² / 2, and the effective equations tend to these only with that sign.  Without friction
N² + A² + B², with N = sqrt(I3) n, and A^γ B, with γ = k4/k1, are conserved.
"""

from __future__ import annotations

from collections import namedtuple

import numpy as np

from sweep.jit import inline
from sweep.models.general.rigid_body import slower_period
from sweep.models.general.validity import impossible
from sweep.models.model import Array, Columns, Model, Offer
from sweep.models.theory.coefficients import coefficients, normal_coordinates


class Constants(namedtuple("Constants", "half_k1 half_k4 half_m1 half_m4 I3")):
    """Half of k1, k4, m1 and m4, and I3: for the body scaled to c = 1, but with time as in the states."""

    @classmethod
    def of(cls, columns: Columns) -> Constants:
        k, c = coefficients(columns), columns["c"]
        rate = 1 / np.sqrt(c)
        return cls(k.k1 / 2, k.k4 / 2, k.m1 * rate / 2, k.m4 * rate / 2, k.I3 * c)


def start(columns: Columns) -> tuple[Array, ...]:
    k = coefficients(columns)
    X, Y = normal_coordinates(columns)
    return np.sqrt(k.nu1**2 + 1) * X, np.sqrt(k.nu2**2 + 1) * Y, columns["n0"]


@inline
def rhs(y, p):
    A, B, n = y
    half_a1, half_a4 = p.half_m1 - n * p.half_k1, p.half_m4 + n * p.half_k4
    A2, B2 = A * A, B * B
    slopes = (-half_a1 * A, -half_a4 * B, (p.half_k4 * B2 - p.half_k1 * A2) / p.I3)
    return slopes, (n, p.half_m1 * A2 + p.half_m4 * B2, 1.0, 1.0)


@inline
def energy(y, p):
    A, B, n = y
    return n, 0.5 * (A * A + B * B), p.I3


MODEL = Model(
    name="averaged",
    summary="averaged amplitudes of the two rattles and the spin (Takano 2011, ndotab, abdot)",
    states=("A", "B", "n"),
    spin_state=2,
    parameters=("a", "b", "c", "delta", "mu", "n0", "x0", "y0"),
    positive=frozenset({"mu"}),  # the slip is a term of order 1/μ
    offers=frozenset({Offer.COUNT, Offer.SPIN, Offer.ENERGY, Offer.FORMULAS, Offer.LINEAR}),
    constants=Constants,
    start=start,
    impossible=impossible,
    slower_period=slower_period,
    upright=lambda spin: (0.0, 0.0, spin),
    rhs=rhs,
    energy=energy,
    observe=lambda y, p: {"amplitude_1": y[0], "amplitude_2": y[1]},
)
