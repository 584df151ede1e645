"""Weights of the Adams formulas, exact for powers and for the fastest rocking and its third harmonic.

A formula on k nodes is to be exact for k - 4 powers of t, and for cos and sin of θ t and of 3 θ t, where θ is the
phase of the rocking in one step.  Its weights are those of the plain formula, which is exact for k powers, plus a
combination of four vectors that contribute nothing to the powers below k - 4:

    w = w_plain + N c,   Σ_j t_j^q N_jr = δ_(q, k-4+r).

So four unknowns c are left.  The coefficients of their equations are power series in θ² whose terms depend only on
the nodes.  The terms are computed once, in exact fractions; a cell then costs 20 polynomials and the elimination.
"""

from __future__ import annotations

from fractions import Fraction as F
from functools import cache
from typing import Any

import numpy as np

from sweep.jit import Cached, serial
from sweep.kernels.codegen import compile_lanes
from sweep.kernels.layout import LANES
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
    weights = np.empty((len(phase), len(nodes)))
    compiled_fit()(np.square(phase), *_tables(nodes), weights)
    return weights


@cache
def _tables(nodes: tuple[int, ...]) -> tuple[Array, Array, Array]:
    """Plain weights (k,), N (k, 4), and the series in θ² of the four equations for c, shape (terms, 4 · 5).

    cos and sin enter with the part of their Taylor series removed that is met anyway: those of θ t as
    Σ_m a_m θ^(2m) t^(n + 2m), with a_m = (-1)^m n! / (n + 2m)! and n = k - 4 or k - 3, and those of the harmonic as a
    divided difference in θ², divided by a_1.  In this form the equations become c = 0 as θ goes to zero.
    """
    k = len(nodes)
    inverse = _inverse(nodes)
    plain = _plain(inverse)
    null = [row[k - 4 :] for row in inverse]

    def moments(q: int) -> list[F]:
        """Σ t^q N, and the part of ∫ t^q that the plain weights miss."""
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
    """Inverse of the matrix of the powers t_j^q, with a row per node."""
    return _invert([[F(t) ** q for t in nodes] for q in range(len(nodes))])


def _plain(inverse: list[list[F]]) -> list[F]:
    """The plain weights."""
    return [sum((x / (q + 1) for q, x in enumerate(row)), F(0)) for row in inverse]


def _invert(matrix: list[list[F]]) -> list[list[F]]:
    """Inverse by Gauss-Jordan elimination, with a choice of pivots, as these may vanish even for distinct nodes."""
    n = len(matrix)
    rows = [[*row, *(F(int(i == j)) for j in range(n))] for i, row in enumerate(matrix)]
    for r in range(n):
        pivot = next(i for i in range(r, n) if rows[i][r])
        rows[r], rows[pivot] = rows[pivot], rows[r]
        rows[r] = [x / rows[r][r] for x in rows[r]]
        for i in range(n):
            if i != r:
                rows[i] = [x - rows[i][r] * y for x, y in zip(rows[i], rows[r], strict=True)]
    return [row[n:] for row in rows]


def _solve_lines() -> list[str]:
    """Gauss-Jordan elimination for the equations `A` of one lane.

    It does without pivoting, because up to θ = 0.6 the diagonal stays away from zero.
    """
    lines = [f"a{r}{s} = A[{(5 * r + s) * LANES} + lane]" for r in range(4) for s in range(5)]
    for r in range(4):
        lines += [f"a{r}{s} = a{r}{s} / a{r}{r}" for s in range(4, r, -1)]
        lines += [f"a{i}{s} = a{i}{s} - a{i}{r} * a{r}{s}" for i in range(4) if i != r for s in range(4, r, -1)]
    return [*lines, *(f"c[{r * LANES} + lane] = a{r}4" for r in range(4))]


@cache
def compiled_fit() -> Cached:
    """Compiled (θ², plain weights, N, series, weights) -> None: writes the fitted weights of all cells to `weights`."""
    terms = [f"A[{i * LANES} + lane] = A[{i * LANES} + lane] * x[lane] + terms[{i}]" for i in range(20)]
    sums = ["w[lane] = plain" + "".join(f" + null[{r}] * c[{r * LANES} + lane]" for r in range(4))]
    horner = compile_lanes("horner", "A, x, terms", terms, {})
    solve = compile_lanes("solve", "A, c", _solve_lines(), {})
    combine = compile_lanes("combine", "w, c, plain, null", sums, {})

    def fit(squares: Any, plain: Any, null: Any, series: Any, weights: Any) -> None:
        cells = len(squares)
        for first in range(0, cells, LANES):
            count = min(LANES, cells - first)
            A, c, x, w = np.zeros(20 * LANES), np.zeros(4 * LANES), np.zeros(LANES), np.zeros(LANES)
            x[:count] = squares[first : first + count]
            for m in range(len(series) - 1, -1, -1):
                horner(A, x, series[m])
            solve(A, c)
            for j in range(len(plain)):
                combine(w, c, plain[j], null[j])
                weights[first : first + count, j] = w[:count]

    return serial(fit, "fit")
