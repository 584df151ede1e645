"""The kernel of the stiff method, whose step friction does not limit: Adams formulas for (u, M), BDF for the slip.

The step is fixed for each trajectory.  A step takes two evaluations of the derivatives and uses a history of eight
points:

1. Adams-Bashforth predicts (u, M); extrapolation from five points predicts the slip.
2. At the predicted point, the nonstiff derivatives are evaluated, and one Newton step of BDF5 gives the new slip.
3. Adams-Moulton of order nine corrects (u, M).  It is made linearly implicit by the constant matrix
   P = (1 - h w_0 J)⁻¹, where J is the matrix of the rocking about upright rest.  Without P the method would be unstable
   at useful steps.
4. The nonstiff derivatives are evaluated again, with the new slip, and the same correction is made once more.

The Adams weights are exact for polynomials, and for cos and sin at the fastest rocking frequency ν and at 3 ν.  The
third harmonic dominates the error of the plain weights, and fitting it costs nothing in the step.
scripts/LOG.md lists what else was tried, with figures.
"""

from __future__ import annotations

import numpy as np

from sweep.jit import Cached, compiled, full_width, inline, nothing
from sweep.kernels.adams import skips, start_up, weights
from sweep.kernels.adams.start_up import count_levels, duration
from sweep.kernels.adams.step import (
    BDF_GAMMA,
    CORRECT,
    CORRECTOR_NODES,
    HISTORY,
    MATRIX,
    POINT,
    PREDICT,
    PREDICTOR_NODES,
    make_advance,
    make_history,
    make_weights,
    work_of,
)
from sweep.kernels.codegen import make_accept, make_access
from sweep.kernels.kernel import Kernel, Stepper, steps_to
from sweep.kernels.layout import BLOCK, LANES, PACK, Table
from sweep.kernels.measures.measurement import Stretch
from sweep.kernels.method import Tolerance
from sweep.kernels.status import DIVERGED, RUNNING
from sweep.models.model import Array, Columns, Model, Offer, stack
from sweep.models.stiff.form import StiffForm, velocities
from sweep.models.stiff.modes import bending
from sweep.models.stiff.slip import form_of, has_form
from sweep.models.theory import linear
from sweep.models.theory.rocking import frequencies, implicit

_HISTORY = tuple(name.format(slot) for slot in range(HISTORY) for name in POINT)


# The error in spin at t = 400 is about n ρ θ⁶, within a factor of ten for most of 877 wide cells, where θ is the phase
# of the fastest motion in a step, ρ the share by which the rattle may raise the decay rate of the slip, and n the
# fastest spin within reach.  The growth of an error depends on the motion itself, and the run finds it
# (`sweep.engine.errors`).
_POWER = 6
_LONGEST_PHASE = 0.4


