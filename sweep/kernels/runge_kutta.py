"""Explicit Runge-Kutta methods, with the step unrolled from a tableau into straight-line code on scalars.

A loop over stages and states would need arrays, and arrays inside the loop over lanes prevent LLVM
from vectorising across trajectories.  So the step is written out for each tableau and number of
states, as plain assignments, which the compiler keeps in registers.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from sweep.jit import exactly_compiled, full_width
from sweep.kernels import tangent
from sweep.kernels.codegen import compile_inline, make_load, make_store, tuple_of
from sweep.kernels.differentiate import make_extended
from sweep.kernels.kernel import Kernel, steps_to
from sweep.kernels.layout import BLOCK, LANES
from sweep.kernels.measures.measurement import Measurement
from sweep.kernels.method import TOLERANCE, Method
from sweep.kernels.status import DIVERGED, LIFT_OFF, PARADOX, RUNNING
from sweep.kernels.tableau import DOPRI5, LAYER_STEP, Tableau
from sweep.models.model import Array, Columns, Model


class RungeKuttaKernel(Kernel):
    """The `Kernel` of a tableau, for any model."""

    def __init__(self, model: Model, tableau: Tableau, measurements: Sequence[Measurement]) -> None:
        self.method, self.tableau = tableau.name, tableau
        self.follows_tangent = any(each.follows_tangent for each in measurements)
        self._lay_out(model, measurements, tangent.quantities(model) if self.follows_tangent else ())
        run_block = self._make_run_block()
        self._compile_with(self._with_tangent(run_block) if self.follows_tangent else run_block)

    def images(self, columns: Columns, step: Array, t_end: float | Array, stable: Array | None = None) -> Array:
        """As `Kernel.images`; the steps taken are no longer than `step` and divide `t_end` evenly."""
        goal = steps_to(t_end, step)
        stable_step = t_end / goal * self.model.fastest_decay(columns) <= self.tableau.real_stability
        images = self._start(columns, t_end / goal, goal, stable_step, stable)
        if self.follows_tangent:
            table = self.table(images)
            for name, values in tangent.start(self.model, self.states(images)).items():
                table[name] = values
        return images

    def _with_tangent(self, run_block: Any) -> Any:
        """Compiled (group) -> None: as `run_block`, and then the tangents take the same steps."""
        step = make_step(self.tableau, make_extended(self.model), 2 * len(self.model.states))
        follow = tangent.make_follow(step, self.model, self.constants, self.layout)

        @exactly_compiled
        def run_both(group: Any) -> None:
            run_block(group)
            follow(group)

        return run_both

    def _make_run_block(self) -> Any:
        """Compiled (group) -> None: takes `BLOCK` steps of all lanes, and calls the measurements after each."""
        model, layout = self.model, self.layout
        load_states = make_load(model.states, layout)
        load_constants = make_load(self.constants, layout, model.constants)
        store_states = make_store(model.states, layout)
        step, watch = make_step(self.tableau, model.rhs, len(model.states)), self._make_watch()
        STEP, GOAL, DONE, STATUS = map(layout.at, ("step", "goal", "done", "status"))
        block, lanes, wide = BLOCK, LANES, full_width()

        @exactly_compiled
        def run_block(group: Any) -> None:
            wide()
            for _ in range(block):
                for lane in range(lanes):
                    y = load_states(group, lane)
                    p = load_constants(group, lane)
                    h, done, status = group[STEP + lane], group[DONE + lane], group[STATUS + lane]
                    new, spin, work, sound, airborne, jammed = step(y, p, h)
                    active = (status == RUNNING) & (done < group[GOAL + lane])
                    accepted = active & sound
                    store_states(group, lane, accepted, new, y)
                    group[DONE + lane] = done + (1.0 if accepted else 0.0)
                    failure = PARADOX if jammed else (LIFT_OFF if airborne else DIVERGED)
                    group[STATUS + lane] = failure if active & (not sound) else status
                    watch(group, lane, accepted, y, p, spin, work, h, (done + 1.0) * h)

        return run_block


def make_step(tableau: Tableau, rhs: Any, n_states: int) -> Any:
    """Inline (states, constants, h) -> (states, spin, work, sound, airborne, jammed): one step.

    Returned are the states after the time h; the spin before the step; the integral of the dissipated power over the
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


_STABILITY_SHARE = 0.9
"""Share of the stability interval that an automatic step uses for the fastest decay."""


def method(tableau: Tableau) -> Method:
    """The record of the method of a tableau."""
    longest = _STABILITY_SHARE * tableau.real_stability
    return Method(
        name=tableau.name,
        code=tableau.code,
        summary=tableau.summary,
        kernel=lambda model, measurements, tolerance: RungeKuttaKernel(model, tableau, measurements),  # noqa: ARG005
        accurate_step=partial(_accurate_step, tableau),
        stable_step=lambda model, columns: np.asarray(longest / model.fastest_decay(columns)),
        step_words=f"{_STABILITY_SHARE:g} of the stability limit",
        step_cost=tableau.stages / DOPRI5.stages,
        error_order=tableau.order,
        takes_every_step=True,
    )


def _accurate_step(tableau: Tableau, model: Model, columns: Columns, motion: Array, tolerance: float) -> Array:
    power = 1 / tableau.order
    step = tableau.phase * model.radians_a_step * (tolerance / TOLERANCE) ** power / motion
    decay = model.fastest_decay(columns)
    if not decay.any():
        return np.asarray(step)
    # A slip that differs by v for a time 1/λ moves the rattle, of frequency ν, by (ν/λ)² of itself.
    spin, rattle, inertia = model.energy(model.start(columns), model.constants.of(columns))
    e = 2 * rattle / inertia
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        moved = tableau.layer_error * e / np.sqrt(spin**2 + e) * (motion / decay) ** 2 / model.spin_unit(columns)
        return np.asarray(np.fmin(step, LAYER_STEP / decay * (tolerance / moved) ** power))
