"""The paper's predictions: critical spins, number of reversals, form factor (Takano 2011, sec. V)."""

from __future__ import annotations

import numpy as np

from sweep.models.general.validity import impossible
from sweep.models.model import Array, Columns, Offer, Tier
from sweep.models.theory.coefficients import coefficients


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def critical_spins(columns: Columns) -> tuple[Array, Array]:
    """n_c1+ and n_c1-, in sqrt(g/c), each of shape (cells,): between them both modes of the rattle decay.

    n_c1+ = m1/k1 and n_c1- = -m4/k4 for k1 > 0; the two swap for k1 < 0 (δ < 0).  A reversal needs
    twice that spin, n_c2± = 2 n_c1±.  NaN where no spin is critical: where nothing couples spin and
    rattle (δ = 0 or a = b), without friction, and for a body that cannot stand.
    """
    k = coefficients(columns)
    first, second = k.m1 / k.k1, -k.m4 / k.k4
    exists = np.isfinite(first) & np.isfinite(second) & ~impossible(columns)
    rate = np.sqrt(columns["c"])
    upper = np.where(exists, np.maximum(first, second) / rate, np.nan)
    lower = np.where(exists, np.minimum(first, second) / rate, np.nan)
    return upper, lower


def reversal_count(columns: Columns) -> Array:
    """n_r, the number of reversals predicted from the start spin n0: integers, shape (cells,).

    By the inequalities (nrk0) and (nrk1), each reversal takes 2 |n_c1| from the spin, where n_c1 belongs to
    the side on which the spin is.  So n_r is the number of partial sums of the alternating |n_c2|,
    starting on the side of n0, that |n0| exceeds.  Cases (I) and (II) differ only in that side.  The
    closed forms (nr1) and (nr2) are undefined where x is an integer, and are not used.
    """
    upper, lower = critical_spins(columns)
    n0 = np.abs(columns["n0"])
    here = 2 * np.where(columns["n0"] > 0, upper, -lower)
    there = 2 * np.where(columns["n0"] > 0, -lower, upper)
    pairs = np.maximum(np.ceil(n0 / (here + there)) - 1, 0)
    count = 2 * pairs + (n0 - pairs * (here + there) > here)
    return np.where(np.isnan(count), 0, np.minimum(count, np.iinfo(np.int16).max)).astype(np.int16)


def form_factor(columns: Columns) -> Array:
    """L(f) = |f - 1/f| / (1 + f²) (ff), the factor by which the shape enters the number of reversals."""
    f = coefficients({**columns, "mu": np.ones_like(columns["c"])}).f
    return np.asarray(np.abs(f - 1 / f) / (1 + f**2))


def best_b(a: float, c: float = 1.0) -> float:
    """The b with the largest form factor for a given a: f² = 2 + √5.  NaN if no b > 0 reaches it."""
    b_squared = ((a / c) ** 2 + 6) / (2 + np.sqrt(5)) - 6
    return float(c * np.sqrt(b_squared)) if b_squared > 0 else float("nan")


MODEL = Tier(
    name="analytic",
    summary="the count by formula, without simulation (Takano 2011, nrk0, nrk1)",
    parameters=("a", "b", "c", "delta", "mu", "n0"),
    offers=frozenset({Offer.COUNT, Offer.FORMULAS}),
    counts="reversals_predicted",
    impossible=impossible,
)
