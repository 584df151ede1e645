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

from sweep.jit import OPTIONS, inline
from sweep.kernels.adams import stretches
from sweep.kernels.adams.start_up import POINT, ROWS, count_levels, duration, start_up
from sweep.kernels.adams.step import (
    BDF_GAMMA,
    CORRECTOR_NODES,
    HISTORY,
    PREDICTOR_NODES,
    accept_lines,
    load_lines,
    step_lines,
    store_lines,
)
from sweep.kernels.adams.weights import fitted_weights
from sweep.kernels.lanes import (
    BLOCK,
    DIVERGED,
    LANES,
    RUNNING,
    TOLERANCE,
    Kernel,
    make_watch_spin,
    watch_nothing,
)
from sweep.kernels.stepper import compile_inline
from sweep.models import linear, slip, slip_split
from sweep.models.ellipsoid import inertia
from sweep.models.model import Array, Columns, stack
from sweep.models.modes import bending
from sweep.models.slip_split import SPLIT, newton, slow

# Twice the spin error at t = 400 for h ν = 0.274 (h = 0.125) where the rattle takes R up by a quarter (a = 10,
# b = 3, n0 = 0.05): from there it goes as the seventh power of h ν and as the power 4.5 of the rise
# in R, and below μ = 60, where the slip is not quick beside a step, as 1/μ^1.5.
_ERROR, _PHASE, _RISE, _GRIP = 1e-6, 0.274, 0.25, 60.0
_LONGEST_PHASE = 0.45

assert BLOCK % HISTORY == 0


class AdamsKernel(Kernel):
    """`Kernel` for the slip model by this method; its states carry M in the place of ω.

    Where the rattle is so small that it moves by its linear modes to within `tolerance` in spin, it
    is carried on by them, without steps (`sweep.kernels.stretches`).
    """

    # No stability limit is near, and an error in spin of 1e-4 is one of 4e-3 in the energy of n = 0.05: with
    # 1e-5, loose tolerances at μ = 10⁴ ended as diverged, though every spin was right to the tolerance.
    energy_gain = 1e-2

    def __init__(self, measure: Iterable[str], tolerance: float = TOLERANCE) -> None:
        self.tolerance = tolerance
        history = [name.format(j) for j in range(HISTORY) for name in POINT]
        weights = [f"predict{j}" for j in range(len(PREDICTOR_NODES))]
        weights += [f"correct{j}" for j in range(len(CORRECTOR_NODES))]
        matrix = [f"P{i}{j}" for i in range(4) for j in range(4)]
        more = ["quiet_energy", "quiet_after", "bending", *stretches.LIFTS]
        more += ["begin", "spin", "power0", "power1", "power2", "gamma", "per_weight", *weights, *matrix, *history]
        self._lay_out(SPLIT, measure, more)
        self._advance = self._make_advance(_make_run_block(self.rows, self.measure), "adams")

    def images(self, columns: Columns, step: Array, t_end: float | Array, stable: Array, period: Array) -> Array:
        """As `Kernel.images`; the images have gone through start-up, to the time in their row `begin`."""
        levels = count_levels(columns["mu"], step)
        lead = duration(levels)
        goal = np.maximum(np.ceil(t_end / step - lead), 1)
        step = t_end / (goal + lead)
        images = self._start(columns, step, goal, np.ones(len(step)), stable, period)
        self._set_method(images, step)
        rows = tuple(self.row(name) if name in self.rows else -1 for name in ROWS)
        start_up(images, rows, stack(slip.start(columns)).T, levels)
        self._make_up(images, columns)
        return images

    def times(self, images: Array, t_end: float | Array) -> Array:
        done = images[:, self.row("done")]
        reached = images[:, self.row("begin")] + done * images[:, self.row("step")]
        return np.where(done == images[:, self.row("goal")], t_end, reached)

    def _set_method(self, images: Array, step: Array) -> None:
        """Weights and matrices."""
        constants = self.unpack(images)[1]
        phase = slip_split.fastest_rocking(constants) * step
        predict = step[:, None] * fitted_weights(PREDICTOR_NODES, phase)
        correct = step[:, None] * fitted_weights(CORRECTOR_NODES, phase)
        matrix = stack(slip_split.implicit(correct[:, 0], constants)).T
        for first, values in (("predict0", predict), ("correct0", correct), ("P00", matrix)):
            row = self.row(first)
            images[:, row : row + values.shape[1]] = values
        images[:, self.row("per_weight")] = 1 / correct[:, 0]
        images[:, self.row("gamma")] = BDF_GAMMA * step

    def _make_up(self, images: Array, columns: Columns) -> None:
        """What the looks between blocks and the measurements missed of start-up."""
        begin = images[:, self.row("begin")]
        spin, rattle, inertia = SPLIT.energy(*self.unpack(images))
        energy = rattle + 0.5 * inertia * spin**2
        grown = energy > images[:, self.row("energy_start")] * (1 + self.energy_gain)
        images[grown, self.row("status")] = DIVERGED
        images[:, self.row("energy")] = energy
        images[:, self.row("spin")] = spin
        reach, goal = linear.fastest_spin(SPLIT, columns), images[:, self.row("goal")]
        images[:, self.row("quiet_energy")] = stretches.quiet_energy(reach)
        time = goal * images[:, self.row("step")]
        images[:, self.row("quiet_after")] = stretches.first_look(columns, reach, time, goal, self.tolerance)
        images[:, self.row("bending")] = bending(columns)
        if "reversals" in self.measure:
            images[:, self.row("phase")] = begin
            images[:, self.row("window")] = begin * (columns["n0"] + spin) / 2

    def carry(self, images: Array) -> None:
        stretches.carry(self, images, HISTORY, self.tolerance)


def accurate_step(columns: Columns, tolerance: float) -> Array:
    """Step in sqrt(c/g) that keeps the spin to `tolerance` at t = 400, shape (cells,)."""
    nu = slip_split.fastest_rocking(slip_split.constants(columns))
    I1, I2, _ = inertia(columns)
    at_rest = 1 + columns["c"] ** 2 / np.minimum(I1, I2)
    rise = np.maximum(slip.strongest_grip(columns) / at_rest - 1, 0.02)
    friction = np.maximum(columns["mu"] * np.sqrt(columns["c"]), 1.0)
    error = _ERROR * (rise / _RISE) ** 4.5 * np.maximum(_GRIP / friction, 1.0) ** 1.5
    return np.asarray(np.minimum(_PHASE * (tolerance / error) ** (1 / 7), _LONGEST_PHASE) / nu)


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

    return [
        *load_lines(at),
        *step_lines(at, [(phase - 1 - j) % HISTORY for j in range(HISTORY)]),
        "sound = (num > 0.0) & (den > 0.0)",
        f"status, done, h = {at('status')}, {at('done')}, {at('step')}",
        f"active = (status == {RUNNING}) & (done < {at('goal')})",
        "accepted = active & sound",
        *accept_lines(at),
        *store_lines(at, phase),
        f"{at('done')} = done + (1.0 if accepted else 0.0)",
        f"old = {at('spin')}",
        "spin = q0 * geometry[7] + q1 * geometry[8] + geometry[0] * geometry[9]",
        f"{at('spin')} = spin if accepted else old",
        f"now = {at('begin')} + (done + 1.0) * h",
        "watch_spin(group, lane, accepted, old, 0.5 * h * (old + spin), h, now)",
        "add_work(group, lane, accepted, h, p[13] * (num / den), v0, v1, geometry)",
    ]


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
