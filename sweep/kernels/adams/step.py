"""One step of the stiff method, used both in its main loop and in its start-up.

The sums over the history are written as loops, and traced into straight-line source; the rest are inline functions,
made for each model.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable
from functools import cache

from sweep.jit import inline
from sweep.kernels.codegen import make_gather, make_scatter
from sweep.kernels.layout import LANES
from sweep.models.generated import tuple_of
from sweep.models.stiff.form import StiffForm
from sweep.models.symbols import specialised

HISTORY = 8
PREDICTOR_NODES = tuple(-j for j in range(8))
CORRECTOR_NODES = tuple(1 - j for j in range(9))

PREDICT = tuple(f"predict{j}" for j in range(len(PREDICTOR_NODES)))
CORRECT = tuple(f"correct{j}" for j in range(len(CORRECTOR_NODES)))
"""The weights of the slopes at these nodes, in steps."""

# BDF5, and its predictor, which extrapolates from five points; both are exact for polynomials of degree 4.
BDF = (300 / 137, -300 / 137, 200 / 137, -75 / 137, 12 / 137)
BDF_GAMMA = 60 / 137
EXTRAPOLATE = (5.0, -10.0, 10.0, -5.0, 1.0)

assert max(len(PREDICTOR_NODES), len(CORRECTOR_NODES) - 1, len(BDF)) == HISTORY

SLOPES = tuple(f"f{{}}_{i}" for i in range(5))
SLIPS = tuple(f"v{{}}_{i}" for i in range(2))
POINT = (*SLOPES, *SLIPS)
"""Quantities of a point of the history, to be formatted with its slot: the slopes of (u, M), and the slip."""

MATRIX = tuple(f"P{i}{j}" for i in range(4) for j in range(4))
"""Names of the elements of P, the implicit part of the corrector (see `sweep.models.theory.rocking.implicit`)."""

Weights = namedtuple("Weights", "predict correct matrix per_weight gamma")
"""What a step multiplies by: the weights `PREDICT` and `CORRECT`, the matrix P (`MATRIX`), 1 over the weight of the new
slope, and the weight of the new slope in BDF5."""


@inline
def work_of(h, power0, power1, power2, power3):
    """The work of friction in a step h by the Adams-Moulton formula of order four, from its power, newest first."""
    return h / 24.0 * (9.0 * power0 + 19.0 * power1 - 5.0 * power2 + power3)


@inline
def correct(q, g, f, weight, P):
    """(r, d): the residual r by which the corrector exceeds the rocking states q, and d = P r; four numbers each."""
    r0, r1 = g[0] + weight * f[0] - q[0], g[1] + weight * f[1] - q[1]
    r2, r3 = g[2] + weight * f[2] - q[2], g[3] + weight * f[3] - q[3]
    d0 = P[0] * r0 + P[1] * r1 + P[2] * r2 + P[3] * r3
    d1 = P[4] * r0 + P[5] * r1 + P[6] * r2 + P[7] * r3
    d2 = P[8] * r0 + P[9] * r1 + P[10] * r2 + P[11] * r3
    d3 = P[12] * r0 + P[13] * r1 + P[14] * r2 + P[15] * r3
    return (r0, r1, r2, r3), (d0, d1, d2, d3)


def make_solve(form: StiffForm):
    """Inline (q, g, e, b, p, weight, per_weight, gamma, P) -> (states, slopes, spin, (num, den) of R, power).

    This is the new point, from the sums over the history.

    Parameters
    ----------
    q : predicted (u, M), five numbers
    g : the corrector for (u, M) without the term of the new slope, five numbers
    e, b : extrapolated slip, and the BDF formula without the term of the new slope, two numbers each
    p : constants of the form model
    weight, per_weight : weight of the new slope in the corrector, and 1/weight
    gamma : weight of the new slope in the BDF formula
    P : the implicit part of the corrector, row by row, sixteen numbers

    The slopes returned are those that the corrected states imply, and the power is that of friction.
    """
    nonstiff, newton, power = form.nonstiff, form.newton, form.power

    @inline
    def solve(q, g, e, b, p, weight, per_weight, gamma, P):
        f, geometry = nonstiff(q[0], q[1], q[2], q[3], q[4], e[0], e[1], p)
        v0, v1, num, den = newton(q[0], q[1], e[0], e[1], geometry, gamma, b[0], b[1], p)
        _, d = correct(q, g, f, weight, P)
        q = (q[0] + d[0], q[1] + d[1], q[2] + d[2], q[3] + d[3], g[4] + weight * f[4])
        f, geometry = nonstiff(q[0], q[1], q[2], q[3], q[4], v0, v1, p)
        r, d = correct(q, g, f, weight, P)
        states = (q[0] + d[0], q[1] + d[1], q[2] + d[2], q[3] + d[3], g[4] + weight * f[4], v0, v1)
        slopes = (
            f[0] + (d[0] - r[0]) * per_weight,
            f[1] + (d[1] - r[1]) * per_weight,
            f[2] + (d[2] - r[2]) * per_weight,
            f[3] + (d[3] - r[3]) * per_weight,
            f[4],
        )
        spin = q[0] * geometry.w1 + q[1] * geometry.w2 + geometry.u3 * geometry.w3
        return states, slopes, spin, (num, den), power(num / den, v0, v1, geometry, p)

    return solve


def _sums(y, points, predict, correct):
    """(q, g, e, b) for `solve`, from the states y and the points of the history, oldest first."""
    q = g = y[: len(SLOPES)]
    e = b = (0.0, 0.0)
    for j in range(HISTORY):  # the newest first
        begin = (HISTORY - 1 - j) * len(POINT)
        slopes, slips = points[begin : begin + len(SLOPES)], points[begin + len(SLOPES) : begin + len(POINT)]
        q = tuple(q[i] + predict[j] * slope for i, slope in enumerate(slopes))
        g = tuple(g[i] + correct[j + 1] * slope for i, slope in enumerate(slopes))
        if j < len(BDF):
            e = tuple(e[i] + EXTRAPOLATE[j] * slip for i, slip in enumerate(slips))
            b = tuple(b[i] + BDF[j] * slip for i, slip in enumerate(slips))
    return q, g, e, b


def make_advance(form: StiffForm):
    """Inline (y, points, weights, p) -> what `solve` returns: the ninth point, from eight, oldest first."""
    solve, nodes = make_solve(form), {"predict": len(PREDICTOR_NODES), "correct": len(CORRECTOR_NODES)}
    sums = specialised(_sums, y=len(form.model.states), points=HISTORY * len(POINT), **nodes)

    @inline
    def advance(y, points, weights, p):
        q, g, e, b = sums(y, points, weights.predict, weights.correct)
        per_weight, gamma = weights.per_weight, weights.gamma
        return solve(q, g, e, b, p, weights.correct[0], per_weight, gamma, weights.matrix)

    return advance


def make_weights(arguments: str, at: Callable[[str], str]):
    """Compiled (arguments) -> `Weights`; `at` gives the expression of a quantity by its name."""
    weights = (tuple_of(map(at, names)) for names in (PREDICT, CORRECT, MATRIX))
    return make_gather(arguments, [*weights, at("per_weight"), at("gamma")], Weights)


@cache
def make_history(size: int):
    """The functions that read and extend a history, of which a point takes `size` numbers.

    They are (history, first, lane) -> the `POINT` of eight points, one after another; and (history, first, lane,
    values) -> None, which sets the `POINT` of the point at `first`.
    """
    places = [f"history[first + {i * LANES + j * size} + lane]" for j in range(HISTORY) for i in range(len(POINT))]
    return make_gather("history, first, lane", places), make_scatter("history, first, lane", places[: len(POINT)])