class Adams(Stepper):
    """The stepper of this method; its states contain M in place of ω.

    Where the rattle is so small that its linear modes describe it to within the kernel's tolerance in spin, these
    give its further course, without steps (`sweep.kernels.adams.skips`), if they are known (`Offer.MODES`).
    """

    def runs(self, model: Model) -> bool:
        return has_form(model)

    def steps_in(self, model: Model) -> Model:
        return form_of(model).model

    def accurate_step(self, model: Model, columns: Columns, motion: Array, decay: Array, tolerance: Tolerance) -> Array:
        form = form_of(model)
        reach, at_rest = linear.fastest_spin(form.full, columns) / model.spin_unit(columns), form.rest_decay(columns)
        rise = np.divide(decay, at_rest, out=np.full_like(decay, 2.0), where=at_rest > 0) - 1  # 2 without friction
        phase = (tolerance / np.maximum(rise * reach, tolerance)) ** (1 / _POWER)
        return np.asarray(np.minimum(phase, _LONGEST_PHASE) / np.maximum(motion, form.damping(columns)))

    def quantities(self, model: Model, *, work: bool) -> tuple[str, ...]:
        """Quantities for looks at small rattle, for the weights and the matrix P, and for the history."""
        looks = ("quiet_energy", "quiet_after", "bending", *skips.SCALES) if Offer.MODES in model.offers else ()
        powers = skips.POWERS if work else ()
        return (*looks, "begin", "spin", *powers, "gamma", "per_weight", *PREDICT, *CORRECT, *MATRIX, *_HISTORY)

    def prepare(self, kernel: Kernel, table: Table, columns: Columns, step: Array, t_end: float | Array) -> None:
        """Advance the rows to the end of start-up, at the time in `begin`."""
        form = form_of(kernel.model)
        levels = count_levels(form.slip_decay(columns), step)
        lead = duration(levels)
        steps = np.maximum(steps_to(t_end, step), lead + 1)
        table["steps"] = table["goal"] = steps - lead
        table["step"] = step = t_end / steps
        _set_method(form, table, kernel.unpack(table.rows)[1])
        constants = table.columns(kernel.constants)
        starts = stack(form.full.start(columns)).T
        self._set_started(kernel, table, *start_up.start_up(form, step, constants, starts, levels))
        if Offer.MODES in kernel.model.offers:
            _set_looks(kernel, table, columns)

    def prepared_by(self, model: Model) -> tuple[Cached, ...]:
        return (start_up.compiled_start_up(form_of(model)),)

    def model_states(self, model: Model, states: Array, constants) -> Array:
        return velocities(form_of(model).nonstiff, states, constants)

    def reached(self, table: Table, t_end: float | Array) -> Array:
        reached = table["begin"] + table["done"] * table["step"]
        return np.where(table["done"] == table["steps"], t_end, reached)

    def _set_started(self, kernel: Kernel, table: Table, ended: Table, history: Array) -> None:
        """Set the state after start-up, and make up for the looks and measurements that it skipped."""
        # Friction stops the initial slip at once; that changes the spin but not M.
        states = kernel.model.states
        table.set_columns(states[5:], np.zeros((len(history), 2)))
        before = kernel.steady_spin(table.rows)
        table.set_columns(states, ended.columns(states))
        table.set_columns(_HISTORY, history[:, :, :-1].reshape(len(history), -1))
        table["begin"], table["status"] = ended["ticks"] * ended["spacing"], ended["status"]
        if kernel.work:
            table.set_columns(skips.POWERS, history[:, :-4:-1, -1])
        spin, rattle, inertia = kernel.model.energy(*kernel.unpack(table.rows))
        energy = rattle + 0.5 * inertia * spin**2
        grown = energy > table["energy_start"] * (1 + self.energy_gain)
        table["status"] = np.where(grown, DIVERGED, table["status"])
        table["energy"], table["spin"] = energy, spin
        mean = (before + kernel.steady_spin(table.rows)) / 2
        stretch = Stretch(table["begin"], mean, spin, ended["work"], mode_energies=None)
        for each in kernel.measurements:
            each.skip(table, stretch)

    def between(self, kernel: Kernel, rows: Array) -> None:
        skips.skip(form_of(kernel.model), kernel, rows, kernel.tolerance)

    def body(self, kernel: Kernel):
        """As of `Stepper`.

        Each step appends a point to a history that begins with the eight points of the row.  So a single step
        is compiled, rather than one for each place in a ring of eight.  The history is not part of the group: LLVM then
        recognises that writes to one cannot affect reads from the other.
        """
        layout, size = kernel.layout, len(POINT) * LANES
        load_states, load_constants, _ = make_access(kernel.model, layout)
        load_points, append = make_history(size)
        load_weights = make_weights("group, lane", lambda name: f"group[{layout.at(name)} + lane]")
        advance, accept = make_advance(form_of(kernel.model)), make_accept(kernel.model, layout)
        work_done, watch, wide = _make_work(kernel), kernel.make_watch(), full_width()
        FIRST, BEGIN, STEP, GOAL = map(layout.at, (_HISTORY[0], "begin", "step", "goal"))
        DONE, STATUS, SPIN = map(layout.at, ("done", "status", "spin"))
        kept, block, pack, lanes = HISTORY * size, BLOCK * size, PACK, LANES

        @compiled
        def body(group, packs):
            wide()
            # If the bound were a product, LLVM would take lanes for possibly negative, and not vectorise the loop.
            last, history = lanes if packs > 1 else pack, np.empty(kept + block)
            for i in range(kept):
                history[i] = group[FIRST + i]
            for oldest in range(0, block, size):
                for lane in range(last):
                    y = load_states(group, lane)
                    p = load_constants(group, lane)
                    status, done, h = group[STATUS + lane], group[DONE + lane], group[STEP + lane]
                    active = (status == RUNNING) & (done < group[GOAL + lane])
                    points = load_points(history, oldest, lane)
                    w = load_weights(group, lane)
                    new, slopes, spin, (num, den), power = advance(y, points, w, p)
                    accepted = accept(
                        group, lane, status, active, y, new, (num > 0.0) & (den > 0.0), num <= 0.0, den <= 0.0
                    )
                    append(history, oldest + kept, lane, slopes + new[5:])
                    old = group[SPIN + lane]
                    group[DONE + lane] = done + (1.0 if accepted else 0.0)
                    group[SPIN + lane] = spin if accepted else old
                    work, now = work_done(group, lane, h, power), group[BEGIN + lane] + (done + 1.0) * h
                    watch(group, lane, accepted, y, p, old, work, h, now)
            for i in range(kept):
                group[FIRST + i] = history[block + i]

        return body


