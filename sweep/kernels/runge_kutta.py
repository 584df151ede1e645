"""Explicit Runge-Kutta methods, with the step unrolled from a tableau into straight-line code on scalars.

A loop over stages and states would need arrays, and arrays inside the loop over lanes prevent LLVM
from vectorising across trajectories.  So the step is written out for each tableau and number of
states, as plain assignments, which the compiler keeps in registers.

To add a method, write its record and enter it in `TABLEAUS`; `tests/kernels/test_tableau.py` then checks it.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction as F

import numpy as np

from sweep.jit import exactly_compiled, full_width
from sweep.kernels.codegen import make_accept, make_access
from sweep.kernels.kernel import STABILITY_SHARE, Kernel, Stepper, steps_to
from sweep.kernels.layout import BLOCK, PACK, Table
from sweep.kernels.method import TOLERANCE, Tolerance
from sweep.kernels.status import RUNNING
from sweep.models.generated import compile_inline, tuple_of
from sweep.models.model import Array, Columns, Model

LAYER_STEP = 3.0
"""Step, in decay times of the slip, to which `RungeKutta.layer_error` is scaled."""


@dataclass(frozen=True, kw_only=True)
class RungeKutta(Stepper):
    """An explicit Runge-Kutta method for autonomous systems: its Butcher tableau, and how long its steps may be.

    `a[i]` holds the weights of the slopes 0 … i in the argument of slope i + 1, `b` those in the result, and `c` the
    abscissae.  They are exact fractions, so that the tests find a mistyped entry.  `error_order` is the order of the
    formula, `real_stability` the largest z with |R(-z)| <= 1, and `step_cost` the number of stages over six.
    """

    step_words: str = f"{STABILITY_SHARE:g} of the stability limit"
    takes_every_step: bool = True
    a: tuple[tuple[F, ...], ...]
    b: tuple[F, ...]
    c: tuple[F, ...]
    phase: float
    """Error constant: the phase of the fastest motion in a step at the default tolerance, in units of
    `Model.radians_a_step`.  The error falls with the power `error_order` of it."""
    layer_error: float
    """Error constant of the start: the relative error of the slip while it goes from zero to its
    quasi-steady value, v' = λ (1 - v).  For short steps h it is |C| (h λ)^order / e, where the stability function is
    R(-z) = exp(-z) + C z^(order + 1) + …; give that at h λ = `LAYER_STEP`, whether or not such a step is stable."""

    @property
    def stages(self) -> int:
        return len(self.b)

    def accurate_step(self, model: Model, columns: Columns, motion: Array, decay: Array, tolerance: Tolerance) -> Array:
        """As of `Stepper`."""
        power = 1 / self.error_order
        step = self.phase * model.radians_a_step * (tolerance / TOLERANCE) ** power / motion
        if not decay.any():
            return np.asarray(step)
        # A slip that differs by v for a time 1/λ changes the rattle, of frequency ν, by the share (ν/λ)².
        spin, rattle, inertia = model.energy(model.start(columns), model.constants.of(columns))
        e = 2 * rattle / inertia
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            moved = self.layer_error * e / np.sqrt(spin**2 + e) * (motion / decay) ** 2 / model.spin_unit(columns)
            return np.asarray(np.fmin(step, LAYER_STEP / decay * (tolerance / moved) ** power))

    def prepare(self, kernel: Kernel, table: Table, columns: Columns, step: Array, t_end: float | Array) -> None:
        """Take steps no longer than `step` that divide `t_end` evenly."""
        table["steps"] = table["goal"] = goal = steps_to(t_end, step)
        table["step"] = t_end / goal

    def body(self, kernel: Kernel):
        model, layout = kernel.model, kernel.layout
        load_states, load_constants, _ = make_access(model, layout)
        step, watch = make_step(self, model.rhs, len(model.states)), kernel.make_watch()
        accept = make_accept(model, layout)
        STEP, GOAL, DONE, STATUS = map(layout.at, ("step", "goal", "done", "status"))
        block, pack, wide = BLOCK, PACK, full_width()

        @exactly_compiled
        def body(group, packs):
            wide()
            for _ in range(block):
                for lane in range(pack * packs):
                    y = load_states(group, lane)
                    p = load_constants(group, lane)
                    h, done, status = group[STEP + lane], group[DONE + lane], group[STATUS + lane]
                    new, spin, work, sound, airborne, jammed = step(y, p, h)
                    active = (status == RUNNING) & (done < group[GOAL + lane])
                    accepted = accept(group, lane, status, active, y, new, sound, airborne, jammed)
                    group[DONE + lane] = done + (1.0 if accepted else 0.0)
                    watch(group, lane, accepted, y, p, spin, work, h, (done + 1.0) * h)

        return body


def make_step(tableau: RungeKutta, rhs, n_states: int):
    """Inline (states, constants, h) -> (states, spin, work, sound, airborne, jammed): one step.

    Returns the states after the time h; the spin before the step; the integral of the dissipated power over the
    step, with the weights of the method; whether the normal force and the
    Painlevé denominator were positive in every stage (`sound`, which is also false where they are NaN);
    and whether in some stage the force (`airborne`) or the denominator (`jammed`) was zero or negative.
    """
    lines = ["k0, m0 = rhs(y, p)"]
    for stage, row in enumerate(tableau.a, start=1):
        weights = {j: f"h{stage}_{j}" for j, w in enumerate(row) if w}
        lines += [f"{name} = h * {float(row[j])!r}" for j, name in weights.items()]
        sums = [" + ".join(f"{name} * k{j}[{i}]" for j, name in weights.items()) for i in range(n_states)]
        lines.append(f"k{stage}, m{stage} = rhs({tuple_of(f'y[{i}] + ({sums[i]})' for i in range(n_states))}, p)")
    b = {j: repr(float(w)) for j, w in enumerate(tableau.b) if w}
    stages = range(tableau.stages)
    power = " + ".join(f"{w} * m{j}[1]" for j, w in b.items())
    sums = [" + ".join(f"{w} * k{j}[{i}]" for j, w in b.items()) for i in range(n_states)]
    result = tuple_of(f"y[{i}] + h * ({sums[i]})" for i in range(n_states))
    lines += [
        f"work = h * ({power})",
        f"sound = {' & '.join(f'(m{j}[2] > 0.0) & (m{j}[3] > 0.0)' for j in stages)}",
        f"airborne = {' | '.join(f'(m{j}[2] <= 0.0)' for j in stages)}",
        f"jammed = {' | '.join(f'(m{j}[3] <= 0.0)' for j in stages)}",
        f"return {result}, m0[0], work, sound, airborne, jammed",
    ]
    return compile_inline("step", "y, p, h", lines, {"rhs": rhs})


# Dormand & Prince (1980), J. Comput. Appl. Math. 6, 19, table 2: RK5(4)7M.  Its seventh stage
# is left out: it serves only the embedded error estimate, which a fixed step does not use.
DOPRI5 = RungeKutta(
    name="dopri5",
    code=0,
    summary="the Runge-Kutta formula of order five by Dormand and Prince, with a fixed step, for every model",
    automatic=True,
    error_order=5,
    a=(
        (F(1, 5),),
        (F(3, 40), F(9, 40)),
        (F(44, 45), F(-56, 15), F(32, 9)),
        (F(19372, 6561), F(-25360, 2187), F(64448, 6561), F(-212, 729)),
        (F(9017, 3168), F(-355, 33), F(46732, 5247), F(49, 176), F(-5103, 18656)),
    ),
    b=(F(35, 384), F(0), F(500, 1113), F(125, 192), F(-2187, 6784), F(11, 84)),
    c=(F(0), F(1, 5), F(3, 10), F(4, 5), F(8, 9), F(1)),
    real_stability=3.3066,
    phase=1.0,
    layer_error=0.02,
)

TABLEAUS = (DOPRI5,)
"""All tableaus; the first runs every model."""
