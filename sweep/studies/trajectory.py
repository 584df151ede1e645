"""Single trajectories, sampled densely in time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from sweep.config import Config, ConfigError, Fault, as_config
from sweep.engine import executor
from sweep.engine.plan import plan
from sweep.engine.repeats import cells_of, repeat_all
from sweep.grid import Array, off_the_body
from sweep.kernels.kernel import Kernel
from sweep.kernels.runge_kutta import RungeKuttaKernel
from sweep.kernels.status import RUNNING
from sweep.models import TIERS
from sweep.models.linear import fastest_motion
from sweep.models.model import Columns, Model
from sweep.parameters import PARAMETERS
from sweep.results import dataset
from sweep.results.provenance import provenance
from sweep.studies.stepwise import stepwise

SAMPLES_A_RADIAN = 3
"""Samples per radian of the fastest motion: nearly twenty per period."""

MAX_TRAJECTORIES = 1000
"""Every combination of the values asked for is a trajectory, and all its samples are held in memory."""

# name: units, long_name
SERIES: dict[str, tuple[str, str]] = {
    "spin": ("1", "spin about the upward normal, in sqrt(g/c)"),
    "ripple_free_spin": ("1", "spin without the ripple of the rattle, in sqrt(g/c)"),
    "contact_x": ("1", "contact point along x, in c"),
    "contact_y": ("1", "contact point along y, in c"),
    "slip_1": ("1", "slip velocity v_p along x, in sqrt(g c)"),
    "slip_2": ("1", "slip velocity v_p along y, in sqrt(g c)"),
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


def trajectory(config: Config | str | Path, *, every: float | None = None, **at: float | Sequence[float]) -> xr.Dataset:
    """Follow the cells of `config` picked by their parameters, such as ``mu=60, n0=[0.02, 0.05]``.

    Parameters
    ----------
    config : a configuration or the path of one
    every : time between samples, in sqrt(c/g), rounded to whole steps; by default nearly twenty
        per period of the fastest motion
    at : values by parameter; each combination is one trajectory.  An axis of `config` that is not
        named takes its first value

    Returns
    -------
    Dataset over (trajectory, sample): `time` and the series that the model can show, NaN after the
    end of a trajectory.  Over (trajectory): all that a sweep gives for the cell, from the very same
    steps, which the sampling does not change.

    Raises
    ------
    ConfigError
        if the model is a formula, or `at` picks cells that cannot be run.
    """
    config = stepwise(as_config(config))
    job = plan(_choose(config, {name: np.atleast_1d(values).astype(float).tolist() for name, values in at.items()}))
    (part,) = job.parts
    executor.execute(part.kernel, part.images, stop_when_settled=job.config.integrator.stop_when_settled)
    repeat_all([job], {part.method: (part.kernel, part.images)})
    halvings = part.kernel.table(part.images)["halvings"]
    start = cells_of([job], part.method, part.kernel, part.images).start(halvings)
    labelled = dataset.label(job.config, job.grid, job.results(), provenance(job.config, 0.0, job.grid.size))
    summary = labelled.reset_coords(drop=False)
    # With blocks of one step, advancing to the next sample takes no more steps than lie between the two.
    assert isinstance(part.kernel, RungeKuttaKernel)  # which is plain enough to stop after each step
    kernel = part.kernel.stepwise()
    columns = job.grid.columns()
    series = []
    for i in range(len(start)):
        interval = every or _interval(part.kernel.model, {name: values[[i]] for name, values in columns.items()})
        series.append(_sample(kernel, start[[i]], part.images[i], interval))
    length = max(len(s["time"]) for s in series)
    variables: dict[str, Any] = {}
    for name in series[0]:
        units, words = ("1", "time, in sqrt(c/g)") if name == "time" else SERIES[name]
        padded = np.full((len(series), length), np.nan)
        for row, one in zip(padded, series, strict=True):
            row[: len(one[name])] = one[name]
        variables[name] = (("trajectory", "sample"), padded, {"units": units, "long_name": words})
    flat = summary.rename({"case": "trajectory"})
    index = ("trajectory", flat["trajectory"].values, {"units": "1", "long_name": "number of the trajectory"})
    return flat.drop_vars("trajectory").assign(variables).assign_coords(trajectory=index)


def _choose(config: Config, at: dict[str, list[float]]) -> Config:
    """`config` with the cells picked by `at` as its cases; `ConfigError` if they cannot be run."""
    constants = {name: v.numbers[0] for name, v in config.parameters.items()}
    if config.cases is not None:
        constants |= {name: column[0] for name, column in config.cases.items()}
    faults = [
        Fault("--at", None, None, (name,), message)
        for name, values in at.items()
        if (message := _wrong(config, name, values))
    ]
    if faults:
        raise ConfigError(faults)
    if (count := prod(map(len, at.values()))) > MAX_TRAJECTORIES:
        raise ConfigError([Fault("--at", None, None, (), f"{count} trajectories; allowed: at most {MAX_TRAJECTORIES}")])
    combinations = list(product(*at.values())) if at else [()]
    cases = {
        name: tuple(dict(zip(at, values, strict=True)).get(name, constant) for values in combinations)
        for name, constant in constants.items()
    }
    chosen = replace(config, parameters={}, cases=cases)
    if beyond := off_the_body(chosen):
        raise ConfigError([Fault("--at", None, None, (), beyond)])
    return chosen


def _wrong(config: Config, name: str, values: list[float]) -> str:
    """What is wrong with the values asked for a parameter; "" if nothing is."""
    model = TIERS[config.model]
    if name not in model.parameters:
        return f"no parameter of the {model.name} model; allowed: {', '.join(model.parameters)}"
    wrong = [v for v in values if not (np.isfinite(v) and PARAMETERS[name].allows(v))]
    return f"{wrong[0]:g}; allowed: {PARAMETERS[name].allowed}" if wrong else ""


def _sample(kernel: Kernel, start: Array, end: Array, every: float) -> dict[str, Array]:
    """Step a trajectory again from `start` to its `end`, stopping at each sample.

    The steps are the sweep's own, and so equal to the last bit.
    """
    model = kernel.model
    step, steps = float(end[kernel.row("step")]), int(end[kernel.row("done")])
    stride = max(1, round(every / step))
    goals = np.unique([*range(0, steps, stride), steps])
    images, snapshots = start.copy(), [start[0].copy()]
    for goal in goals[1:]:
        images[:, kernel.row("goal")] = goal
        images[:, kernel.row("status")] = RUNNING
        kernel.advance(images, np.zeros(1, dtype=np.int64), int(goal - images[0, kernel.row("done")]), False)
        snapshots.append(images[0].copy())
    table = np.array(snapshots)
    states, constants = kernel.unpack(table)
    spin, rattle, inertia = model.energy(states, constants)
    series = {"time": goals * step, "spin": spin, **model.observe(states, constants)}
    if kernel.follows_ripple:
        series["ripple_free_spin"] = kernel.steady_spin(table)
    if "energy_error" in kernel.measure:
        series["energy"] = rattle + 0.5 * inertia * spin**2
        series["dissipated"] = table[:, kernel.row("work")]
    return {name: np.broadcast_to(values, goals.shape) for name, values in series.items()}


def _interval(model: Model, columns: Columns) -> float:
    """Time between samples for the body `columns`."""
    return float(1 / (SAMPLES_A_RADIAN * max(fastest_motion(model, columns)[0], 0.1)))
