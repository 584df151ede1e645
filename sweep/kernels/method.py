"""Define what an integration method is, and explain how to add one.

An explicit Runge-Kutta method is a record in `sweep.kernels.tableau`.  Any other is a `Method` record and a subclass of
`sweep.kernels.kernel.Stepper`, in a file of its own, like `runge_kutta`; enter the record in `METHODS` of
`sweep.kernels.methods`.  The configuration, the choice of the cheapest method, the provenance and the benchmark then
include it.  Times and steps are in sqrt(c/g), spins in sqrt(g/c).

A `Kernel` is a stepper with measurements.  The stepper names its `method` and its `model`, and implements

1. `quantities`, what the method adds to an image, such as weights or a history;
2. `images`, which makes images at t = 0 with the help of `Kernel.start`;
3. `make_run_block`, the compiled function (group) -> None that takes `BLOCK` steps of all lanes.  After every step of
   every lane it calls the inline function of `Kernel.make_watch`, for the measurements.

In the block a lane is active while its status is `RUNNING` and its `done` is below its `goal`.  An accepted step of
an active lane writes the states and adds one to `done`.  A step that fails leaves the states as they were and sets the
status to `PARADOX`, `LIFT_OFF` or `DIVERGED`.  Lanes that are not active compute as well, but have to keep their
states, `done` and status.

It overrides `filling` if `images` calls compiled functions, `reached` if its images do not begin at t = 0,
`model_states` if its states are not those of the model, and `carry` if it can cross stretches of small rattle without
steps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from sweep.kernels.kernel import Stepper
from sweep.models.model import Array, Columns, Model

TOLERANCE = 1e-8
"""Default tolerance: the error in spin at t = 400, in sqrt(g/c)."""

Tolerance = float | Array
"""One for all cells, or one for each, shape (cells,)."""

FIXED, ACCURACY, STABILITY, REPEAT = range(4)
STEP_RULES = {FIXED: "fixed", ACCURACY: "accuracy", STABILITY: "stability", REPEAT: "repeat"}
"""Names of the rules that determine a step: the configuration; the tolerance; the stability limit of the method; a
longer step failed or missed the tolerance; this step missed it too, but no shorter one was tried."""


@dataclass(frozen=True)
class Method:
    """The record of a method: how to make its kernel, how long its steps may be, and what they cost."""

    name: str
    """As in the configuration."""
    code: int
    """The number that stands for it in datasets; it must never change."""
    summary: str
    """One line for the documentation."""
    stepper: Callable[[Model, float], Stepper]
    """(model, tolerance) -> its stepper."""
    accurate_step: Callable[[Model, Columns, Array, Array, Tolerance], Array]
    """(model, columns, motion, decay, tolerance) -> the step that keeps the error in spin at t = 400 within the
    tolerance, shape (cells,), in sqrt(c/g), where `motion` is the `fastest_motion` and `decay` the `fastest_decay`."""
    stable_step: Callable[[Array], Array] | None = None
    """(decay) -> the longest stable step, shape (cells,), in sqrt(c/g); None if no limit is near."""
    step_words: str = ""
    """The limit of an automatic step besides the tolerance, in words for the provenance; "" if there is none."""
    runs: Callable[[Model], bool] = lambda model: True
    """(model) -> whether it can integrate this model; by default it can integrate all."""
    automatic: bool = False
    """Whether `method: auto` may choose it.  If so, it changes the numbers of all runs that name no method."""
    step_cost: float = 1.0
    """Time of a step of one lane, relative to dopri5 (measure it with `sweep bench`)."""
    start_up_cost: float = 0.0
    """Time of the start-up of one trajectory, in steps of this method."""
    compile_seconds: float = 6.0
    """Time to compile its kernel, for the estimate of a run (`scripts/LOG.md`: `run_costs`)."""
    companion: float = 1.5
    """Ratio of the steps of the companion run, which estimates a cell's error, to its own (`sweep.engine.errors`)."""
    error_order: int = 5
    """The power of the step with which that error is assumed to grow."""
    least_error: float = 0.0
    """Lower limit of that error, as a share of the geometric mean of the tolerance and the violation of the energy
    balance; 0 if that mean says nothing about it."""
    foresight: float = 0.0
    """Within this many steps of the time limit the method may take the remaining time into account.  A trajectory that
    has ended before does not depend on the limit."""
    takes_every_step: bool = False
    """Whether it takes equal, independent steps from t = 0 to the end: a run may then stop after any step and continue
    towards another goal."""
