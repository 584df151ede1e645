"""Define what the kernels of all methods share: many trajectories advance side by side, each to its own end.

Everything about a trajectory is in its *state row*, one row of a table: states, constants, step, progress and
measurements.  `advance` takes a table and a list of unfinished cells, and advances each cell by a number of
blocks of steps.  Nothing is kept outside the table, so writing it to disk makes a checkpoint.  Every row
evolves by itself, block after block, so the numbers cannot depend on which thread, group, lane or call
handled a cell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sweep.jit import Cached, inline, parallel, threads
from sweep.kernels.codegen import all_true, any_true, call_all, make_load
from sweep.kernels.lanes import make_advance, make_check
from sweep.kernels.layout import STABLE, Layout, Table, constants_of
from sweep.kernels.measures.measurement import Kind, Measurement, Sample, Step
from sweep.models.model import NO_RIPPLE, Array, Columns, Model, stack
from sweep.models.theory.stability import StableRanges

FAILURE = ("failed_at", "failed_spin", "failed_error")
"""Time of a failure, spin at that time, and its estimated error, which the engine finds (`sweep.engine.failures`); 0 if
there is none."""

_PROGRESS = ("steps", "goal", "settles", "done", "status")
"""The number of steps to t_end; the number after which the row stops; whether it stops (not zero) as soon as its spin
can reverse no more; the number of steps done; and the status."""

_BASE = ("step", "decay", *_PROGRESS, "energy_start", "energy", *FAILURE, *STABLE)
"""Quantities of every state row."""

STABILITY_SHARE = 0.9
"""Share of the stability limit that an automatic step uses for the fastest decay."""

STRETCH = 100.0
"""A step divides this time evenly if t_end is a multiple of it, in sqrt(c/g).  So its length does not depend on t_end:
a run to a later time takes the same steps."""


def steps_to(t_end: float | Array, step: Array) -> Array:
    """The least number of equal steps that lead to `t_end`, with lengths that are at most `step`, shape (cells,)."""
    stretch = np.where(np.mod(t_end, STRETCH) == 0, STRETCH, t_end)
    return np.asarray(np.ceil(stretch / step) * (t_end / stretch))


@dataclass(frozen=True, kw_only=True)
class Stepper:
    """Base of the methods: how to begin, step and go on without steps; how long steps may be, and what they cost.

    `sweep.kernels.method` explains how to add one.
    """

    name: str
    """As in the configuration."""
    code: int
    """The number that stands for it in datasets; it must never change."""
    summary: str
    """One line for the documentation."""
    step_words: str = ""
    """The limit of an automatic step besides the tolerance, in words for the provenance; "" if there is none."""
    automatic: bool = False
    """Whether `method: auto` may choose it.  If so, it changes the numbers of all runs that name no method."""
    step_cost: float = 1.0
    """Time of a step of one lane, relative to dopri5 (measure it with `sweep bench`)."""
    start_up_cost: float = 0.0
    """Time of the start-up of one trajectory, in steps of this method."""
    compile_seconds: float = 6.0
    """Time to compile its kernel, for the estimate of a run (`scripts/LOG.md`: `run_costs`)."""
    longer: float = 1.5
    """Ratio of the steps of a second run, which estimates a cell's error, to those of the first
    (`sweep.engine.errors`)."""
    error_order: int = 5
    """The power of the step with which that error is assumed to grow."""
    least_error: float = 0.0
    """Lower limit of that error, as a share of the geometric mean of the tolerance and the violation of the energy
    balance; 0 if that mean says nothing about it."""
    horizon: float = 0.0
    """Within this many steps of the time limit the method may take the remaining time into account.  A trajectory that
    has ended before does not depend on the limit."""
    takes_every_step: bool = False
    """Whether it takes equal, independent steps from t = 0 to the end: a run may then stop after any step and continue
    towards another goal."""
    real_stability: float = np.inf
    """The longest stable step times the rate of the fastest decay; infinite if stability never limits the step."""
    energy_gain: float = 1e-5
    """Share by which the energy of a body may seem to grow from one check to the next, although friction only removes
    energy: beyond it the integration has gone wrong.  Over 40 bodies at 0.3 to 2 times the stability limit, 1e-5
    (together with the check of failures) caught every spin that was off by more than 1e-4, and none that was right to
    1e-6."""

    def runs(self, model: Model) -> bool:
        """Return whether it can integrate a model; by default it can integrate all."""
        return True

    def steps_in(self, model: Model) -> Model:
        """Return a model in the variables in which it steps."""
        return model

    def makes(self, kind: Kind, model: Model) -> bool:
        """Return whether a measurement can be made in its steps, in a model that it runs."""
        return (self.takes_every_step or not kind.every_step) and {*kind.reads} <= {*self.steps_in(model).states}

    def accurate_step(
        self, model: Model, columns: Columns, motion: Array, decay: Array, tolerance: float | Array
    ) -> Array:
        """Return the step that keeps the error in spin at t = 400 within the tolerance, shape (cells,), in sqrt(c/g).

        Parameters
        ----------
        motion, decay : the `fastest_motion` and the `fastest_decay`, shape (cells,)
        tolerance : for all, or for each, shape (cells,)
        """
        raise NotImplementedError

    def stable_step(self, decay: Array) -> Array:
        """Return the longest automatic step that is stable, shape (cells,), in sqrt(c/g)."""
        return np.asarray(STABILITY_SHARE * self.real_stability / decay)

    def quantities(self, model: Model, *, work: bool) -> tuple[str, ...]:
        """Return the names of the quantities that it adds to a state row; `work` as of `Kernel`."""
        return ()

    def prepare(self, kernel: Kernel, table: Table, columns: Columns, step: Array, t_end: float | Array) -> None:
        """Set the number and length of the steps, and what the method adds, in state rows at t = 0.

        Parameters
        ----------
        table : the rows, with all other quantities
        columns, step, t_end : as of `Kernel.start`
        """
        raise NotImplementedError

    def prepared_by(self, model: Model) -> tuple[Cached, ...]:
        """Return the compiled functions that `prepare` calls."""
        return ()

    def body(self, kernel: Kernel):
        """Make the compiled function (group, packs) that takes `BLOCK` steps of the lanes of the first packs."""
        raise NotImplementedError

    def between(self, kernel: Kernel, rows: Array) -> None:
        """Advance the rows that are `QUIET` to where steps are needed again.  By default no row is ever quiet."""

    def reached(self, table: Table, t_end: float | Array) -> Array:
        """Return the times of the states, shape (cells,)."""
        return np.asarray(table["done"] * t_end / table["steps"])

    def model_states(self, model: Model, states: Array, constants: Any) -> Array:
        """Return the states as the right-hand side of the model takes them, shape (states, cells)."""
        return states


class Kernel:
    """Combine a model, its measurements and a stepper: the layout of the state rows, and the compiled loop.

    Attributes
    ----------
    full, model : the model in its own variables, and in those in which the method steps
    measure : the specs of the `kinds` of what is measured or found, of which the `measurements` are part of the kernel
    work, ripple : whether a measurement needs the work of friction, or the ripple-free spin, in each step
    constants : names of the quantities that hold the constants of the model
    advancing : the compiled function behind `advance`
    """

    def __init__(self, stepper: Stepper, model: Model, kinds: Sequence[Kind], tolerance: float) -> None:
        self.stepper, self.full, self.model, self.kinds = stepper, model, stepper.steps_in(model), tuple(kinds)
        self.measurements = tuple(each for each in kinds if isinstance(each, Measurement))
        self.tolerance, self.method, self.measure = tolerance, stepper.name, tuple(each.spec for each in kinds)
        self.work, self.ripple = (any(getattr(each, name) for each in self.measurements) for name in ("work", "ripple"))
        self.constants = constants_of(self.model)
        self._ripple = self.model.ripple if self.ripple else NO_RIPPLE
        self._ripples = tuple(f"ripple.{name}" for name in self._ripple.names)
        measured = (name for each in self.measurements for name in each.quantities)
        more = stepper.quantities(self.model, work=self.work)
        self.layout = Layout(
            (*self.model.states, *self.constants, *_BASE, *self._ripples, *measured, *more), self.model
        )
        self.advancing = self._make_advancing()

    def _make_advancing(self) -> Cached:
        may_settle = all_true("may_settle", "group, lane, spin, at_rest", self.hooks("make_may_settle"))
        shown = any_true("shown", "group, lane", self.hooks("make_settled"))
        measure = call_all("measure", "group, lane, seen", self.hooks("make_check"))
        gain, stability = self.stepper.energy_gain, self.stepper.real_stability
        check = make_check(self.model, self.layout, may_settle, shown, measure, gain, stability)
        advance = make_advance(self.stepper.body(self), check, self.layout)
        measured = "+".join(each.spec for each in self.measurements)
        name = f"{self.model.key}-{self.method}-{measured}"
        return parallel(advance, "(f8[:, ::1], i8[::1], i8, i8, i8, i8[::1])", name)

    def make_watch(self):
        """Inline (group, lane, accepted, y, p, spin, work, h, now): what all measurements do after a step.

        y, p, spin : states, constants and spin before the step; the others as in `Step`
        """
        at_reversal = call_all("at_reversal", "group, lane, reverses, count, crossing", self.hooks("make_at_reversal"))
        measure = call_all("measure", "group, lane, taken", self.hooks("make_step", at_reversal))
        load, ripple = make_load(self._ripples, self.layout), self._ripple.value

        @inline
        def watch(group, lane, accepted, y, p, spin, work, h, now):
            steady = spin - ripple(y, p, load(group, lane))
            measure(group, lane, Step(accepted, spin, steady, work, h, now))

        return watch

    def hooks(self, make: str, *more) -> list[Any]:
        """The functions that a hook of `Measurement` returns; `more` are its arguments besides the layout."""
        return [hook for each in self.measurements if (hook := getattr(each, make)(self.layout, *more))]

    def table(self, rows: Array) -> Table:
        """Return `rows`, accessed by the names of their quantities."""
        return Table(rows, self.layout)

    def start(self, columns: Columns, step: Array, t_end: float | Array, stable: StableRanges | None = None) -> Array:
        """Return the state rows of trajectories at t = 0, shape (cells, quantities).

        Parameters
        ----------
        columns : physical parameters by name, each of shape (cells,)
        step : the longest step wanted, in sqrt(c/g), shape (cells,)
        t_end : time limit in sqrt(c/g), a number or of shape (cells,)
        stable : the ranges of spin in which the rattle decays; by default none are known
        """
        return self.begin(self.initial(columns, stable), columns, step, t_end)

    def initial(self, columns: Columns, stable: StableRanges | None = None) -> Array:
        """Return the state rows of trajectories at t = 0 that have no steps yet; parameters as of `start`."""
        cells = len(next(iter(columns.values())))
        table = self.table(np.zeros((cells, len(self.layout.names))))
        if not cells:
            return table.rows
        states, constants = stack(self.model.start(columns)), self.model.constants.of(columns)
        table.set_columns(self.model.states, states.T)
        table.set_columns(self.constants, stack(constants).T)
        spin, rattle, inertia = self.model.energy(states, constants)
        table["energy_start"] = table["energy"] = rattle + 0.5 * inertia * spin**2
        table.set_columns(STABLE, np.nan if stable is None else np.stack(stable, axis=1))
        if self._ripples:
            table.set_columns(self._ripples, stack(self.model.ripple.of(columns)).T)
        for each in self.measurements:
            for name, values in each.start(self.model, columns, rattle).items():
                table[name] = values
        if np.isfinite(self.stepper.real_stability):
            table["decay"] = self.model.fastest_decay(columns)
        return table.rows

    def begin(self, initial: Array, columns: Columns, step: Array, t_end: float | Array) -> Array:
        """Return a copy of state rows that `initial` made, ready for the first step; parameters as of `start`."""
        table = self.table(initial.copy())
        if len(initial):
            with np.errstate(invalid="ignore"):  # a cell may fail during the start-up of a method
                self.stepper.prepare(self, table, columns, step, t_end)
        return table.rows

    def advance(self, rows: Array, cells: Array, blocks: int, least: int | None = None) -> int:
        """Advance the trajectories `cells` (indices of `rows`), in place.

        Parameters
        ----------
        blocks : number of blocks of steps in every lane, after which to stop
        least : number of blocks after which to stop where lanes are idle; by default only when all cells have ended

        Returns
        -------
        The total number of blocks that the groups of lanes have taken.
        """
        done = np.zeros(threads(), np.int64)
        self.advancing(rows, cells, blocks, blocks if least is None else least, len(done), done)
        return int(done.sum())

    def states(self, rows: Array) -> Array:
        """Return the states, shape (states, cells)."""
        return rows[:, : len(self.model.states)].T

    def unpack(self, rows: Array) -> tuple[Array, Any]:
        """Return the states, shape (states, cells), and the constants by name, each of shape (cells,)."""
        table = self.table(rows)
        return self.states(rows), self.model.constants(*(table[name] for name in self.constants))

    def sampled(self, rows: Array) -> dict[str, Array]:
        """Return the spin and the series of the measurements, by name, each of shape (cells,)."""
        spin, rattle, inertia = self.model.energy(*self.unpack(rows))
        steady = self.steady_spin(rows) if self.ripple else spin
        seen, found = Sample(spin, steady, rattle + 0.5 * inertia * spin**2), {"spin": spin}
        for each in self.measurements:
            found |= each.sample(self.table(rows), seen)
        return found

    def steady_spin(self, rows: Array) -> Array:
        """Return the ripple-free spin of the rows, shape (cells,); the spin itself if no measurement needs that."""
        table, (states, constants) = self.table(rows), self.unpack(rows)
        spin, _, _ = self.model.energy(states, constants)
        return np.asarray(spin - self._ripple.value(states, constants, [table[name] for name in self._ripples]))

    def model_states(self, rows: Array) -> Array:
        """Return the states as the right-hand side of the model takes them, shape (states, cells)."""
        return self.stepper.model_states(self.model, *self.unpack(rows))

    def spins(self, rows: Array) -> Array:
        """Return the spins with which the rows have ended, shape (cells,)."""
        table = self.table(rows)
        with np.errstate(invalid="ignore", over="ignore"):  # the states of a run that failed
            spin, _, _ = self.model.energy(*self.unpack(rows))
        return np.where(table["failed_at"] > 0, table["failed_spin"], spin)

    def times(self, rows: Array, t_end: float | Array) -> Array:
        """Return the times at which the rows have ended, in sqrt(c/g), shape (cells,)."""
        table = self.table(rows)
        return np.where(table["failed_at"] > 0, table["failed_at"], self.stepper.reached(table, t_end))
