"""One step of the method of `adams` as source, for its loop and for its start-up."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from sweep.kernels.lanes import DIVERGED, LIFT_OFF, PARADOX, count_constants
from sweep.models.slip_split import SPLIT

HISTORY = 8
PREDICTOR_NODES = tuple(-j for j in range(8))
CORRECTOR_NODES = tuple(1 - j for j in range(9))

# BDF5 and its predictor, the extrapolation of five points; both exact for polynomials of degree 4.
BDF = (300 / 137, -300 / 137, 200 / 137, -75 / 137, 12 / 137)
BDF_GAMMA = 60 / 137
EXTRAPOLATE = (5.0, -10.0, 10.0, -5.0, 1.0)

assert max(len(PREDICTOR_NODES), len(CORRECTOR_NODES) - 1, len(BDF)) == HISTORY

At = Callable[[str], str]
"""Where a quantity of one lane is kept: its name -> an expression that can be read and written."""


def load_lines(at: At) -> list[str]:
    """Constants p and states y0 … y6."""
    constants = " ".join(at(f"constant{i}") + "," for i in range(count_constants(SPLIT)))
    return [f"p = ({constants})", *(f"y{i} = {at(name)}" for i, name in enumerate(SPLIT.states))]


def step_lines(at: At, slots: Sequence[int]) -> list[str]:
    """From p and y: the next (u, M) as c0 … c4, slip v0, v1, slopes f, r and d of `store_lines`, num and den of R.

    `slots` : where the history lies, newest first: slopes f{slot}_0 … 4 and slips v{slot}_0, 1
    """
    lines = [f"q{i} = g{i} = y{i}" for i in range(5)]
    lines += ["e0 = e1 = b0 = b1 = 0.0"]
    for j, slot in enumerate(slots):
        lines += [f"wp, wc = {at(f'predict{j}')}, {at(f'correct{j + 1}')}"]
        for i in range(5):
            lines += [f"f = {at(f'f{slot}_{i}')}", f"q{i} += wp * f", f"g{i} += wc * f"]
        if j < len(BDF):
            for i in range(2):
                value = at(f"v{slot}_{i}")
                lines += [f"e{i} += {EXTRAPOLATE[j]!r} * {value}", f"b{i} += {BDF[j]!r} * {value}"]
    return [
        *lines,
        f"w0 = {at('correct0')}",
        "f, geometry = slow(q0, q1, q2, q3, q4, e0, e1, p)",
        f"v0, v1, num, den = newton(q0, q1, e0, e1, geometry, p, {at('gamma')}, b0, b1)",
        *_correct_lines(at),
        *(f"q{i} = q{i} + d{i}" for i in range(4)),
        "q4 = g4 + w0 * f[4]",
        "f, geometry = slow(q0, q1, q2, q3, q4, v0, v1, p)",
        *_correct_lines(at),
        *(f"c{i} = q{i} + d{i}" for i in range(4)),
        "c4 = g4 + w0 * f[4]",
    ]


def _correct_lines(at: At) -> list[str]:
    """r = what the corrector asks beyond q, d = P r for the four rocking states."""
    lines = [f"r{i} = g{i} + w0 * f[{i}] - q{i}" for i in range(4)]
    products = [[at(f"P{i}{j}") + f" * r{j}" for j in range(4)] for i in range(4)]
    return lines + [f"d{i} = {' + '.join(products[i])}" for i in range(4)]


def store_lines(at: At, slot: int) -> list[str]:
    """The new point into `slot` of the history; its slopes are those that the corrected states imply."""
    return [
        *(f"{at(f'f{slot}_{i}')} = f[{i}] + (d{i} - r{i}) * {at('per_weight')}" for i in range(4)),
        f"{at(f'f{slot}_4')} = f[4]",
        *(f"{at(f'v{slot}_{i}')} = v{i}" for i in range(2)),
    ]


def accept_lines(at: At) -> list[str]:
    """The new states where `accepted`; a status that says what failed where `active` but not `sound`."""
    return [
        *(f"{at(SPLIT.states[i])} = c{i} if accepted else y{i}" for i in range(5)),
        *(f"{at(SPLIT.states[5 + i])} = v{i} if accepted else y{5 + i}" for i in range(2)),
        f"failure = {PARADOX} if den <= 0.0 else ({LIFT_OFF} if num <= 0.0 else {DIVERGED})",
        f"{at('status')} = failure if active & (not sound) else status",
    ]
