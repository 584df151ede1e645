"""The spin n_c2 from which a trajectory reverses, by simulation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from sweep.config import Config
from sweep.engine.executor import STEP_SECONDS
from sweep.engine.plan import kernel_of
from sweep.grid import Array
from sweep.jit import threads
from sweep.kernels import methods
from sweep.kernels.build import build
from sweep.kernels.methods import AUTO, METHODS, allowed
from sweep.kernels.status import RUNNING, SETTLED, TIME_LIMIT
from sweep.models.model import Columns
from sweep.models.theory import linear
from sweep.models.theory.stability import SPIN_LIMIT
from sweep.studies.bracket import FAILED, HAPPENS, NOT_YET, UNDECIDED, Bracket, Question, search
from sweep.studies.rounds import Batch, Rounds, Simulations

# The search ends at this multiple of n_c1.  The paper's n_c2 is 2 n_c1; over 200 bodies (a = 1.5 … 50, |δ| <= 0.5,
# μ = 0.1 … 5000) it was found at up to 7.7 n_c1, with a median of 2.01.  Beyond, fast spins take long to simulate, and
# the body topples or leaves the plane instead: of 40 bodies searched up to a spin of 10, none reversed there.
_FARTHEST = 8.0

# Spins of the way outwards are simulated with this error in spin at t = 400, relative to the start spin, or with the
# tolerance of the configuration if that is larger, and with the cheapest method.  Most of them are far from n_c2, and
# where a body is nearly round they take most of the time: 33 s of 41 for 64 bodies with a = 10, b = 1.2 … 9.8.
_COARSE = 1e-4


USUAL = 9
"""Simulations that a search usually takes."""

# The same where none reverses up to the end of the search.
_MOST = 11

# How long they last, in decay times of the rattle at rest: the median of 2305 with a = 10, b = 1.2 … 9.8, μ = 20 … 200
# is 7, and half of them lie between 4 and 13.
_USUAL_TIME = 10.0


def find_n_c2(
    config: Config,
    bodies: Columns,
    n_c1: Array,
    stable: Array,
    width: float,
    rounds: Rounds,
    settled: Callable[[Array], None] = lambda share: None,  # noqa: ARG005
) -> Bracket:
    """The first |spin|, outwards from `n_c1`, from which the trajectory from the start point in `bodies` reverses.

    A trajectory that does not reverse ends at a spin that falls to zero where n_c2 is reached: that is the margin of
    its start spin.

    Parameters
    ----------
    bodies : parameters, each of shape (cells,)
    n_c1 : spin to begin at; its sign is that of all spins, shape (cells,)
    stable : ranges of spin in which the rattle decays, shape (6, cells), as `Kernel.images` takes them
    rounds : run or recall the simulations
    settled : as of `bracket.search`
    """

    def ask(question: Question) -> tuple[Array, Array]:
        at, sign = question.search, np.sign(n_c1[question.search])
        columns = {name: values[at] for name, values in bodies.items()} | {"n0": sign * question.size}
        finest = config.integrator.tolerance
        tolerance = np.where(question.exact, finest, np.maximum(finest, _COARSE * question.size))
        share = _shared_out(config, columns, question.exact, tolerance)

        def start() -> Batch:
            batch = {}
            for method, cells in share.items():
                theirs = {name: values[cells] for name, values in columns.items()}
                batch[method] = _start(config, method, theirs, stable[:, at[cells]], tolerance[cells])
            return batch

        def read(batch: Batch) -> dict[str, Array]:
            outcomes, ends = np.empty(len(sign), int), np.empty(len(sign))
            for method, cells in share.items():
                outcomes[cells], ends[cells] = _outcomes(batch[method])
            return {"outcomes": outcomes, "margins": np.where(outcomes == NOT_YET, sign * ends, np.nan)}

        answers = rounds.answer(start, read, _end_reversed)
        return answers["outcomes"], answers["margins"]

    size = np.abs(n_c1)
    farthest = np.minimum(_FARTHEST * size, SPIN_LIMIT * config.equations.spin_unit(bodies))
    return search(ask, size, farthest, width, settled)


def _shared_out(config: Config, columns: Columns, exact: Array, tolerance: Any) -> dict[str, Array]:
    """Indices of the simulations that each method runs: the cheapest, or where `exact` that of the configuration."""
    integrator = config.integrator
    chosen, *_ = methods.cheapest(config.equations, columns, tolerance, integrator.t_end)
    if integrator.method != AUTO:
        chosen = np.where(exact | (integrator.step != "auto"), integrator.method, chosen)
    return {method: np.flatnonzero(chosen == method) for method in METHODS if method in chosen}


def _start(config: Config, method: str, columns: Columns, stable: Array, tolerance: Array) -> Simulations:
    """Trajectories at t = 0."""
    # With the measurements of the configuration, so that a kernel compiled for its run serves here too.
    kernel = kernel_of(method, config if "reversals" in config.measure else replace(config, measure=("reversals",)))
    build([kernel])
    step = _steps(config, method, columns, tolerance)
    return Simulations(kernel, kernel.images(columns, step, config.integrator.t_end, stable))


def _steps(config: Config, method: str, columns: Columns, tolerance: Any) -> Array:
    """The step of each simulation; one tolerance for all, or one for each."""
    if config.integrator.step != "auto":
        return np.full(len(columns["n0"]), config.integrator.step)
    return methods.automatic_step(method, config.equations, columns, tolerance)[0]


def body_seconds(config: Config, bodies: Columns) -> tuple[float, float]:
    """Rough time to find n_c2 of both signs for a body like these, one of many: as a rule, and at most."""
    model, integrator = config.equations, config.integrator
    possible = ~model.impossible(bodies)
    bodies = {name: values[possible] for name, values in bodies.items()}
    decay = -linear.growth_rate(model, model.constants.of(bodies), np.zeros(len(bodies["a"])))
    bodies, decay = {name: values[decay > 0] for name, values in bodies.items()}, decay[decay > 0]
    if not len(decay):
        return 0.0, 0.0

    def seconds(spin: Array, time: Array | float, simulations: int) -> float:
        columns, costs = bodies | {"n0": spin}, list[Array]()
        for method in allowed(model) if integrator.method == AUTO else (integrator.method,):
            step = _steps(config, method, columns, integrator.tolerance)
            costs.append(METHODS[method].step_cost * (time / step + METHODS[method].start_up_cost))
        a_step = STEP_SECONDS / threads()
        return float(2 * simulations * np.min(costs, axis=0).mean()) * a_step

    # n_c1 is about the decay rate at rest.
    usual = seconds(2 * decay, np.minimum(_USUAL_TIME / decay, integrator.t_end), USUAL)
    return usual, seconds(_FARTHEST * decay, integrator.t_end, _MOST)


def _outcomes(ended: Simulations) -> tuple[Array, Array]:
    """Read what simulations tell of their start spins, and the last ripple-free spins, both of shape (simulations,)."""
    table = ended.kernel.table(ended.images)
    known = [table["reversals"] > 0, table["status"] == SETTLED, table["status"] == TIME_LIMIT]
    with np.errstate(invalid="ignore"):  # the states of a run that failed
        return np.select(known, [HAPPENS, NOT_YET, UNDECIDED], FAILED), ended.kernel.steady_spin(ended.images)


def _end_reversed(running: Simulations) -> None:
    """End the trajectories that have reversed: what they do later is of no account."""
    table = running.kernel.table(running.images)
    table["status"] = np.where((table["status"] == RUNNING) & (table["reversals"] > 0), SETTLED, table["status"])
