"""Two coupled oscillators and the spin, with the slip eliminated (Takano 2011, eqx, eqy, eqn).

    X'' + ν1² X + a1 X' + a2 Y' = 0,   Y'' + ν2² Y + a3 X' + a4 Y' = 0
    I3 n' = (X, Y) (K D² - K - S D) (X, Y)ᵀ

with D = d/dt and a1 = m1 - n k1, a2 = -m2 - n k2, a3 = -m3 + n k3, a4 = m4 + n k4 (ai).  A new derivation
from (J1doty2)-(I3dotn2), with (X, Y) = T J P (x, y), confirms the printed K, S and a_i.  The matrix N printed
above them lacks its friction terms: it has to be N = [[1/(J2 μ), -n], [n, 1/(J1 μ)]].
"""

from __future__ import annotations

from collections import namedtuple

import numpy as np

from sweep.jit import inline
from sweep.models.general.rigid_body import slower_period
from sweep.models.general.validity import impossible
from sweep.models.model import Array, Columns, Model, Offer, Ripple
from sweep.models.theory.coefficients import coefficients, normal_coordinates
from sweep.models.theory.ripple import FORM, ripple_of_states

_Constants = namedtuple(
    "_Constants", "rate1_squared rate2_squared k1 k2 k3 k4 m1 m2 m3 m4 nu1_squared nu2_squared root_J slip gravity I3"
)


class Constants(_Constants):
    """The paper's coefficients, for the body scaled to c = 1, but with time as in the states.

    `rate1_squared` is ν1²/c, the square of the frequency with time as in the states; `root_J` is sqrt(J1 J2), `slip` is
    1/μ, and `gravity` is 1/c, with lengths in units of c and time as in the states.
    """

    @classmethod
    def of(cls, columns: Columns) -> Constants:
        k, c = coefficients(columns), columns["c"]
        rate = 1 / np.sqrt(c)
        nu1, nu2 = k.nu1**2, k.nu2**2
        mu = columns["mu"] * np.sqrt(c)
        with np.errstate(divide="ignore"):
            slip = rate / mu
        ks, ms = (k.k1, k.k2, k.k3, k.k4), (k.m1 * rate, k.m2 * rate, k.m3 * rate, k.m4 * rate)
        return cls(nu1 / c, nu2 / c, *ks, *ms, nu1, nu2, np.sqrt(k.J1 * k.J2), slip, 1 / c, k.I3 * c)


def start(columns: Columns) -> tuple[Array, ...]:
    X, Y = normal_coordinates(columns)
    rest = np.zeros_like(X)
    return X, Y, rest, rest, columns["n0"]


@inline
def rhs(y, p):
    X, Y, dX, dY, n = y
    k1, k2, k3, k4, nu1, nu2, root, slip = p.k1, p.k2, p.k3, p.k4, p.nu1_squared, p.nu2_squared, p.root_J, p.slip
    ddX = -p.rate1_squared * X - (p.m1 - n * k1) * dX + (p.m2 + n * k2) * dY
    ddY = -p.rate2_squared * Y + (p.m3 - n * k3) * dX - (p.m4 + n * k4) * dY

    s1, s2 = nu1 * (n * root * k3 - k1 * slip), nu2 * (n * root * k1 + k3 * slip)
    s3, s4 = nu1 * (n * root * k4 - k2 * slip), nu2 * (n * root * k2 + k4 * slip)
    gX, gY = ddX - p.gravity * X, ddY - p.gravity * Y
    first = k1 * gX - k3 * gY - s1 * dX - s2 * dY
    second = k2 * gX - k4 * gY - s3 * dX - s4 * dY
    return (dX, dY, ddX, ddY, (X * first + Y * second) / (p.gravity * p.I3)), (n, 0.0, 1.0, 1.0)


@inline
def energy(y, p):
    X, Y, dX, dY, n = y
    rocking = dX * dX + dY * dY + p.rate1_squared * X * X + p.rate2_squared * Y * Y
    return n, 0.5 * rocking / p.gravity, p.I3


def ripple_coefficients(columns: Columns) -> tuple[Array, ...]:
    """κ of Σ κ_jk X_j X_k' with (X_1, X_2) = (X, Y): the ripple of the spin without friction at n = 0.

    There I3 n' = Σ g_jk X_j X_k by (eqn), with X_j'' = -ν_j² X_j (compare `sweep.models.theory.ripple`).
    """
    k = coefficients(columns)
    nu1, nu2 = k.nu1**2, k.nu2**2
    g11, g22 = -k.k1 * (nu1 + 1), k.k4 * (nu2 + 1)
    g12 = 0.5 * (k.k3 * (nu2 + 1) - k.k2 * (nu1 + 1))
    mixed = np.divide(2 * g12, nu1 - nu2, out=np.zeros_like(g12), where=nu1 != nu2)
    first, second = (-np.divide(g, 2 * nu, out=np.zeros_like(g), where=nu > 0) for g, nu in ((g11, nu1), (g22, nu2)))
    return tuple(kappa / k.I3 for kappa in (first, mixed, -mixed, second))


MODEL = Model(
    name="effective",
    summary="two coupled oscillators and the spin, slip eliminated (Takano 2011, eqx, eqy, eqn)",
    states=("X", "Y", "dX", "dY", "n"),
    spin_state=4,
    parameters=("a", "b", "c", "delta", "mu", "n0", "x0", "y0"),
    positive=frozenset({"mu"}),  # the slip is a term of order 1/μ
    offers=frozenset({Offer.COUNT, Offer.SPIN, Offer.FORMULAS, Offer.LINEAR}),
    constants=Constants,
    start=start,
    impossible=impossible,
    slower_period=slower_period,
    upright=lambda spin: (0.0, 0.0, 0.0, 0.0, spin),
    rhs=rhs,
    energy=energy,
    ripple=Ripple(FORM, ripple_coefficients, ripple_of_states),
    observe=lambda y, p: {"mode_1": y[0], "mode_2": y[1]},
)
