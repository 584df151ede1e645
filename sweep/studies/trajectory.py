"""Follows individual trajectories with dense output in time."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from math import inf
from typing import Any

import numpy as np
import xarray as xr

from sweep import units as u
from sweep.config import Config, ConfigLike, load_config, values_at
from sweep.config.cross_checks import misplaced, unfit
from sweep.config.document import is_number, plain_data
from sweep.config.schema import FOREVER
from sweep.engine import executor, over
from sweep.engine.cells import Cells
from sweep.engine.executor import UNTIL_ALL_STOP, nominal_seconds
from sweep.engine.life import live
from sweep.engine.lives import Lives, note
from sweep.engine.outcome import results
from sweep.engine.plan import plan, steps_of
from sweep.engine.reporter import Count, Reporter
from sweep.faults import duration, fault_of, refusal
from sweep.grid import Array, Grid
from sweep.interrupt import deferred
from sweep.kernels import path
from sweep.kernels.build import PATH
from sweep.kernels.kernel import Kernel
from sweep.kernels.layout import BLOCK
from sweep.kernels.methods import METHODS, PLAIN
from sweep.kernels.status import RUNNING, SETTLED, TIME_LIMIT
from sweep.models import attitude
from sweep.models.model import Columns, Model, take
from sweep.models.theory.linear import fastest_motion
from sweep.models.user.blame import blamed
from sweep.results import dataset
from sweep.results.kind import TRAJECTORY
from sweep.results.provenance import provenance
from sweep.studies.study import require_simulated
from sweep.units import Unit, named
from sweep.variables import Variable

SAMPLES_A_RADIAN = 3
"""Samples per radian of the fastest motion: nearly twenty per period."""

# The smallest number of blocks of steps between two marks of a run, and the largest number of marks, counting those of
# each trajectory. The first stretch of a click in the explorer takes 0.084 s of processor time, 0.099 s with 8 blocks
# and as long with 1.
_BLOCKS, _MARKS = 2, 2048

# Number of samples evaluated at a time. In the first stretch of a click few are taken, and evaluating them one by one
# took half of its processor time.
_TOGETHER = 4096

# Relative difference below which two times, or two steps, count as equal.
_SAME, _SAME_STEP = 1e-12, 1e-9

# Every step is taken once to reach the end, and again between the marks for the samples; a sample of the slip model
# took 2 µs on a Zen 5, all its series together.
_PASSES, _SAMPLE_SECONDS = 2, 2e-6

MAX_TRAJECTORIES = 1000
"""Most trajectories; every combination of the requested values is one."""

MAX_SAMPLES = 10_000_000
"""Most samples, all of which are held in memory, a kilobyte each while they are taken."""

# name: units, long_name, and perhaps a description
SERIES: dict[str, tuple[Unit, str] | tuple[Unit, str, str]] = {
    "spin": (u.SPIN, "spin n", "Spin about the upward normal."),
    "contact_x": (u.LENGTH, "contact point along x"),
    "contact_y": (u.LENGTH, "contact point along y"),
    "heading": (u.ANGLE, "heading", "Angle by which the body has turned about the upward normal."),
    "roll_angle": (u.ANGLE, "angle about the axis of a"),
    "pitch_angle": (u.ANGLE, "angle about the axis of b", "Angle about the axis of b, after roll."),
    "table_x": (u.LENGTH, "contact point on the table along x", "Contact point along x, towards heading zero."),
    "table_y": (u.LENGTH, "contact point on the table along y", "Contact point along y, to the left of x."),
    "slip_1": (u.SPEED, "slip velocity along x", "Slip velocity v_p along the body's x."),
    "slip_2": (u.SPEED, "slip velocity along y", "Slip velocity v_p along the body's y."),
    "slip_rate_1": (u.ACCELERATION, "acceleration of the slip along x", "Time derivative of v_p along x."),
    "slip_rate_2": (u.ACCELERATION, "acceleration of the slip along y", "Time derivative of v_p along y."),
    "v0_rate_1": (u.ACCELERATION, "acceleration of v_0 along x", "Time derivative of v_0 = x_p × omega along x."),
    "v0_rate_2": (u.ACCELERATION, "acceleration of v_0 along y", "Time derivative of v_0 = x_p × omega along y."),
    "normal_force": (u.ACCELERATION, "normal force R per mass"),
    "amplitude_1": (u.NUMBER, "amplitude A of the first mode", "Averaged amplitude of the first mode."),
    "amplitude_2": (u.NUMBER, "amplitude B of the second mode", "Averaged amplitude of the second mode."),
    "mode_1": (u.NUMBER, "normal coordinate X"),
    "mode_2": (u.NUMBER, "normal coordinate Y"),
}
"""The series that models show; those of measurements follow them."""

_VECTORS = (("contact_x", "contact_y"), ("slip_1", "slip_2"))


@deferred()
def trajectory(
    config: ConfigLike,
    *,
    at: Mapping[str, Any] | None = None,
    every: float | None = None,
    stop_early: bool = False,
    samples: int | None = None,
    reporter: Reporter | None = None,
) -> xr.Dataset:
    """Follow cells of `config`, as `sweep.trajectory`.

    The method is always dopri5, whatever the configuration names.  A sample is a state between two steps, but adams can
    continue only from the end of a block of steps, and skips intervals of small rattle.

    Parameters
    ----------
    config : as `sweep.config.load_config` takes it
    at, every, samples : as of `sweep.trajectory`
    stop_early : end a trajectory once spin and count can no longer change, as a sweep does. Otherwise it goes to
        t_end, whatever the configuration says; with `t_end: settled` it always stops once settled
    reporter : receives progress, counted in time, and messages; silent by default

    Returns
    -------
    Dataset over the cells, as of a run, and over time, as of `sweep.trajectory`. A sample between two steps is one
    shorter step away from the first of them.

    Raises
    ------
    InputError
        if the model is not simulated, `at` selects cells that cannot be run, or the samples do not fit into memory.
    """
    if every is not None and not (is_number(each := plain_data(every)) and 0 < each < inf):
        raise fault_of(refusal(every, "a finite number > 0"), "every")
    if not isinstance(stop_early, bool):
        raise fault_of(refusal(stop_early, "True or False"), "stop_early")
    chosen = choose(config, at, samples)
    stops = stop_early or chosen.integrator.t_end >= FOREVER
    chosen = replace(chosen, integrator=chosen.integrator.model_copy(update={"stop_early": stops}))
    with blamed(chosen.origin):
        return _followed(chosen, every, reporter or Reporter())


def _followed(chosen: Config, every: float | None, reporter: Reporter) -> xr.Dataset:
    """Return the trajectories of all cells of `chosen`, as `trajectory`."""
    job = plan(chosen, also=[PATH])
    (part,), (grid,) = job.parts, job.grids
    each, kernel, columns = Lives(part), part.kernel, grid.columns()
    rows = each.rows
    t_end, count = chosen.integrator.t_end, Count(reporter, named(u.TIME, chosen.units) or "of time")
    count.expect(len(rows) * t_end, len(rows) * t_end)

    def report() -> None:
        table = kernel.table(rows)
        covered = np.where(table["status"] == RUNNING, table["done"] / table["goal"], 1.0).sum() * t_end
        count.chunk(float(covered), 0)  # second runs begin at t = 0 again, which it leaves out

    marks = _run(part, rows, report)
    live([each], report)
    if (each.notes["step"] != part.step).any():
        again = each.started()
        kernel.table(again)["settles"] = part.rules.settles
        marks = _run(part, again)
    _judge(each)
    times = _times(kernel, rows, every or intervals(kernel.model, columns).min())
    series = _sample(kernel, marks, rows, times, kernel.model.turned(columns))
    (found,) = job.by_grid(results(job, [each]))
    made = provenance(chosen, time.perf_counter() - count.began, grid.size, of=TRAJECTORY)
    labelled = dataset.label(chosen, grid, found, made)
    return labelled.assign(_described(grid, times, series, kernel.model, chosen.units))


def _described(grid: Grid, times: Array, series: dict[str, Array], model: Model, system: str) -> xr.Dataset:
    """Return the series over the cells of `grid` and time, with their attributes, those of measurements last."""
    series = {name: values.reshape(*grid.shape, -1) for name, values in series.items()}
    rows = {**SERIES, **{name: each for name, *each in model.series}}
    specs = {name: Variable("float64", *row) for name, row in rows.items()} | dataset.SERIES
    time = xr.Variable("time", times, dataset.described(Variable("float64", u.TIME, "time t"), system))
    return xr.Dataset(dataset.variables(specs, (*grid.dims, "time"), series, system), {"time": time})


def estimate(config: ConfigLike, at: Mapping[str, Any] | None = None, samples: int | None = None) -> str:
    """Describe trajectories, steps, samples and time, a line each; parameters and errors as for `trajectory`."""
    chosen = choose(config, at, samples)
    columns, integrator = chosen.grid.columns(), chosen.integrator
    steps = integrator.t_end / steps_of(integrator.method, chosen, columns)[0]
    samples = (integrator.t_end / intervals(chosen.equations, columns)).sum()
    seconds = _PASSES * nominal_seconds(steps) + samples * _SAMPLE_SECONDS
    return (
        f"trajectories: {len(steps)}\n"
        f"steps:        at most {steps.sum():.3g}\n"
        f"samples:      at most {samples:.3g}\n"
        f"time:         at most about {duration(seconds)}"
    )


def choose(config: ConfigLike, at: Mapping[str, Any] | None = None, samples: int | None = None) -> Config:
    """Return `config` with the cells selected by `at`, and dopri5; raise an `InputError` if they cannot run.

    Uncertain parameters that `at` does not name take their median, or else each of the `samples`.
    """
    config = loaded = load_config(config, {} if samples is None else {"samples": samples})
    require_simulated(config)
    method = METHODS.get(config.integrator.method)
    # A fixed step meant for another method may be unstable with dopri5.
    other = {} if method and method.takes_every_step else {"method": PLAIN, "step": "auto"}
    config = replace(config, integrator=config.integrator.in_one_leg.model_copy(update=other))
    dataset.check_names(config, {**SERIES, **dataset.SERIES})
    wanted = values_at(config, {} if at is None else at)
    config = config if samples else config.at_medians
    left = {name: column for name, column in config.cases.items() if name not in wanted}
    parameters, drawn = config.parameters | wanted, config.samples if left else None
    chosen = replace(config, parameters=parameters, cases=left, samples=drawn)
    if (cells := chosen.grid.size) > MAX_TRAJECTORIES:
        raise fault_of(f"{cells} trajectories are too many; choose at most {MAX_TRAJECTORIES} cells", "at")
    for place, beyond in (("body",), unfit(chosen)), (("start", "x0"), misplaced(chosen)):
        if beyond:
            raise fault_of(beyond, "at") if at else loaded.error(place, beyond)
    return chosen


Marks = list[Array]
"""Copies of all state rows at some moments of a run, each of shape (trajectories, rows)."""


def _run(cells: Cells, rows: Array, after_chunk: Callable[[], None] = lambda: None) -> Marks:
    """Run `rows` to their ends, in place, and mark moments between which samples can be taken in parallel."""
    marks, kernel = [rows.copy()], cells.kernel

    def mark() -> None:
        marks.append(rows.copy())
        after_chunk()

    longest = kernel.table(rows)["goal"].max() / BLOCK
    blocks = max(_BLOCKS, int(np.ceil(longest * len(rows) / _MARKS)))
    executor.execute(kernel, rows, after_chunk=mark, chunk_blocks=blocks)
    table, ended = kernel.table(rows), replace(cells, rows=rows)
    early = over.too_early(ended, over.predicted(ended, at_limit=False))
    table["status"][early], table["settles"][early] = RUNNING, False
    executor.execute(kernel, rows, after_chunk=mark, chunk_blocks=blocks)
    return marks


def _judge(lives: Lives) -> None:
    """Give trajectories that reached their time limit the status `SETTLED` if a sweep would have ended them there."""
    checked, every = lives.take(), np.arange(len(lives.rows))
    table, at_end = checked.table, np.flatnonzero(checked.status == TIME_LIMIT)
    table["status"][at_end], table["settles"] = RUNNING, True
    checked.kernel.advance(checked.rows, at_end, 1)
    left = over.predicted(checked, at_limit=True)
    table["status"][over.too_early(checked, left)] = TIME_LIMIT
    final, _ = over.at_limit(checked, left)
    table["status"][final] = SETTLED
    lives.table["status"] = table["status"]
    note(lives.notes, "left", every, left)


def _times(kernel: Kernel, ends: Array, interval: float) -> Array:
    """Return the sample times of all trajectories, shape (times,): no denser than the steps, and including all ends."""
    last, densest = _last(kernel, ends), max(interval, kernel.table(ends)["step"].min())
    if len(ends) * last.max() > MAX_SAMPLES * densest:
        least = len(ends) * last.max() / MAX_SAMPLES
        raise fault_of(f"the samples are too many to be held in memory; give {least:.2g} or more", "every")
    times = np.union1d(np.arange(0, last.max(), densest), last)
    different = np.diff(times, prepend=-1) > _SAME * last.max()  # the same end, up to rounding, is not added
    return np.asarray(times[different])


def _last(kernel: Kernel, ends: Array) -> Array:
    """Return the time of the last state of each trajectory."""
    table = kernel.table(ends)
    return np.asarray(table["step"] * table["done"])


def _sample(kernel: Kernel, marks: Marks, ends: Array, times: Array, angles: Array) -> dict[str, Array]:
    """Return the series of all trajectories, each of shape (trajectories, times), NaN after the end of a trajectory.

    Each trajectory is stepped again from a mark, and stops at each sample before the next mark. The steps are those of
    the sweep, equal to the last bit. All stretches between two marks are stepped in parallel, on all threads.
    """
    which, at = np.nonzero(times <= _last(kernel, ends)[:, None] * (1 + _SAME))  # trajectory and time of each sample
    steps = np.floor(times[at] / kernel.table(ends)["step"][which] * (1 + _SAME)).astype(int)
    done = np.array([kernel.table(mark)["done"] for mark in marks])
    behind = [np.searchsorted(done[:, i], steps[which == i], "right") - 1 for i in range(len(ends))]
    mark = np.concatenate(behind)
    firsts = np.flatnonzero(np.diff(which * len(marks) + mark, prepend=-1))
    counts = np.diff(firsts, append=len(steps))
    stretches = np.array([marks[mark[i]][which[i]] for i in firsts])
    table, series = kernel.table(stretches), dict[str, Array]()
    table["settles"] = False
    states = np.empty((len(kernel.model.states), len(which)))

    def put(found: dict[str, Array], samples: Array) -> None:
        for name, values in found.items():
            if name not in series:
                series[name] = np.full((len(ends), len(times)), np.nan)
            series[name][which[samples], at[samples]] = values

    def look(samples: Array, rows: Array) -> None:
        _go_on(kernel, rows, times[at[samples]])
        states[:, samples] = kernel.states(rows)
        with np.errstate(over="ignore", invalid="ignore"):  # just before a trajectory diverges
            put(_series(kernel, rows, angles[which[samples]]), samples)

    waiting, most = list[tuple[Array, Array]](), counts.max()
    for i in range(most):
        active = np.flatnonzero(counts > i)
        samples = firsts[active] + i
        table["goal"][active], table["status"][active] = steps[samples], RUNNING
        kernel.advance(stretches, active, UNTIL_ALL_STOP)
        waiting.append((samples, stretches[active]))
        if i == most - 1 or sum(len(some) for some, _ in waiting) >= _TOGETHER:
            look(*map(np.concatenate, zip(*waiting, strict=True)))
            waiting.clear()
    if kernel.model.path:
        put(_motion(kernel, ends, states, which, times[at], angles[which]), np.arange(len(which)))
    return series


def _motion(kernel: Kernel, ends: Array, states: Array, which: Array, times: Array, angles: Array) -> dict[str, Array]:
    """Return attitude and path of all trajectories, at samples ordered by trajectory and time.

    Parameters
    ----------
    states : at the samples, shape (states, samples)
    which, times, angles : trajectory and time of each sample, and that of `Model.turned`, each of shape (samples,)
    """
    before = np.flatnonzero(which[1:] == which[:-1])
    constants, step = kernel.unpack(ends)[1], kernel.table(ends)["step"]
    cells, gains = which[before], np.zeros((3, len(which)))
    gains[:, before + 1] = path.stretches(
        kernel.model, states[:, before], take(constants, cells), times[before + 1] - times[before], step[cells]
    )
    u1, u2 = states[:2]
    first = np.flatnonzero(np.diff(which, prepend=-1))
    lead = attitude.lead(u1, u2, angles)

    def summed(gain: Array) -> Array:
        total = np.cumsum(gain)
        return np.asarray(total - total[first][which])

    heading = summed(gains[0]) - lead[first][which]
    cos, sin, (along, across) = np.cos(heading), np.sin(heading), gains[1:]
    cos_t, sin_t = np.cos(angles), np.sin(angles)
    roll, pitch = attitude.angles(u1 * cos_t + u2 * sin_t, u2 * cos_t - u1 * sin_t)
    return {
        "heading": heading + lead,
        "roll_angle": roll,
        "pitch_angle": pitch,
        "table_x": summed(cos * along - sin * across),
        "table_y": summed(sin * along + cos * across),
    }


def _go_on(kernel: Kernel, rows: Array, times: Array) -> None:
    """Advance `rows` between two steps to their `times`, in place, by one shorter step."""
    table = kernel.table(rows)
    rest = times - table["done"] * table["step"]
    between = np.flatnonzero(rest > _SAME_STEP * table["step"])
    table["step"][between], table["goal"][between] = rest[between], table["done"][between] + 1
    table["status"][between] = RUNNING
    kernel.advance(rows, between, UNTIL_ALL_STOP)


def _series(kernel: Kernel, rows: Array, angles: Array) -> dict[str, Array]:
    """Return the series at the samples `rows`, each of shape (samples,); `angles` are those of `Model.turned`."""
    model = kernel.model
    series = kernel.sampled(rows) | model.observe(*kernel.unpack(rows))
    for x, y in _VECTORS:
        if x in series and angles.any():
            along, across = series[x], series[y]
            series[x] = along * np.cos(angles) + across * np.sin(angles)
            series[y] = across * np.cos(angles) - along * np.sin(angles)
    return series


def intervals(model: Model, columns: Columns) -> Array:
    """Return the default time between samples, shape (trajectories,)."""
    return np.asarray(1 / (SAMPLES_A_RADIAN * np.maximum(fastest_motion(model, columns), 0.1)))
