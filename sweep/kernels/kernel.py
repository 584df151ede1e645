"""Define what the kernels of all methods share: many trajectories advance side by side, each to its own end.

The whole state of a trajectory is its *image*, one row of a table: states, constants, step, progress and
measurements.  `advance` takes a table and a list of unfinished cells, and advances each cell by a number of
blocks of steps.  Nothing is kept outside the table, so writing it to disk makes a checkpoint.  Every image
evolves by itself, block after block, so the numbers cannot depend on which thread, group, lane or call
handled a cell.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from sweep.jit import Cached, inline, parallel, threads
from sweep.kernels.codegen import all_true, any_true, call_all, make_load
from sweep.kernels.lanes import make_advance, make_look
from sweep.kernels.layout import STABLE, Layout, Table, constants_of
from sweep.kernels.measures.measurement import RIPPLE, Measurement, Step
from sweep.models.model import NO_RIPPLE, Array, Columns, Model, stack

FAILURE = ("failed_at", "failed_spin", "failed_error")
"""Time of a failure, spin at that time, and its estimated error, which the engine finds (`sweep.engine.failures`); 0 if
there is none."""

_PROGRESS = ("steps", "goal", "settles", "done", "status")
"""The number of steps to t_end; the number after which the image stops; whether it stops (not zero) as soon as its spin
can reverse no more; the number of steps done; and the status."""

_BASE = ("step", "stable_step", *_PROGRESS, "energy_start", "energy", *FAILURE, *STABLE)
"""Quantities of every image."""

STRETCH = 100.0
"""A step divides this time evenly if t_end is a multiple of it, in sqrt(c/g).  So its length does not depend on t_end:
a run to a later time takes the same steps."""


def steps_to(t_end: float | Array, step: Array) -> Array:
    """The least number of equal steps that lead to `t_end`, with lengths that are at most `step`, shape (cells,)."""
    stretch = np.where(np.mod(t_end, STRETCH) == 0, STRETCH, t_end)
    return np.asarray(np.ceil(stretch / step) * (t_end / stretch))


class Stepper:
    """Base of the classes that take the steps, one for each method (see `sweep.kernels.method`)."""

    method: str
    """Its name in `METHODS`."""
    model: Model
    """The model in the variables in which it steps."""

    # Friction only removes energy.  If a body gains more than this share from one look to the next, the
    # integration has gone wrong.  Over 40 bodies at 0.3 to 2 times the stability limit, 1e-5 (together with the
    # check of failures at a look) caught every spin that was off by more than 1e-4, and none that was right
    # to 1e-6.
    energy_gain = 1e-5

    def quantities(self, follows: frozenset[str]) -> tuple[str, ...]:
        """Names of the quantities that it adds to an image if the measurements require `follows`."""
        return ()

    def make_run_block(self, kernel: Kernel):
        """Compiled (group) -> None: takes `BLOCK` steps of all lanes."""
        raise NotImplementedError

    def images(
        self, kernel: Kernel, columns: Columns, step: Array, t_end: float | Array, stable: Array | None
    ) -> Array:
        """The images of `Kernel.images`, made with the help of `Kernel.start`."""
        raise NotImplementedError

    def carry(self, kernel: Kernel, images: Array) -> None:
        """Advance the images that are `QUIET` to where steps are needed again.  By default no image is ever quiet."""

    def reached(self, table: Table, t_end: float | Array) -> Array:
        """Times of the states, shape (cells,)."""
        return np.asarray(table["done"] * t_end / table["steps"])

    def model_states(self, states: Array, constants: Any) -> Array:
        """The states as the right-hand side of the model takes them, shape (states, cells)."""
        return states

    def filling(self) -> tuple[Cached, ...]:
        """The compiled functions that `images` calls."""
        return ()


class Kernel:
    """Combine a model, its measurements and a stepper: the layout of the images, and the compiled loop around a block.

    Attributes
    ----------
    measure : the specs of the measurements
    follows : which of `WORK` and `RIPPLE` the measurements need in each step
    constants : names of the quantities that hold the constants of the model
    advancing : the compiled function behind `advance`
    """

    def __init__(self, stepper: Stepper, measurements: Sequence[Measurement]) -> None:
        self.stepper, self.model, self.measurements = stepper, stepper.model, tuple(measurements)
        self.method, self.measure = stepper.method, tuple(each.spec for each in measurements)
        self.follows = frozenset[str]().union(*(each.follows for each in measurements))
        self.constants = constants_of(self.model)
        self._ripple = self.model.ripple if RIPPLE in self.follows else NO_RIPPLE
        self._ripples = tuple(f"ripple.{name}" for name in self._ripple.names)
        measured = (name for each in measurements for name in each.quantities)
        more = stepper.quantities(self.follows)
        self.layout = Layout(
            (*self.model.states, *self.constants, *_BASE, *self._ripples, *measured, *more), self.model
        )
        self.advancing = self._make_advancing()

    def _make_advancing(self) -> Cached:
        may_settle = all_true("may_settle", "group, lane, spin, at_rest", self.hooks("make_may_settle"))
        shown = any_true("shown", "group, lane", self.hooks("make_settled"))
        measure = call_all("measure", "group, lane, seen", self.hooks("make_look"))
        look = make_look(self.model, self.layout, may_settle, shown, measure, self.stepper.energy_gain)
        advance = make_advance(self.stepper.make_run_block(self), look, self.layout)
        measured = "+".join(each.spec for each in self.measurements if each.in_kernel)
        name = f"{self.model.key}-{self.method}-{measured}"
        return parallel(advance, "(f8[:, ::1], i8[::1], i8, i8, i8, i8[::1])", name)

    def make_watch(self):
        """Inline (group, lane, accepted, y, p, spin, work, h, now): the work of all measurements after a step.

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

    def table(self, images: Array) -> Table:
        """`images`, accessed by the names of their quantities."""
        return Table(images, self.layout)

    def images(self, columns: Columns, step: Array, t_end: float | Array, stable: Array | None = None) -> Array:
        """Images of trajectories at t = 0, shape (cells, quantities).

        Parameters
        ----------
        columns : physical parameters by name, each of shape (cells,)
        step : the longest step wanted, in sqrt(c/g), shape (cells,)
        t_end : time limit in sqrt(c/g), a number or of shape (cells,)
        stable : lower and upper ends of the ranges of spin in which the rattle decays: about zero, the
            next range below, and the next above, and the share in `STABLE`; shape (7, cells).  NaN where there is none;
            by default there is none anywhere
        """
        return self.stepper.images(self, columns, step, t_end, stable)

    def start(
        self, columns: Columns, step: Array, goal: Array, stable_step: Array | bool, stable: Array | None
    ) -> Array:
        """Images at t = 0, with all quantities set that do not start at zero, except those of the method."""
        states, constants = stack(self.model.start(columns)), self.model.constants.of(columns)
        images = np.zeros((len(step), len(self.layout.names)))
        table = self.table(images)
        images[:, : len(states)] = states.T
        table.set_columns(self.constants, stack(constants).T)
        spin, rattle, inertia = self.model.energy(states, constants)
        table["steps"] = table["goal"] = goal
        table["stable_step"], table["step"] = stable_step, step
        table["energy_start"] = table["energy"] = rattle + 0.5 * inertia * spin**2
        table.set_columns(STABLE, np.nan if stable is None else stable.T)
        if self._ripples:
            table.set_columns(self._ripples, stack(self.model.ripple.of(columns)).T)
        for each in self.measurements:
            for name, values in each.start(self.model, columns, rattle).items():
                table[name] = values
        return images

    def advance(self, images: Array, cells: Array, blocks: int, least: int | None = None) -> int:
        """Advance the trajectories `cells` (indices into `images`), in place.

        Parameters
        ----------
        blocks : number of blocks of steps in every lane, after which to stop
        least : number of blocks after which to stop where lanes are idle; by default only when all cells have ended

        Returns
        -------
        The total number of blocks that the groups of lanes have taken.
        """
        done = np.zeros(threads(), np.int64)
        self.advancing(images, cells, blocks, blocks if least is None else least, len(done), done)
        return int(done.sum())

    def carry(self, images: Array) -> None:
        """Advance the images that are `QUIET` to where steps are needed again."""
        self.stepper.carry(self, images)

    def states(self, images: Array) -> Array:
        """The states, shape (states, cells)."""
        return images[:, : len(self.model.states)].T

    def unpack(self, images: Array) -> tuple[Array, Any]:
        """The states, shape (states, cells), and the constants by name, each of shape (cells,)."""
        table = self.table(images)
        return self.states(images), self.model.constants(*(table[name] for name in self.constants))

    def steady_spin(self, images: Array) -> Array:
        """The ripple-free spin of the images, shape (cells,); the spin itself if no measurement needs the former."""
        table, (states, constants) = self.table(images), self.unpack(images)
        spin, _, _ = self.model.energy(states, constants)
        return np.asarray(spin - self._ripple.value(states, constants, [table[name] for name in self._ripples]))

    def model_states(self, images: Array) -> Array:
        """The states as the right-hand side of the model takes them, shape (states, cells)."""
        return self.stepper.model_states(*self.unpack(images))

    def spins(self, images: Array) -> Array:
        """Spins with which the images have ended, shape (cells,)."""
        table = self.table(images)
        with np.errstate(invalid="ignore", over="ignore"):  # the states of a run that failed
            spin, _, _ = self.model.energy(*self.unpack(images))
        return np.where(table["failed_at"] > 0, table["failed_spin"], spin)

    def times(self, images: Array, t_end: float | Array) -> Array:
        """Times at which the images have ended, in sqrt(c/g), shape (cells,)."""
        table = self.table(images)
        return np.where(table["failed_at"] > 0, table["failed_at"], self.stepper.reached(table, t_end))