def _set_method(form: StiffForm, table: Table, constants) -> None:
    """Set the weights of the formulas and the matrix P."""
    step = table["step"]
    rocking = form.rocking(constants)
    _, fastest = frequencies(rocking)
    phase = fastest * step
    correct = step[:, None] * weights.fitted_weights(CORRECTOR_NODES, phase)
    table.set_columns(PREDICT, step[:, None] * weights.fitted_weights(PREDICTOR_NODES, phase))
    table.set_columns(CORRECT, correct)
    table.set_columns(MATRIX, stack(implicit(correct[:, 0], rocking)).T)
    table["per_weight"] = 1 / correct[:, 0]
    table["gamma"] = BDF_GAMMA * step


def _set_looks(kernel: Kernel, table: Table, columns: Columns) -> None:
    """Set the energy below which, and the step after which, looks search for something to skip."""
    model = kernel.model
    reach, goal = linear.fastest_spin(model, columns), table["goal"]
    tolerance = kernel.tolerance * model.spin_unit(columns)
    table["quiet_energy"] = skips.quiet_energy(reach)
    time = goal * table["step"]
    table["quiet_after"] = skips.first_look(model, columns, reach, time, goal, tolerance)
    table["bending"] = bending(model, columns)


def _make_work(kernel: Kernel):
    """Inline (group, lane, h, power) -> the work of friction in a step; 0 if no measurement needs it."""
    if not kernel.work:
        return nothing
    POWER0, POWER1, POWER2 = map(kernel.layout.at, skips.POWERS)

    @inline
    def work_done(group, lane, h, power):
        power1, power2, power3 = group[POWER0 + lane], group[POWER1 + lane], group[POWER2 + lane]
        group[POWER0 + lane], group[POWER1 + lane], group[POWER2 + lane] = power, power1, power2
        return work_of(h, power, power1, power2, power3)

    return work_done


METHOD = Adams(
    name="adams",
    code=1,
    summary="Adams formulas of orders eight and nine for the nonstiff variables and BDF5 for the slip, for the slip "
    "model: friction does not limit its step",
    automatic=True,
    # On one thread start-up takes 8 to 11 µs, and a step of dopri5 22 ns.
    step_cost=0.64,
    start_up_cost=650.0,
    compile_seconds=14.0,
    longer=1.2,
    error_order=4,
    least_error=0.03,
    # No stability limit is near, so the check may be loose; and at n = 0.05 an error in spin of 1e-4 is one of 4e-3
    # in the energy.  With 1e-5, runs with loose tolerances at μ = 10⁴ ended as `diverged`, although every spin was
    # right to the tolerance.
    energy_gain=1e-2,
    horizon=skips.WORTHWHILE,
)
