"""A method whose step does not feel friction: Adams for the slow variables, BDF for the slip.

Fixed step per trajectory, two evaluations a step, history of eight:

1. Adams-Bashforth predicts (u, M), extrapolation of five points predicts the slip.
2. At that point: the slow derivatives, and one Newton step of BDF5 for the slip.
3. Adams-Moulton of order nine corrects, made linearly implicit by the constant matrix
   P = (1 - h w_0 J)⁻¹, J the rocking about upright rest: without it the method is unstable at useful steps.
4. The slow derivatives again, with the new slip, and the same correction.

The Adams weights are exact for polynomials and for cos and sin of the fastest rocking ν and of 3 ν: the
third harmonic dominates the error of the plain ones, and fitting it costs nothing in the step.
Tried and rejected, with figures: docs/stiff.md.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numba
import numpy as np

from sweep.jit import OPTIONS, inline, parallel
from sweep.kernels import stretches
from sweep.kernels.lanes import (
    BLOCK,
    DIVERGED,
    LANES,
    LIFT_OFF,
    PARADOX,
    RUNNING,
    TOLERANCE,
    Kernel,
    count_constants,
    make_watch_spin,
    watch_nothing,
)
from sweep.kernels.stepper import compile_inline, make_step
from sweep.kernels.tableau import DOPRI5
from sweep.models import linear, slip, slip_split
from sweep.models.ellipsoid import inertia
from sweep.models.model import Array, Columns, stack
from sweep.models.modes import bending
from sweep.models.slip_split import SPLIT, newton, slow

HISTORY = 8
PREDICTOR, CORRECTOR = 8, 9

# BDF5 and its predictor, the extrapolation of five points; both exact for polynomials of degree 4.
BDF = (300 / 137, -300 / 137, 200 / 137, -75 / 137, 12 / 137)
BDF_GAMMA = 60 / 137
EXTRAPOLATE = (5.0, -10.0, 10.0, -5.0, 1.0)

# The slip starts off its slow value and gets there in a layer of 1/μ.  Start-up resolves it with a
# step of this share of its width and doubles from there; each level runs on until the last one's
# error has decayed (eight steps: floor 1e-10; none: 1e-7).
LAYER_SHARE = 0.1
EXTRA_STEPS = 8

# Twice the spin error at t = 400 for h ν = 0.274 (h = 0.125) where the rattle takes R up by a quarter (a = 10,
# b = 3, n0 = 0.05): from there it goes as the seventh power of h ν and as the power 4.5 of the rise
# in R, and below μ = 60, where the slip is not quick beside a step, as 1/μ^1.5.
_ERROR, _PHASE, _RISE, _GRIP = 1e-6, 0.274, 0.25, 60.0
_LONGEST_PHASE = 0.45

assert BLOCK % HISTORY == 0
assert max(PREDICTOR, CORRECTOR - 1, len(BDF)) == HISTORY


class AdamsKernel(Kernel):
    """`Kernel` for the slip model by this method; its states carry M in the place of ω.

    Where the rattle is so small that it moves by its linear modes to within `tolerance` in spin, it
    is carried on by them, without steps (`sweep.kernels.stretches`).
    """

    def __init__(self, measure: Iterable[str], tolerance: float = TOLERANCE) -> None:
        self.tolerance = tolerance
        history = [f"{name}{j}_{i}" for j in range(HISTORY) for name, n in (("f", 5), ("v", 2)) for i in range(n)]
        weights = [f"predict{j}" for j in range(PREDICTOR)] + [f"correct{j}" for j in range(CORRECTOR)]
        matrix = [f"P{i}{j}" for i in range(4) for j in range(4)]
        more = ["quiet_energy", "quiet_after", "bending", *stretches.LIFTS]
        more += ["begin", "spin", "power0", "power1", "power2", "gamma", "per_weight", *weights, *matrix, *history]
        self._lay_out(SPLIT, measure, more)
        self._advance = self._make_advance(_make_run_block(self.rows, self.measure), "adams")

    def images(self, columns: Columns, step: Array, t_end: float | Array, stable: Array, period: Array) -> Array:
        """As `Kernel.images`; the images have gone through start-up, to the time in their row `begin`."""
        levels = _levels(columns["mu"], step)
        lead = _lead(levels)
        goal = np.maximum(np.ceil(t_end / step - lead), 1)
        step = t_end / (goal + lead)
        images = self._start(columns, step, goal, np.ones(len(step)), stable, period)
        self._fill(images, columns, step, levels, lead)
        return images

    def times(self, images: Array, t_end: float | Array) -> Array:
        done = images[:, self.row("done")]
        reached = images[:, self.row("begin")] + done * images[:, self.row("step")]
        return np.where(done == images[:, self.row("goal")], t_end, reached)

    def _fill(self, images: Array, columns: Columns, step: Array, levels: Array, lead: Array) -> None:
        """Start-up: weights, matrices, history, and what the measurements missed of it."""
        rocking = slip_split.rocking(columns)
        nu = np.abs(np.linalg.eigvals(rocking).imag).max(axis=-1)
        pairs = np.stack([nu * step, 3 * nu * step])
        predict = fitted_weights(-np.arange(PREDICTOR), pairs)
        correct = fitted_weights(1 - np.arange(CORRECTOR), pairs)
        first = self.row("predict0")
        images[:, first : first + PREDICTOR] = step[:, None] * predict
        first = self.row("correct0")
        images[:, first : first + CORRECTOR] = step[:, None] * correct
        images[:, self.row("per_weight")] = 1 / (step * correct[:, 0])
        images[:, self.row("gamma")] = BDF_GAMMA * step
        first = self.row("P00")
        images[:, first : first + 16] = _implicit(rocking, step * correct[:, 0]).reshape(-1, 16)

        none = np.zeros((2, 1))
        plain = fitted_weights(-np.arange(PREDICTOR), none)[0], fitted_weights(1 - np.arange(CORRECTOR), none)[0]
        starts, constants = stack(slip.start(columns)).T.copy(), stack(slip_split.constants(columns)).T.copy()
        states = np.empty((len(step), HISTORY, 7))
        power = np.zeros((len(step), 4))
        weigh = "energy_error" in self.measure
        _start_up(starts, constants, step, levels, *plain, rocking.copy(), weigh, states, power)

        spin = self._write_states(images, np.moveaxis(states[:, ::-1], 0, -1))
        images[:, self.row("begin")] = lead * step
        reach = linear.fastest_spin(SPLIT, columns)
        images[:, self.row("quiet_energy")] = stretches.quiet_energy(reach)
        images[:, self.row("bending")] = bending(columns)
        if "reversals" in self.measure:
            images[:, self.row("phase")] = lead * step
            images[:, self.row("window")] = lead * step * (columns["n0"] + spin) / 2
        if "energy_error" in self.measure:
            images[:, self.row("work")] = power[:, 3]
            for i in range(3):
                images[:, self.row(f"power{i}")] = power[:, i]

    def _write_states(self, images: Array, states: Array) -> Array:
        """Let `images` stand at the first of `states`, shape (history, states, cells), newest first; the spin there."""
        constants = self.unpack(images)[1]
        images[:, :7] = states[0].T
        for j, state in enumerate(states):
            # Slot of the state j steps back, for a block that begins by writing slot 0.
            first = self.row(f"f{(-1 - j) % HISTORY}_0")
            images[:, first : first + 5] = stack(slow(*state, constants)[0]).T
            images[:, first + 5 : first + 7] = state[5:].T
        spin, _, _ = SPLIT.energy(states[0], constants)
        images[:, self.row("spin")] = spin
        return np.asarray(spin)

    def carry(self, images: Array) -> None:
        stretches.carry(self, images, HISTORY, self.tolerance)


def accurate_step(columns: Columns, tolerance: float) -> Array:
    """Step in sqrt(c/g) that keeps the spin to `tolerance` at t = 400, shape (cells,)."""
    nu = np.abs(np.linalg.eigvals(slip_split.rocking(columns)).imag).max(axis=-1)
    I1, I2, _ = inertia(columns)
    at_rest = 1 + columns["c"] ** 2 / np.minimum(I1, I2)
    rise = np.maximum(slip.strongest_grip(columns) / at_rest - 1, 0.02)
    friction = np.maximum(columns["mu"] * np.sqrt(columns["c"]), 1.0)
    error = _ERROR * (rise / _RISE) ** 4.5 * np.maximum(_GRIP / friction, 1.0) ** 1.5
    return np.asarray(np.minimum(_PHASE * (tolerance / error) ** (1 / 7), _LONGEST_PHASE) / nu)


def _levels(mu: Array, step: Array) -> Array:
    """Halvings from `step` to one that resolves the layer, at least two."""
    return np.maximum(2, np.ceil(np.log2(step * (2.2 * mu + 2.2) / LAYER_SHARE))).astype(np.int64)


def _lead(levels: Array) -> Array:
    """Time that start-up covers, in steps."""
    first = (2 * HISTORY - 2) / 2.0**levels
    doubling = (HISTORY - 1 + EXTRA_STEPS) * (1 - 2.0 ** (1 - levels))
    return np.asarray(first + doubling)


def _implicit(rocking: Array, weight: Array) -> Array:
    return np.asarray(np.linalg.inv(np.eye(4) - weight[:, None, None] * rocking))


def fitted_weights(nodes: Array, pairs: Array) -> Array:
    """Weights w with ∫_0^1 p(t) dt = Σ w_j p(nodes_j), exact for powers and for cos, sin of two frequencies.

    Parameters
    ----------
    nodes : k abscissae in steps
    pairs : the two frequencies times the step, shape (2, cells); zeros give the plain Adams weights

    Returns
    -------
    Weights of shape (cells, k).

    Notes
    -----
    cos and sin enter with their Taylor part removed and scaled, and the second pair as a divided
    difference in ω², so the system stays regular as the frequencies go to zero.
    """
    weights = np.empty((pairs.shape[1], len(nodes)))
    _fit(nodes.astype(float), pairs.T.copy(), weights)
    return weights


_TERMS = 30


@numba.njit(**OPTIONS)
def _fit_cell(nodes: Any, first: float, second: float, weights: Any) -> None:
    k = len(nodes)
    n = k - 4
    reach = np.abs(nodes).max()  # scales the rows to one
    A, b = np.zeros((k, k)), np.zeros(k)
    for i in range(n):
        b[i] = 1.0 / (i + 1) / reach**i
        for j in range(k):
            A[i, j] = (nodes[j] / reach) ** i
    for odd in range(2):
        power, row = n + odd, n + odd
        # Σ_m c_m ω^(2m) t^(power + 2m) with c_m = (-1)^m power!/(power + 2m)!, and its difference quotient
        c, squares, quotient = 1.0, 1.0, 0.0
        for m in range(_TERMS):
            if m:
                c = -c / ((power + 2 * m - 1) * (power + 2 * m))
                quotient = quotient * second * second + squares
                squares *= first * first
            for j in range(k):
                t = (nodes[j] / reach) ** power * nodes[j] ** (2 * m)
                A[row, j] += c * squares * t
                A[row + 2, j] += c * quotient * t / reach**2
            integral = c / (power + 2 * m + 1) / reach**power
            b[row] += squares * integral
            b[row + 2] += quotient * integral / reach**2
    for r in range(k):
        pivot = r
        for i in range(r + 1, k):
            if abs(A[i, r]) > abs(A[pivot, r]):
                pivot = i
        for j in range(k):
            A[r, j], A[pivot, j] = A[pivot, j], A[r, j]
        b[r], b[pivot] = b[pivot], b[r]
        for i in range(r + 1, k):
            factor = A[i, r] / A[r, r]
            for j in range(r, k):
                A[i, j] -= factor * A[r, j]
            b[i] -= factor * b[r]
    for r in range(k - 1, -1, -1):
        total = b[r]
        for j in range(r + 1, k):
            total -= A[r, j] * weights[j]
        weights[r] = total / A[r, r]


def _make_fit() -> Any:
    cell = _fit_cell

    def fit(nodes: Any, pairs: Any, weights: Any) -> None:
        for i in numba.prange(len(pairs)):
            cell(nodes, pairs[i, 0], pairs[i, 1], weights[i])

    return parallel(fit, "fit", slip.__file__)


_fit = _make_fit()


def _make_run_block(rows: tuple[str, ...], measure: tuple[str, ...]) -> Any:
    """Compiled group -> None: `BLOCK` steps of all lanes.

    The history is a ring: the eight phases of its turn are written out, for moving it along instead
    took 19 ns a step and lane in place of 15.
    """
    names: dict[str, Any] = {
        "slow": slow,
        "newton": newton,
        "watch_spin": make_watch_spin(rows) if "reversals" in measure else watch_nothing,
        "add_work": _make_add_work(rows) if "energy_error" in measure else watch_nothing,
    }
    lines = ["def run_block(group):", f"    for _ in range({BLOCK // HISTORY}):"]
    for phase in range(HISTORY):
        lines.append(f"        for lane in range({LANES}):")
        lines += [f"            {line}" for line in _step_lines(rows, phase)]
    return numba.njit(compile_inline("run_block", "\n".join(lines), names), **OPTIONS)


def _step_lines(rows: tuple[str, ...], phase: int) -> list[str]:
    """One step as source, writing slot `phase` of the history.  The loop body itself: as a function of
    its own LLVM unrolls the lanes before it inlines, and nothing vectorises."""

    def at(name: str) -> str:
        return f"group[{rows.index(name) * LANES} + lane]"

    n_constants = count_constants(SPLIT)
    lines = [f"p = ({' '.join(at(f'constant{i}') + ',' for i in range(n_constants))})"]
    lines += [f"y{i} = {at(SPLIT.states[i])}" for i in range(7)]
    lines += [f"q{i} = g{i} = y{i}" for i in range(5)]
    lines += ["e0 = e1 = b0 = b1 = 0.0"]
    for j in range(HISTORY):
        slot = (phase - 1 - j) % HISTORY
        lines += [f"wp, wc = {at(f'predict{j}')}, {at(f'correct{j + 1}')}"]
        for i in range(5):
            lines += [f"f = {at(f'f{slot}_{i}')}", f"q{i} += wp * f", f"g{i} += wc * f"]
        if j < len(BDF):
            for i in range(2):
                value = at(f"v{slot}_{i}")
                lines += [f"e{i} += {EXTRAPOLATE[j]!r} * {value}", f"b{i} += {BDF[j]!r} * {value}"]
    lines += [
        f"w0 = {at('correct0')}",
        "f, geometry = slow(q0, q1, q2, q3, q4, e0, e1, p)",
        f"v0, v1, num, den = newton(q0, q1, e0, e1, geometry, p, {at('gamma')}, b0, b1)",
        *_correct_lines(at),
        *(f"q{i} = q{i} + d{i}" for i in range(4)),
        "q4 = g4 + w0 * f[4]",
        "f, geometry = slow(q0, q1, q2, q3, q4, v0, v1, p)",
        *_correct_lines(at),
        "sound = (num > 0.0) & (den > 0.0)",
        f"status, done, h = {at('status')}, {at('done')}, {at('step')}",
        f"active = (status == {RUNNING}) & (done < {at('goal')})",
        "accepted = active & sound",
        *(f"{at(SPLIT.states[i])} = q{i} + d{i} if accepted else y{i}" for i in range(4)),
        f"{at(SPLIT.states[4])} = g4 + w0 * f[4] if accepted else y4",
        *(f"{at(SPLIT.states[5 + i])} = v{i} if accepted else y{5 + i}" for i in range(2)),
        *(f"{at(f'f{phase}_{i}')} = f[{i}] + (d{i} - r{i}) * {at('per_weight')}" for i in range(4)),
        f"{at(f'f{phase}_4')} = f[4]",
        *(f"{at(f'v{phase}_{i}')} = v{i}" for i in range(2)),
        f"{at('done')} = done + (1.0 if accepted else 0.0)",
        f"failure = {PARADOX} if den <= 0.0 else ({LIFT_OFF} if num <= 0.0 else {DIVERGED})",
        f"{at('status')} = failure if active & (not sound) else status",
        f"old = {at('spin')}",
        "spin = q0 * geometry[7] + q1 * geometry[8] + geometry[0] * geometry[9]",
        f"{at('spin')} = spin if accepted else old",
        f"now = {at('begin')} + (done + 1.0) * h",
        "watch_spin(group, lane, accepted, old, 0.5 * h * (old + spin), h, now)",
        "add_work(group, lane, accepted, h, p[13] * (num / den), v0, v1, geometry)",
    ]
    return lines


def _correct_lines(at: Any) -> list[str]:
    """r = what the corrector asks beyond q, d = P r for the four rocking states."""
    lines = [f"r{i} = g{i} + w0 * f[{i}] - q{i}" for i in range(4)]
    products = [[at(f"P{i}{j}") + f" * r{j}" for j in range(4)] for i in range(4)]
    return lines + [f"d{i} = {' + '.join(products[i])}" for i in range(4)]


def _make_add_work(rows: tuple[str, ...]) -> Any:
    """Compiled: add the work of friction in a step, by the Adams-Moulton formula of order four."""
    WORK, P0, P1, P2 = (rows.index(name) * LANES for name in ("work", "power0", "power1", "power2"))

    @inline
    def add_work(group: Any, lane: int, accepted: Any, h: Any, friction: Any, v1: Any, v2: Any, geometry: Any) -> None:
        v3 = -(v1 * geometry[4] + v2 * geometry[5])
        power = friction * (v1 * v1 + v2 * v2 + v3 * v3)
        p0, p1, p2 = group[P0 + lane], group[P1 + lane], group[P2 + lane]
        work = h / 24.0 * (9.0 * power + 19.0 * p0 - 5.0 * p1 + p2)
        group[WORK + lane] += work if accepted else 0.0
        group[P0 + lane], group[P1 + lane], group[P2 + lane] = power, p0, p1

    return add_work


_slip_step = make_step(DOPRI5, slip.rhs, 7)


@numba.njit(**OPTIONS)
def _power(y: Any, p: Any) -> float:
    """Dissipated power μ R v² at states of the split form."""
    _, geometry = slow(y[0], y[1], y[2], y[3], y[4], y[5], y[6], p)
    _, _, num, den = newton(y[0], y[1], y[5], y[6], geometry, p, 0.0, 0.0, 0.0)
    v3 = -(y[5] * geometry[4] + y[6] * geometry[5])
    return float(p[13] * num / den * (y[5] * y[5] + y[6] * y[6] + v3 * v3))


@numba.njit(**OPTIONS)
def _advance_history(y: Any, count: int, more: int, p: Any, h: float, predict: Any, correct: Any, P: Any) -> None:
    """Continue states y[:count] (oldest first, spaced h) by `more` steps of the method, plain weights."""
    f = np.zeros((count + more, 5))
    for n in range(count):
        slopes, _ = slow(y[n, 0], y[n, 1], y[n, 2], y[n, 3], y[n, 4], y[n, 5], y[n, 6], p)
        for i in range(5):
            f[n, i] = slopes[i]
    w0 = h * correct[0]
    q, g, r, d = np.zeros(5), np.zeros(5), np.zeros(4), np.zeros(4)
    for n in range(count, count + more):
        for i in range(5):
            q[i] = g[i] = y[n - 1, i]
            for j in range(HISTORY):
                q[i] += h * predict[j] * f[n - 1 - j, i]
                g[i] += h * correct[j + 1] * f[n - 1 - j, i]
        e0 = e1 = b0 = b1 = 0.0
        for j in range(5):
            e0, e1 = e0 + EXTRAPOLATE[j] * y[n - 1 - j, 5], e1 + EXTRAPOLATE[j] * y[n - 1 - j, 6]
            b0, b1 = b0 + BDF[j] * y[n - 1 - j, 5], b1 + BDF[j] * y[n - 1 - j, 6]
        slopes, geometry = slow(q[0], q[1], q[2], q[3], q[4], e0, e1, p)
        v0, v1, _, _ = newton(q[0], q[1], e0, e1, geometry, p, BDF_GAMMA * h, b0, b1)
        for evaluation in range(2):
            if evaluation:
                slopes, _ = slow(q[0], q[1], q[2], q[3], q[4], v0, v1, p)
            for i in range(4):
                r[i] = g[i] + w0 * slopes[i] - q[i]
            for i in range(4):
                d[i] = P[i, 0] * r[0] + P[i, 1] * r[1] + P[i, 2] * r[2] + P[i, 3] * r[3]
            for i in range(4):
                q[i] += d[i]
                f[n, i] = slopes[i] + (d[i] - r[i]) / w0
            q[4], f[n, 4] = g[4] + w0 * slopes[4], slopes[4]
        for i in range(5):
            y[n, i] = q[i]
        y[n, 5], y[n, 6] = v0, v1


@numba.njit(**OPTIONS)
def _approximate_implicit(J: Any, weight: float, P: Any) -> None:
    """(1 - w J)⁻¹ to second order in w J, which is below 0.05 in start-up."""
    for i in range(4):
        for j in range(4):
            square = 0.0
            for m in range(4):
                square += J[i, m] * J[m, j]
            P[i, j] = (1.0 if i == j else 0.0) + weight * J[i, j] + weight * weight * square


def _start_up_cell(
    start: Any,
    p: Any,
    step: float,
    levels: int,
    predict: Any,
    correct: Any,
    J: Any,
    weigh: bool,
    states: Any,
    power: Any,
) -> None:
    """Resolve the layer by dopri5, then double the step until it is `step`."""
    points = 2 * HISTORY - 1
    h = step / 2.0**levels
    y = np.zeros((points + HISTORY + EXTRA_STEPS, 7))
    one = (start[0], start[1], start[2], start[3], start[4], start[5], start[6])
    slip_constants = (p[0], p[1], p[2], p[3], p[7], p[8], p[9], p[10], p[11], p[12], p[13])
    all_constants = (p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9], p[10], p[11], p[12], p[13])
    work = 0.0
    for n in range(points):
        if n:
            one, _, _, done, _, _, _ = _slip_step(one, slip_constants, h)
            work += done
        if n % 2 == 0:
            split = slip_split.momentum(one, all_constants)
            for i in range(7):
                y[n // 2, i] = split[i]
    h *= 2
    count = HISTORY
    P = np.zeros((4, 4))
    for _ in range(1, levels):
        more = HISTORY - 1 + EXTRA_STEPS
        _approximate_implicit(J, h * correct[0], P)
        _advance_history(y, count, more, all_constants, h, predict, correct, P)
        if weigh:
            last = _power(y[count - 1], all_constants)
            for n in range(count, count + more):
                this = _power(y[n], all_constants)
                work += 0.5 * h * (last + this)
                last = this
        # Every second state, the last among them.
        for n in range(HISTORY):
            at = count + more - 1 - 2 * (HISTORY - 1 - n)
            for i in range(7):
                y[n, i] = y[at, i]
        h *= 2
    for n in range(HISTORY):
        for i in range(7):
            states[n, i] = y[n, i]
    for j in range(3):
        power[j] = _power(y[HISTORY - 1 - j], all_constants)
    power[3] = work


def _make_start_up() -> Any:
    cell = numba.njit(_start_up_cell, **OPTIONS)

    def start_up(
        starts: Any, constants: Any, steps: Any, levels: Any, predict: Any, correct: Any,
        rocking: Any, weigh: bool, states: Any, power: Any,
    ) -> None:  # fmt: skip
        for i in numba.prange(len(starts)):
            cell(starts[i], constants[i], steps[i], levels[i], predict, correct, rocking[i], weigh, states[i], power[i])

    return parallel(start_up, "start-up", slip.__file__)


_start_up = _make_start_up()
