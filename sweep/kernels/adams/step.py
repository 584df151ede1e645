"""One step of the stiff method, used both in its main loop and in its start-up.

The arithmetic is in `solve`, an ordinary inline function, made for each model.  Only the sums over the history are
generated as text, because the places of the points have to be known when the code is compiled.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from sweep.jit import inline
from sweep.kernels.layout import LANES, constants_of
from sweep.kernels.status import DIVERGED, LIFT_OFF, PARADOX
from sweep.models.generated import tuple_of
from sweep.models.stiff.form import StiffForm

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

WORK_RULE = "h / 24.0 * (9.0 * {} + 19.0 * {} - 5.0 * {} + {})"
"""The work of friction in a step by the Adams-Moulton formula of order four, to be formatted with its power at four
points, newest first."""

MATRIX = tuple(f"P{i}{j}" for i in range(4) for j in range(4))
"""Names of the elements of P, the implicit part of the corrector (see `sweep.models.theory.rocking.implicit`)."""

At = Callable[[str], str]
"""A function that gives the place of a quantity of one lane: (name) -> an expression that can be read and assigned
to."""


def places(point: Sequence[str]) -> dict[str, int]:
    """Where the lanes of each quantity begin in a history of nine points with the quantities `point`."""
    filled = [name.format(slot) for slot in range(HISTORY + 1) for name in point]
    return {name: i * LANES for i, name in enumerate(filled)}


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
    slow, newton, power = form.slow, form.newton, form.power

    @inline
    def solve(q, g, e, b, p, weight, per_weight, gamma, P):
        f, geometry = slow(q[0], q[1], q[2], q[3], q[4], e[0], e[1], p)
        v0, v1, num, den = newton(q[0], q[1], e[0], e[1], geometry, gamma, b[0], b[1], p)
        _, d = correct(q, g, f, weight, P)
        q = (q[0] + d[0], q[1] + d[1], q[2] + d[2], q[3] + d[3], g[4] + weight * f[4])
        f, geometry = slow(q[0], q[1], q[2], q[3], q[4], v0, v1, p)
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


def names(form: StiffForm) -> dict[str, Any]:
    """Bind the names in the generated lines."""
    return {"solve": make_solve(form), "Constants": form.model.constants}


def load_lines(form: StiffForm, at: At) -> list[str]:
    """Lines that load the constants p and the states y."""
    return [
        f"p = Constants{tuple_of(map(at, constants_of(form.model)))}",
        f"y = {tuple_of(map(at, form.model.states))}",
    ]


def advance_lines(form: StiffForm, at: At) -> list[str]:
    """Lines that take a lane, if it is `active`, from the eight points of the history, slots 0 … 7, to the ninth.

    They need the names that `load_lines` sets, and `status`.  They set `new`, slopes, `spin`, (num, den) and `power`,
    as `solve` returns them, and `sound` and `accepted`.
    """
    lines = [f"q{i} = g{i} = y[{i}]" for i in range(5)]
    lines += ["e0 = e1 = b0 = b1 = 0.0"]
    for j, slot in enumerate(range(HISTORY)[::-1]):  # the newest first
        lines += [f"wp, wc = {at(f'predict{j}')}, {at(f'correct{j + 1}')}"]
        for i in range(5):
            lines += [f"f = {at(SLOPES[i].format(slot))}", f"q{i} += wp * f", f"g{i} += wc * f"]
        if j < len(BDF):
            for i in range(2):
                value = at(SLIPS[i].format(slot))
                lines += [f"e{i} += {EXTRAPOLATE[j]!r} * {value}", f"b{i} += {BDF[j]!r} * {value}"]
    weights = f"{at('correct0')}, {at('per_weight')}, {at('gamma')}, {tuple_of(map(at, MATRIX))}"
    return [
        *lines,
        "q, g, e, b = (q0, q1, q2, q3, q4), (g0, g1, g2, g3, g4), (e0, e1), (b0, b1)",
        f"new, slopes, spin, (num, den), power = solve(q, g, e, b, p, {weights})",
        "sound = (num > 0.0) & (den > 0.0)",
        "accepted = active & sound",
        *(f"{at(name)} = new[{i}] if accepted else y[{i}]" for i, name in enumerate(form.model.states)),
        f"failure = {PARADOX} if den <= 0.0 else ({LIFT_OFF} if num <= 0.0 else {DIVERGED})",
        f"{at('status')} = failure if active & (not sound) else status",
        *(f"{at(name.format(HISTORY))} = slopes[{i}]" for i, name in enumerate(SLOPES)),
        *(f"{at(name.format(HISTORY))} = new[{5 + i}]" for i, name in enumerate(SLIPS)),
    ]
