"""Weights of the Adams formulas, exact for powers and for the fastest rocking and its third harmonic.

A formula on k nodes is to be exact for k - 4 powers of t, and for cos and sin of θ t and of 3 θ t, where θ is the
phase of the rocking in one step.  Its weights are those of the plain formula, which is exact for k powers, plus a
combination of four vectors that contribute nothing to the powers below k - 4:

    w = w_plain + N c,   Σ_j t_j^q N_jr = δ_(q, k-4+r).

This leaves four unknowns c.  The coefficients of their equations are power series in θ² whose terms depend only on
the nodes.  The terms are computed once, in exact fractions; a cell then costs 20 polynomials and the elimination.
"""

from __future__ import annotations

from fractions import Fraction as F
from functools import cache

import numpy as np

from sweep.models.model import Array

HARMONIC = 3

# Number of terms of the series in θ²: enough to leave only rounding errors up to θ = 0.6, on nodes up to eight
# steps back.
_TERMS = 30


def plain_weights(nodes: tuple[int, ...]) -> Array:
    """Weights w with ∫_0^1 p(t) dt = Σ w_j p(nodes_j) for all powers below k, shape (k,)."""
    return np.array(_plain(_inverse(nodes)), dtype=float)


def fitted_weights(nodes: tuple[int, ...], phase: Array) -> Array:
    """Weights w with ∫_0^1 p(t) dt = Σ w_j p(nodes_j) for k - 4 powers and two frequencies.

    Parameters
    ----------
    nodes : k abscissae, in steps
    phase : θ, the lower of the two frequencies times the step, shape (cells,); zero gives the plain weights

    Returns
    -------
    Weights of shape (cells, k).
    """
    plain, null, series = _tables(nodes)
    A, square = np.zeros((20, len(phase))), np.square(phase)
    for terms in series[::-1]:
        A = A * square + terms[:, None]
    c = _solve(A.reshape(4, 5, -1))
    # Term by term, because the sums of a matrix product depend on the number of cells.
    return np.asarray(plain + sum(c[r, :, None] * null[:, r] for r in range(4)))


@cache
def _tables(nodes: tuple[int, ...]) -> tuple[Array, Array, Array]:
    """Plain weights (k,), N (k, 4), and the series in θ² of the four equations for c, shape (terms, 4 · 5).

    cos and sin enter without the part of their Taylor series that is met anyway: those of θ t as
    Σ_m a_m θ^(2m) t^(n + 2m), with a_m = (-1)^m n! / (n + 2m)! and n = k - 4 or k - 3, and those of the harmonic as a
    divided difference in θ², divided by a_1.  In this form the equations become c = 0 as θ goes to zero.
    """
    k = len(nodes)
    inverse = _inverse(nodes)
    plain = _plain(inverse)
    null = [row[k - 4 :] for row in inverse]

    def moments(q: int) -> list[F]:
        """Compute Σ t^q N, and the part of ∫ t^q that the plain weights miss."""
        powers = [F(t) ** q for t in nodes]
        sums = [sum((t * row[r] for t, row in zip(powers, null, strict=True)), F(0)) for r in range(4)]
        return [*sums, F(1, q + 1) - sum((t * w for t, w in zip(powers, plain, strict=True)), F(0))]

    series = np.empty((_TERMS, 20))
    for odd in range(2):
        n, a = k - 4 + odd, F(1)
        first = F(-1, (n + 1) * (n + 2))
        for m in range(_TERMS):
            series[m, 5 * odd : 5 * odd + 5] = [float(a * s) for s in moments(n + 2 * m)]
            a /= -(n + 2 * m + 1) * (n + 2 * m + 2)
            difference = a / first * sum(HARMONIC ** (2 * i) for i in range(m + 1))
            series[m, 10 + 5 * odd : 15 + 5 * odd] = [float(difference * s) for s in moments(n + 2 * m + 2)]
    return np.array(plain, dtype=float), np.array(null, dtype=float), series


def _inverse(nodes: tuple[int, ...]) -> list[list[F]]:
    """Inverse of the matrix of the powers t_j^q: a row per node, of the coefficients of its Lagrange polynomial."""
    rows = []
    for node in nodes:
        row = [F(1)]
        for other in nodes:
            if other != node:  # times (t - other)/(node - other)
                products = zip([F(0), *row], [*row, F(0)], strict=True)
                row = [(raised - other * same) / (node - other) for raised, same in products]
        rows.append(row)
    return rows


def _plain(inverse: list[list[F]]) -> list[F]:
    """The plain weights."""
    return [sum((x / (q + 1) for q, x in enumerate(row)), F(0)) for row in inverse]


def _solve(A: Array) -> Array:
    """Solutions of four equations, shape (4, cells), by Gauss-Jordan elimination; A is of shape (4, 5, cells).

    No pivoting is needed, because up to θ = 0.6 the diagonal stays away from zero.
    """
    A = A.copy()
    for r in range(4):
        A[r, r + 1 :] /= A[r, r]
        for i in range(4):
            if i != r:
                A[i, r + 1 :] -= A[i, r] * A[r, r + 1 :]
    return A[:, 4]
