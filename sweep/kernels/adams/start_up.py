"""Start-up of the stiff method: from zero slip, through the initial layer of width 1/μ, to a history of eight points.

The slip does not start at its slow value, the one that follows from the slow variables.  Short steps of dopri5 resolve
how it gets there, and leave a first history.  The stiff method goes on from this with plain weights, and doubles its
step until it has the one wanted.  `LANES` trajectories that need equally many doublings go side by side.  Each is
computed by itself, so it does not matter which ones.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from sweep.jit import Cached, on_all_threads, serial
from sweep.kernels.adams.step import (
    BDF_GAMMA,
    CONSTANTS,
    CORRECTOR_NODES,
    HISTORY,
    MATRIX,
    NAMES,
    POINT,
    PREDICTOR_NODES,
    SLIPS,
    SLOPES,
    accept_lines,
    load_lines,
    power,
    step_lines,
    store_lines,
)
from sweep.kernels.adams.weights import plain_weights
from sweep.kernels.codegen import compile_lanes
from sweep.kernels.layout import LANES, Layout
from sweep.kernels.runge_kutta import make_step
from sweep.kernels.status import DIVERGED, LIFT_OFF, PARADOX, RUNNING
from sweep.kernels.tableau import DOPRI5
from sweep.models import slip
from sweep.models.model import Array
from sweep.models.slip_split import SPLIT, implicit, momentum, newton, slow

# Steps of dopri5, in widths of the layer, and their number: after them the slip differs from its slow value by only
# e^-14 of what it did at first.  Every second one of the last steps is a point of the history.  BDF5 would lose more
# accuracy in one such step than dopri5 does in all of them.
_SHARE, _DOPRI5_STEPS = 0.5, 28

# A level is the part of start-up before each doubling of the step.  While the slip still decays, a level takes extra
# steps, so that the decay does not show in the next one.  With them the floor of the error in spin at t = 400 is below
# 1e-10; without, the error is up to twelve times that of the method itself at h = 0.03.
_LAYER_LEVELS, _EXTRA_STEPS = 2, 6

# The quantities that a group keeps of a trajectory, and of a point of its history.
_GROUP = Layout((*SPLIT.states, *CONSTANTS, "spacing", "h", "status", "ticks", "work", "per_weight", *MATRIX))
_POINT = Layout((*POINT, "power{}"))
_POINT_SIZE = len(_POINT.names) * LANES


class Started(NamedTuple):
    """What start-up leads to; arrays over the cells.

    A trajectory that fails keeps its last sound states and their time; its history is then meaningless.
    """

    states: Array
    """States of `slip_split`, shape (cells, 7)."""
    history: Array
    """The eight points, newest last, each with the quantities of `POINT`, shape (cells, 56)."""
    powers: Array
    """Power of friction at the last three points, newest first, shape (cells, 3)."""
    begin: Array
    """Time reached, in sqrt(c/g), shape (cells,)."""
    status: Array
    """Shape (cells,)."""
    work: Array
    """Work of friction: the energy that it has dissipated, shape (cells,)."""


def count_levels(resistance: Array, step: Array) -> Array:
    """Number of levels, one or more: doublings of the spacing of the history, from two steps of dopri5 to `step`.

    `resistance` is that of friction; both it and the result are of shape (cells,).
    """
    return np.maximum(1, np.ceil(np.log2(step * (2.2 * resistance + 2.2) / (2 * _SHARE)))).astype(np.int64)


def _steps(levels: int) -> Array:
    """Number of steps of the stiff method on each level, before the doubling at its end, shape (levels,)."""
    steps = np.full(levels, HISTORY - 1)
    steps[:_LAYER_LEVELS] += _EXTRA_STEPS
    # A level may take one step more, so that start-up ends after a whole number of final steps.
    spacings = _DOPRI5_STEPS // 2 + int(steps @ 2 ** np.arange(levels))
    return np.asarray(steps + (-spacings >> np.arange(levels) & 1))


def _duration(levels: int) -> float:
    return float((_DOPRI5_STEPS // 2 + _steps(levels) @ 2 ** np.arange(levels)) / 2**levels)


def duration(levels: Array) -> Array:
    """Time that start-up covers, in units of the final step: a whole number, shape (cells,)."""
    return np.asarray(np.array([_duration(count) for count in range(1, levels.max() + 1)])[levels - 1])


def start_up(step: Array, constants: Array, starts: Array, levels: Array) -> Started:
    """Take trajectories through start-up, from t = 0 to `duration(levels)` steps.

    Parameters
    ----------
    step : the final step, in sqrt(c/g), shape (cells,)
    constants : constants of `slip_split`, shape (cells, constants)
    starts : states of the slip model at t = 0, shape (cells, 7)
    levels : number of levels, from `count_levels`, shape (cells,)
    """
    groups = [
        rows[begin : begin + LANES]
        for count in np.unique(levels)
        for rows in [np.flatnonzero(levels == count)]
        for begin in range(0, len(rows), LANES)
    ]
    begins = np.concatenate([starts, constants], axis=1)
    started = Started(
        *(np.empty((len(step), n)) for n in (len(SPLIT.states), HISTORY * len(POINT), 3)),
        *(np.empty(len(step)) for _ in range(3)),
    )

    def take(cells: Array) -> None:
        """Take the cells of one group through start-up; lanes that would stay empty repeat the last of them."""
        lanes, steps = np.pad(cells, (0, LANES - len(cells)), mode="edge"), _steps(levels[cells[0]])
        group = np.zeros((len(_GROUP.names), LANES))
        group[: begins.shape[1]] = begins[lanes].T
        group[_GROUP.row("spacing")] = step[lanes] / 2.0 ** len(steps)
        group[_GROUP.row("h")] = 0.5 * group[_GROUP.row("spacing")]
        points = np.zeros((HISTORY + steps.max(), len(_POINT.names), LANES))
        run(group.ravel(), points.ravel(), steps)
        _store(started, cells, group[:, : len(cells)], points[:HISTORY, :, : len(cells)])

    run = compiled_start_up()
    on_all_threads(take, groups)
    return started


def _store(started: Started, cells: Array, group: Array, points: Array) -> None:
    """Write what a group has come to, its quantities of shape (rows, cells), to the rows of these cells."""
    started.states[cells] = group[: len(SPLIT.states)].T
    started.history[cells] = points[:, : len(POINT)].reshape(-1, len(cells)).T
    started.powers[cells] = points[:-4:-1, _POINT.row("power{}")].T
    ticks, spacing = group[_GROUP.row("ticks")], group[_GROUP.row("spacing")]
    started.begin[cells] = ticks * spacing
    started.status[cells], started.work[cells] = group[_GROUP.row("status")], group[_GROUP.row("work")]


def _at(name: str) -> str:
    """The place at which the loops below keep a quantity of one lane; point 0 of the history is the oldest."""
    if name in _POINTS:
        return f"points[{_POINTS[name]} + lane]"
    if name.startswith(("gamma", "predict", "correct")):
        return f"({_weights()[name]!r} * h)"
    return f"group[{_GROUP.at(name)} + lane]"


_POINTS = {
    pattern.format(slot): slot * _POINT_SIZE + _POINT.at(pattern)
    for slot in range(HISTORY + 1)
    for pattern in _POINT.names
}
"""Where the lanes of each quantity of a point begin."""


@cache
def _weights() -> dict[str, float]:
    """The plain weights, in steps; they take as long as the rest of this module to make."""
    predict, correct = plain_weights(PREDICTOR_NODES), plain_weights(CORRECTOR_NODES)
    return {
        "gamma": BDF_GAMMA,
        **{f"predict{j}": float(w) for j, w in enumerate(predict)},
        **{f"correct{j}": float(w) for j, w in enumerate(correct)},
    }


_BEGIN_STEP = [
    *load_lines(_at),
    f"h, status, work = {_at('h')}, {_at('status')}, {_at('work')}",
    f"active = status == {RUNNING}",
]


def _end_step(ticks: str) -> list[str]:
    return [f"{_at('ticks')} += {ticks} if accepted else 0.0", f"{_at('work')} = work + (done if accepted else 0.0)"]


_DOPRI5 = [
    *_BEGIN_STEP,
    "new, _, done, sound, airborne, jammed = step(y, p, h)",
    "accepted = active & sound",
    *(f"{_at(name)} = new[{i}] if accepted else y[{i}]" for i, name in enumerate(SPLIT.states)),
    f"failure = {PARADOX} if jammed else ({LIFT_OFF} if airborne else {DIVERGED})",
    f"{_at('status')} = failure if active & (not sound) else status",
    *_end_step("0.5"),
]

_TO_SPLIT = [*load_lines(_at), "s = momentum(y, p)"]

# Makes point 0 of the history from a state of the slip model.
_RECORD = [
    *_TO_SPLIT,
    "f, geometry = slow(s[0], s[1], s[2], s[3], s[4], s[5], s[6], p)",
    "_, _, num, den = newton(s[0], s[1], s[5], s[6], geometry, p, 0.0, 0.0, 0.0)",
    *(f"{_at(name.format(0))} = f[{i}]" for i, name in enumerate(SLOPES)),
    *(f"{_at(name.format(0))} = s[{5 + i}]" for i, name in enumerate(SLIPS)),
    f"{_at('power0')} = power(num, den, s[5], s[6], geometry, p)",
]

_REPLACE = [*_TO_SPLIT, *(f"{_at(name)} = s[{i}]" for i, name in enumerate(SPLIT.states))]


def _set_step() -> list[str]:
    return [
        *load_lines(_at),
        f"h = ticks * {_at('spacing')}",
        f"{_at('h')} = h",
        f"{_at('per_weight')} = 1.0 / {_at('correct0')}",
        f"matrix = implicit({_at('correct0')}, p)",
        *(f"{_at(name)} = matrix[{i}]" for i, name in enumerate(MATRIX)),
    ]


def _advance() -> list[str]:
    """Steps from points 0 … 7 to point 8; the work follows from the Adams-Moulton formula of order four."""
    return [
        *_BEGIN_STEP,
        *step_lines(_at, range(HISTORY)[::-1]),
        *store_lines(_at, HISTORY),
        f"{_at('power8')} = power",
        f"done = h / 24.0 * (9.0 * power + 19.0 * {_at('power7')} - 5.0 * {_at('power6')} + {_at('power5')})",
        *accept_lines(_at),
        *_end_step("ticks"),
    ]


@cache
def compiled_start_up() -> Cached:
    """Compiled (group, points, steps) -> None: takes a group through all its levels."""
    names = NAMES | {"slow": slow, "newton": newton, "momentum": momentum, "implicit": implicit, "power": power}
    names["step"] = make_step(DOPRI5, slip.rhs, len(SPLIT.states))
    record = compile_lanes("record", "group, points", _RECORD, names)
    replace = compile_lanes("replace", "group", _REPLACE, names)
    dopri5 = compile_lanes("dopri5", "group", _DOPRI5, names)
    set_step = compile_lanes("set_step", "group, ticks", _set_step(), names)
    advance = compile_lanes("advance", "group, points, ticks", _advance(), names)
    size, dopri5_steps = _POINT_SIZE, _DOPRI5_STEPS

    def run(group: Any, points: Any, steps: Any) -> None:
        for n in range(dopri5_steps + 1):
            if n:
                dopri5(group)
            back = dopri5_steps - n
            if back % 2 == 0 and back < 2 * HISTORY:
                record(group, points[(HISTORY - 1 - back // 2) * size :])
        replace(group)
        for level in range(len(steps)):
            set_step(group, 2.0**level)
            for n in range(steps[level]):
                advance(group, points[n * size :], 2.0**level)
            # Keep every second point, counted from the last: the history for the doubled step.
            for j in range(HISTORY):
                for i in range(size):
                    points[j * size + i] = points[(steps[level] - HISTORY + 1 + 2 * j) * size + i]

    return serial(run, "start-up")
