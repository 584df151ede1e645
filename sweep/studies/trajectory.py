"""Single trajectories, sampled densely in time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from itertools import product
from math import prod
from typing import Any

import numpy as np
import xarray as xr

from sweep.config import Config, ConfigError, ConfigLike, Fault, load_config
from sweep.config.brought import explained
from sweep.config.faults import suggestion
from sweep.config.scenes import misplaced, unfit
from sweep.config.values import numbers_of
from sweep.engine import executor
from sweep.engine.executor import STEP_SECONDS
from sweep.engine.plan import plan
from sweep.engine.repeats import cells_of, repeat_all
from sweep.engine.reporter import Progress, Reporter
from sweep.grid import Array, Grid
from sweep.interrupt import deferred
from sweep.jit import threads
from sweep.kernels.kernel import Kernel
from sweep.kernels.layout import BLOCK, LANES
from sweep.kernels.methods import automatic_step
from sweep.kernels.status import RUNNING
from sweep.models.model import Columns, Model
from sweep.models.theory.linear import fastest_motion
from sweep.results import dataset
from sweep.results.provenance import provenance
from sweep.studies.rounds import Simulations
from sweep.studies.stepwise import stepwise
from sweep.variables import Variable

SAMPLES_A_RADIAN = 3
"""Samples per radian of the fastest motion: nearly twenty per period."""

# The fewest blocks of steps between two marks of a run, and the most marks, counting those of each trajectory.
_BLOCKS, _MARKS = 8, 2048

# Samples whose images are held at a time (about 100 MB).
_SAMPLES = 200_000

# Times that differ relatively by less than this are the same one.
_SAME = 1e-12

# Blocks of steps: as many as are needed.
_UNTIL_ALL_STOP = 2**40

MAX_TRAJECTORIES = 1000
"""Every combination of the values asked for is a trajectory, and all its samples are held in memory."""

_TIME = ("1", "time, in sqrt(c/g)")

# name: units, long_name
SERIES: dict[str, tuple[str, str]] = {
    "spin": ("1", "spin about the upward normal, in sqrt(g/c)"),
    "ripple_free_spin": ("1", "spin without the ripple of the rattle, in sqrt(g/c)"),
    "contact_x": ("1", "contact point along x, in c"),
    "contact_y": ("1", "contact point along y, in c"),
    "slip_1": ("1", "slip velocity v_p along the body's x, in sqrt(g c)"),
    "slip_2": ("1", "slip velocity v_p along the body's y, in sqrt(g c)"),
    "slip_rate_1": ("1", "time derivative of the slip velocity along x, in g"),
    "slip_rate_2": ("1", "time derivative of the slip velocity along y, in g"),
    "v0_rate_1": ("1", "time derivative of v_0 = x_p × omega along x, in g"),
    "v0_rate_2": ("1", "time derivative of v_0 = x_p × omega along y, in g"),
    "normal_force": ("1", "normal force R, in m g"),
    "amplitude_1": ("1", "averaged amplitude A of the first mode"),
    "amplitude_2": ("1", "averaged amplitude B of the second mode"),
    "mode_1": ("1", "normal coordinate X"),
    "mode_2": ("1", "normal coordinate Y"),
    "energy": ("1", "energy above rest, in m g c"),
    "dissipated": ("1", "work done against friction, in m g c"),
}

_VECTORS = (("contact_x", "contact_y"), ("slip_1", "slip_2"))


@deferred()
def trajectory(
    config: ConfigLike,
    *,
    every: float | None = None,
    reporter: Reporter | None = None,
    **at: Any,
) -> xr.Dataset:
    """Follow the cells of `config` picked by their parameters, such as ``mu=60, n0=[0.02, 0.05]``.

    The method is always dopri5, whatever the configuration names.  A sample is a state between two steps, and adams
    can go on only from the end of a block of steps, and leaps over stretches of small rattle.

    Parameters
    ----------
    config : as `sweep.config.load_config` takes it
    every : time between samples, in sqrt(c/g) or, with `units: SI`, in s, rounded to whole steps if all trajectories
        have the same; by default nearly twenty per period of the fastest motion
    reporter : receives progress, counted in time, and messages; by default there are none
    at : a number, or several as an axis of a configuration has them, by parameter; each combination is one
        trajectory.  An axis of `config` that is not named takes its first value

    Returns
    -------
    Dataset over (trajectory, time): the series that the model can show, NaN after the end of a trajectory.  Over
    (trajectory): all that a sweep gives for the cell, from the very same steps, which the sampling does not change.
    Samples of trajectories whose steps differ lie between steps: each is one shorter step away from the last one.

    Raises
    ------
    ConfigError
        if the model is a formula, or `at` picks cells that cannot be run.
    """
    chosen = choose(config, at)
    with explained(chosen.origin):
        return _followed(chosen, every, reporter or Reporter())


def _followed(chosen: Config, every: float | None, reporter: Reporter) -> xr.Dataset:
    """`trajectory` of all cells of `chosen`."""
    job = plan(chosen)
    (part,) = job.parts
    t_end, began = chosen.integrator.t_end, time.perf_counter()

    def report() -> None:
        covered = Simulations(part.kernel, part.images).advanced.sum() * t_end
        seconds = time.perf_counter() - began
        reporter.chunk(Progress(len(part.images) * t_end, float(covered), 0, 0, seconds))

    settles = chosen.integrator.stop_when_settled
    marks = _run(part.kernel, part.images, settles, report)
    repeat_all([job], {part.method: (part.kernel, part.images)}, report)
    halvings = part.kernel.table(part.images)["halvings"]
    if halvings.any():
        marks = _run(part.kernel, cells_of([job], part.method, part.kernel, part.images).start(halvings), settles)
    labelled = dataset.label(job.config, job.grid, job.results(), provenance(job.config, 0.0, job.grid.size))
    interval = np.full(job.grid.size, every) if every else _intervals(part.kernel.model, job.grid.columns())
    sampled, angles = _sample(part.kernel, marks, part.images, interval), part.kernel.model.turned(job.grid.columns())
    series = [_series(part.kernel, *found, angle) for found, angle in zip(sampled, angles, strict=True)]
    flat = labelled.reset_coords(drop=False).rename({"case": "trajectory"}).drop_vars("trajectory")
    index = ("trajectory", np.arange(job.grid.size), {"units": "1", "long_name": "number of the trajectory"})
    return flat.assign_coords(trajectory=index).assign(_side_by_side(series, part.kernel.model, chosen.units))


def _side_by_side(series: list[dict[str, Array]], model: Model, system: str) -> xr.Dataset:
    """The series of all trajectories over (trajectory, time), NaN after the end of each."""
    times = max((one["time"] for one in series), key=len)
    own = {name: (units, words) for name, units, words in model.series}
    known = {name: Variable("float64", *words) for name, words in {"time": _TIME, **SERIES, **own}.items()}
    found: dict[str, Any] = {"time": ("time", times, dataset.described(known["time"], system))}
    for name in filter({*SERIES, *own}.__contains__, series[0]):
        padded = np.full((len(series), len(times)), np.nan)
        for row, one in zip(padded, series, strict=True):
            row[: len(one[name])] = one[name]
        found[name] = (("trajectory", "time"), padded, dataset.described(known[name], system))
    return xr.Dataset(found)


def estimate(config: ConfigLike, at: Mapping[str, Any]) -> str:
    """Trajectories, steps, samples and time, a line each; parameters and errors as of `trajectory`."""
    chosen = choose(config, at)
    columns, integrator = Grid.of(chosen).columns(), chosen.integrator
    model, step = chosen.equations, integrator.step
    steps = np.full(Grid.of(chosen).size, integrator.t_end)
    steps /= automatic_step(integrator.method, model, columns, integrator.tolerance)[0] if step == "auto" else step
    samples = (integrator.t_end / _intervals(model, columns)).sum()
    # A step of a group of lanes takes as long whether they are idle or not.
    groups = -(-len(steps) // (LANES * threads()))
    seconds = groups * steps.max() * LANES * STEP_SECONDS
    return "\n".join(
        [
            f"trajectories: {len(steps)}",
            f"steps:        at most {steps.sum():.3g}",
            f"samples:      at most {samples:.3g}",
            f"time:         at most about {seconds:.3g} s, if all run to t_end; those that settle stop earlier",
        ]
    )


def choose(config: ConfigLike, at: Mapping[str, Any]) -> Config:
    """`config` with the cells picked by `at` as its cases, and with dopri5; `ConfigError` if they cannot be run."""
    config = stepwise(load_config(config))
    dataset.check_names(config, SERIES)
    wanted = _numbers(config, at)
    if (count := prod(map(len, wanted.values()))) > MAX_TRAJECTORIES:
        raise ConfigError([Fault("", None, None, (), f"{count} trajectories; allowed: at most {MAX_TRAJECTORIES}")])
    constants = {name: v.numbers[0] for name, v in config.parameters.items()}
    if config.cases is not None:
        constants |= {name: column[0] for name, column in config.cases.items()}
    cells = [dict(zip(wanted, values, strict=True)) for values in product(*wanted.values())]
    cases = {name: tuple(cell.get(name, constant) for cell in cells) for name, constant in constants.items()}
    chosen = replace(config, parameters={}, cases=cases)
    if beyond := unfit(chosen) or misplaced(chosen):
        raise ConfigError([Fault("", None, None, (), beyond)])
    return chosen


def _numbers(config: Config, at: Mapping[str, Any]) -> dict[str, tuple[float, ...]]:
    """The numbers asked for each parameter; `ConfigError` with a fault for each that cannot be run."""
    numbers, faults, model = {}, [], config.tier
    for name, value in at.items():
        if name not in model.parameters:
            message = f"no parameter of the {model.name} model{suggestion(name, model.parameters)}"
            faults.append(Fault("", None, None, (name,), f"{message}; allowed: {', '.join(model.parameters)}"))
            continue
        try:
            numbers[name] = numbers_of(config.table[name], value)
        except ConfigError as error:
            faults += error.faults
    if faults:
        raise ConfigError(faults)
    return numbers


Marks = list[Array]
"""Copies of all images at some moments of a run, each of shape (trajectories, rows)."""


def _run(
    kernel: Kernel, images: Array, stop_when_settled: bool, after_chunk: Callable[[], None] = lambda: None
) -> Marks:
    """Run `images` to their ends, in place, and mark moments between which samples can be taken side by side."""
    marks = [images.copy()]

    def mark() -> None:
        marks.append(images.copy())
        after_chunk()

    longest = kernel.table(images)["goal"].max() / BLOCK
    blocks = max(_BLOCKS, int(np.ceil(longest * len(images) / _MARKS)))
    executor.execute(kernel, images, stop_when_settled=stop_when_settled, after_chunk=mark, chunk_blocks=blocks)
    return marks


def _sample(kernel: Kernel, marks: Marks, ends: Array, intervals: Array) -> Iterator[tuple[Array, Array]]:
    """For each trajectory the sampled times, shape (samples,), and its images there.

    Each is stepped again from the mark before to the samples, and stops at each of them.  The steps are the sweep's
    own, and so equal to the last bit.  All stretches between two marks are stepped side by side, on all threads.
    """
    table, marked = kernel.table(ends), np.array([kernel.table(mark)["done"] for mark in marks])
    some: list[Array] = []
    times = _times(table["step"], table["done"], intervals)
    for i in range(len(ends)):
        some.append(times[i])
        if i + 1 == len(ends) or sum(map(len, some)) > _SAMPLES:
            first = i + 1 - len(some)
            steps = [_steps_before(each, table["step"][first + j]) for j, each in enumerate(some)]
            # Of each sample of these trajectories: its trajectory, and the last mark before it.
            which = np.repeat(np.arange(first, i + 1), [len(each) for each in some])
            before = [np.searchsorted(marked[:, first + j], each, "right") - 1 for j, each in enumerate(steps)]
            images = _advance(kernel, marks, which, np.concatenate(before), np.concatenate(steps))
            _go_on(kernel, images, np.concatenate(some))
            parts = np.split(images, np.cumsum([len(each) for each in some])[:-1])
            yield from zip(some, parts, strict=True)
            some = []


def _times(steps: Array, done: Array, intervals: Array) -> list[Array]:
    """The times at which each trajectory is sampled: the same ones for all, among them those at which one ends."""
    ends = steps * done
    interval = intervals.min()
    if np.ptp(steps) == 0:
        interval = max(1, round(interval / steps[0]))
        common = np.union1d(np.arange(0, done.max(), interval), done) * steps[0]
    else:
        common = np.union1d(np.arange(0, ends.max(), interval), ends)
        common = common[np.diff(common, prepend=-1) > _SAME * ends.max()]  # the same end, rounded in other ways
    return [common[common <= end * (1 + _SAME)] for end in ends]


def _steps_before(times: Array, step: float) -> Array:
    """How many whole steps end before, or at, each of these times."""
    return np.floor(times / step * (1 + _SAME)).astype(int)


def _go_on(kernel: Kernel, images: Array, times: Array) -> None:
    """Take `images`, of samples between two steps, on to their `times`, in place, by one shorter step."""
    table = kernel.table(images)
    rest = times - table["done"] * table["step"]
    between = rest > 1e-9 * table["step"]
    if between.any():
        step, goal = table["step"][between], table["goal"][between]
        table["step"][between], table["goal"][between] = rest[between], table["done"][between] + 1
        table["status"][between] = RUNNING
        kernel.advance(images, np.flatnonzero(between), _UNTIL_ALL_STOP, False)
        table["step"][between], table["goal"][between] = step, goal


def _advance(kernel: Kernel, marks: Marks, which: Array, before: Array, steps: Array) -> Array:
    """The images of samples, shape (samples, rows): of the trajectories `which` after so many `steps`, by the marks
    `before` them; all in the order of trajectories and steps."""
    begins = np.flatnonzero(np.diff(which * len(marks) + before, prepend=-1))
    counts = np.diff(begins, append=len(steps))
    stretches = np.array([marks[before[i]][which[i]] for i in begins])
    samples = np.empty((len(steps), stretches.shape[1]))
    table = kernel.table(stretches)
    for i in range(counts.max()):
        active = np.flatnonzero(counts > i)
        table["goal"][active], table["status"][active] = steps[begins[active] + i], RUNNING
        kernel.advance(stretches, active, _UNTIL_ALL_STOP, False)
        samples[begins[active] + i] = stretches[active]
    return samples


def _series(kernel: Kernel, times: Array, images: Array, angle: float) -> dict[str, Array]:
    """The series of a trajectory, each of shape (samples,), from its images at `times`; `angle` is `Model.turned`."""
    model = kernel.model
    states, constants = kernel.unpack(images)
    spin, rattle, inertia = model.energy(states, constants)
    series = {"time": times, "spin": spin, **model.observe(states, constants)}
    for x, y in _VECTORS if angle else ():
        if x in series:
            along, across = series[x], series[y]
            series[x] = along * np.cos(angle) + across * np.sin(angle)
            series[y] = across * np.cos(angle) - along * np.sin(angle)
    if kernel.follows_ripple:
        series["ripple_free_spin"] = kernel.steady_spin(images)
    if "energy_error" in kernel.measure:
        series["energy"] = rattle + 0.5 * inertia * spin**2
        series["dissipated"] = images[:, kernel.row("work")]
    return {name: np.broadcast_to(values, times.shape) for name, values in series.items()}


def _intervals(model: Model, columns: Columns) -> Array:
    """Time between samples, shape (trajectories,)."""
    return np.asarray(1 / (SAMPLES_A_RADIAN * np.maximum(fastest_motion(model, columns), 0.1)))
