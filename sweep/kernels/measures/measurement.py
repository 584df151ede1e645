"""Define what a measurement is, and explain how to add one.

Subclass `Measurement` in a file of its own in this folder, or `Kind` for what is found after the run alone.  The
configuration, the kernels of all methods, the dataset, trajectories and the plots then include it.  `energy_error` is a
short example.

A measurement keeps its numbers in quantities of its own in each state row, named by `quantities`.  It fills and reads
them in hooks, all of which are optional:

    start              once, when the rows are made
    make_step          for one lane after every step
    make_at_reversal   for one lane after every step, by way of the measurement `reversals`
    make_may_settle    for one lane at every check, before it is decided whether the trajectory ends
    make_settled       the same
    make_check         for one lane at every check, after that decision
    skip               for many rows, when they have covered a stretch without steps
    mode_lost          for many rows, when the scale of a mode is given up
    sample             for samples of trajectories, of which it shows a series
    read, doubts       once, when the trajectories have ended

A hook `make_…` is itself called once, when the kernel is made.  It returns None, or a function marked
`sweep.jit.inline`, which becomes part of the compiled loop and is called as listed.  That happens for every lane, even
one that is idle or has ended, so the function must not change the quantities where its arguments say that the step
does not count.  After a step it has to do so by conditional expressions rather than branches, so that the loop over
lanes stays vectorised.  A quantity of the lane is `group[layout.at("name") + lane]`, and so is a state of the model,
after the step (see `reads`).  In `skip`, `mode_lost`, `sample`, `read` and `doubts` a quantity is `table["name"]`, of
shape (cells,).

Whatever a run does not measure takes no space in its rows and adds no instruction to its kernel.

Units: times in sqrt(c/g), spins in sqrt(g/c), energies in m g c.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import FunctionType
from typing import ClassVar, NamedTuple

from sweep.faults import CompileError, suggestion
from sweep.kernels.layout import Layout, Table
from sweep.models.model import Array, Columns, Model, Offer
from sweep.models.slow.estimate import Ending
from sweep.units import Unit
from sweep.variables import Variable


def measured(
    dtype: str, units: Unit, long_name: str, description: str = "", *, along: tuple[str, ...] = ()
) -> Variable:
    """Describe a variable that a measurement adds to the dataset; it is undefined for a trajectory that failed."""
    return Variable(dtype, units, long_name, description, along=along, of_sound_runs=True)


class Step(NamedTuple):
    """A step of one lane, as passed to `Measurement.make_step`."""

    accepted: bool
    """Whether the step counts; if not, no quantity may change."""
    spin: float
    """Spin before the step."""
    steady: float
    """Ripple-free spin before the step (`theory.ripple`); the spin itself unless a measurement needs it (`ripple`)."""
    work: float
    """Work of friction in the step; may be zero unless a measurement needs it (`work`)."""
    h: float
    """Length of the step."""
    now: float
    """Time at the end of the step."""


class Check(NamedTuple):
    """The findings of a check at one lane, as passed to `Measurement.make_check`."""

    running: bool
    """Whether the trajectory was running before the check."""
    ended: bool
    """Whether it has ended at this check."""
    spin: float
    """Spin at the time of the check."""
    rattle: float
    """Energy of the rattle."""
    J: float
    """Moment of inertia of the spin."""
    total: float
    """Energy above rest, rattle + J spin²/2."""


@dataclass(frozen=True)
class Stretch:
    """A stretch of time that trajectories have covered without steps of the kernel; arrays of shape (cells,)."""

    time: Array
    """Length of the stretch."""
    mean_spin: Array
    """Ripple-free spin averaged over the stretch."""
    spin: Array
    """Spin at its end."""
    work: Array
    """Work of friction during the stretch: the energy that it has dissipated."""
    mode_energies: Array | None
    """Energies of the slower and the faster mode at its end, shape (cells, 2); None if the modes are not resolved."""


class Sample(NamedTuple):
    """Samples of trajectories, as passed to `Measurement.sample`; arrays of shape (samples,)."""

    spin: Array
    steady: Array
    """Ripple-free spin; the spin itself unless a measurement needs it (`ripple`)."""
    total: Array
    """Energy above rest."""


@dataclass(frozen=True)
class Kind:
    """Something that a configuration can ask for: what is found about a trajectory after its run."""

    name: ClassVar[str]
    """As in the configuration."""
    summary: ClassVar[str]
    """One line for the documentation."""
    asks: ClassVar[Offer]
    """What a model must offer for it."""
    needs: ClassVar[tuple[str, ...]] = ()
    """Names of the measurements on which it builds; a configuration has to include them too.  A measurement that
    implements `make_at_reversal` needs "reversals"."""
    by_default: ClassVar[bool] = False
    """Whether it is made by default, if the model supports it."""
    exact: ClassVar[bool] = True
    """Whether its values need all digits, so that `tolerance: auto` stands for 1e-8; counts and margins do not."""
    variables: ClassVar[Mapping[str, Variable]] = {}
    """The variables that it adds to the dataset, by name, each made by `measured`; `read` returns their values."""
    series: ClassVar[Mapping[str, Variable]] = {}
    """The series that it adds to a trajectory, by names other than those of variables; `Measurement.sample` returns
    their values."""
    reads: ClassVar[tuple[str, ...]] = ()
    """Names of the states of the model that its hooks read.  Models and methods that lack them cannot have it."""
    every_step: ClassVar[bool] = False
    """Whether a hook needs each step from t = 0: it is then run only by methods that take every step, and
    `skip` is never called."""
    final_when_settled: ClassVar[bool] = True
    """Whether its values are final once the spin can reverse no more.  If not, runs with it go on to `t_end`, unless
    the configuration sets `stop_early`; its values are then those at `t_stop`."""
    bounds: ClassVar[tuple[int, int] | None] = None
    """Smallest and largest value of its setting, an integer, which is then the only field of the class, a dataclass;
    None if it has no setting."""

    @property
    def spec(self) -> str:
        """Its name in a configuration, or "name=setting" if it has a setting."""
        return "=".join([self.name, *map(str, vars(self).values())])

    @property
    def cost(self) -> float:
        """Time of a run with it, relative to one without (`scripts/LOG.md`: `run_costs`); 1 if it hardly shows."""
        return 1.0

    def read(self, table: Table, times: Array, left: Ending) -> Mapping[str, Array]:
        """Return the values of the variables, by name, by default none.

        Each is of shape (cells,), or (cells, length) for a variable `along` a further dimension.

        Parameters
        ----------
        table : state rows of trajectories that have ended
        times : when they ended, shape (cells,)
        left : what is left to come of their spins, by the slow equations
        """
        return {}

    def doubts(self, table: Table) -> Array | int:
        """Bits of `sweep.kernels.status.Doubt`: what it has against the results of the trajectories, shape (cells,)."""
        return 0


@dataclass(frozen=True)
class Measurement(Kind):
    """What is measured in the kernel, while a trajectory runs."""

    work: ClassVar[bool] = False
    """Whether it needs the work of friction in each step, which is computed only on request."""
    ripple: ClassVar[bool] = False
    """Whether it needs the ripple-free spin in each step, likewise."""

    def __init_subclass__(cls) -> None:
        """Refuse a misspelt hook, which would never be called: functions of a measurement's own begin with "_"."""
        for name, value in vars(cls).items():
            if isinstance(value, FunctionType) and not name.startswith("_") and not hasattr(Measurement, name):
                code, hooks = value.__code__, [each for each in vars(Measurement) if not each.startswith("_")]
                reason = f"{cls.__name__}.{name} is not a hook{suggestion(name, hooks)}; one of its own begins with _"
                raise CompileError([(code.co_filename, code.co_firstlineno)], reason)

    @property
    def quantities(self) -> tuple[str, ...]:
        """Names of the quantities that it adds to a state row.  They start at zero, except those that `start` sets."""
        return ()

    def start(self, model: Model, columns: Columns, rattle: Array) -> Mapping[str, Array | float]:
        """Values of the quantities that do not start at zero, by name: of shape (cells,), or one number for all.

        Parameters
        ----------
        model : the model of the kernel
        columns : physical parameters by name, each of shape (cells,)
        rattle : energy of the rattle at t = 0, shape (cells,)
        """
        return {}

    def make_step(self, layout: Layout, at_reversal):
        """Inline (group, lane, taken) -> None, called after every step with its `Step`.

        `at_reversal` calls the hooks of all measurements for a reversal (see `make_at_reversal`).  It is
        meant for the measurement that detects reversals.
        """

    def make_at_reversal(self, layout: Layout):
        """Inline (group, lane, reverses, count, crossing) -> None, called after every step.

        `reverses` says whether a reversal was detected in this step; if not, no quantity may change.  `count` is the
        number of reversals so far, including this one, and `crossing` its time.
        """

    def make_may_settle(self, layout: Layout):
        """Inline (group, lane, spin, at_rest) -> bool: whether the measured values are final if the rattle only decays.

        A trajectory settles only if this holds for all measurements.  `at_rest` says that spin and rattle are
        exactly zero.
        """

    def make_settled(self, layout: Layout):
        """Inline (group, lane) -> bool: whether this measurement shows that the spin can reverse no more.

        A trajectory settles if this holds for one measurement, and the other hook for all.
        """

    def make_check(self, layout: Layout):
        """Inline (group, lane, seen) -> None, called at every check with its findings, a `Check`."""

    def skip(self, table: Table, stretch: Stretch) -> None:
        """Update `table` for a stretch that its rows have covered without steps: start-up or a skip.

        The other quantities of the rows are already those at the end of the stretch.
        """

    def mode_lost(self, table: Table, rows: Array) -> None:
        """Update `table` for a rescaled mode that grew too large before its factor was taken back, so that the factor
        is given up.

        `rows` is a mask over the rows of `table`, shape (cells,).
        """

    def sample(self, table: Table, seen: Sample) -> Mapping[str, Array]:
        """Return the values of the `series`, each of shape (samples,); by default the quantities of the same names."""
        return {name: table[name] for name in self.series}

    def read(self, table: Table, times: Array, left: Ending) -> Mapping[str, Array]:
        """As of `Kind`; by default the quantities of the same names."""
        return {name: table[name] for name in self.variables if name in self.quantities}
