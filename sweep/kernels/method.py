"""Define what an integration method is, and explain how to add one.

An explicit Runge-Kutta method is a record in `sweep.kernels.runge_kutta`.  Any other is a subclass of
`sweep.kernels.kernel.Stepper`, in a file of its own, like `runge_kutta`; enter an instance in `METHODS` of
`sweep.kernels.methods`.  The configuration, the choice of the cheapest method, the provenance and the benchmark then
include it.  Times and steps are in sqrt(c/g), spins in sqrt(g/c).

A `Kernel` is a stepper with a model and measurements.  The stepper says how long its steps may be and what they cost,
and implements

1. `quantities`, what the method adds to a state row, such as weights or a history;
2. `prepare`, which sets these and the steps in state rows at t = 0;
3. `body`, the compiled function (group, packs) that takes `BLOCK` steps.  After every step of every lane it calls the
   inline function of `Kernel.make_watch`, for the measurements.

In the body a lane is active while its status is `RUNNING` and its `done` is below its `goal`.  An accepted step of
an active lane writes the states and adds one to `done`.  A step that fails leaves the states as they were and sets the
status to `PARADOX`, `LIFT_OFF` or `DIVERGED`.  Lanes that are not active compute as well, but have to keep their
states, `done` and status.

It overrides `prepared_by` if `prepare` calls compiled functions, `reached` if its rows do not begin at t = 0,
`steps_in` and `model_states` if its states are not those of the model, and `between` if it can cross stretches of small
rattle without steps.
"""

from __future__ import annotations

from sweep.models.model import Array

TOLERANCE = 1e-8
"""Tolerance of whatever is not a count: the error in spin at t = 400, in sqrt(g/c)."""

COARSEST = 3e-6
"""The tolerance with which cells begin where counts decide how exact they are (`tolerance: auto`).

With 1e-6, 3e-6, 1e-5 and 3e-5, `configs/mu_b.yaml` takes 38, 32, 33 and 32 s of processor time; the first runs count
4, 8, 27 and 28 cells differently from a tolerance of 1e-8, and with 3e-5 two runs of one of them agree by chance. Skips
and rescaling stay exact to `TOLERANCE`: a coarser one for them saved nothing."""

Tolerance = float | Array
"""One for all cells, or one for each, shape (cells,)."""

FIXED, ACCURACY, STABILITY, REPEAT = range(4)
STEP_RULES = {FIXED: "fixed", ACCURACY: "accuracy", STABILITY: "stability", REPEAT: "repeat"}
"""Names of the rules that determine a step: the configuration; the tolerance; the stability limit of the method; a
longer step failed or missed the tolerance; this step missed it too, but no shorter one was tried."""
