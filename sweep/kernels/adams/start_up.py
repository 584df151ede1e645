"""The first steps of `adams`: from rest in the slip, through the layer of 1/μ, to a history of eight points.

The slip starts off its slow value.  Steps of dopri5 resolve how it gets there and leave a first history;
the method goes on from it with plain weights and doubles its step until it is the one wanted.  `LANES`
trajectories that need equally many doublings go side by side; each computes by itself, so it does not
matter which.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from sweep.jit import OPTIONS, parallel
from sweep.kernels.adams.step import (
    BDF_GAMMA,
    CORRECTOR_NODES,
    HISTORY,
    PREDICTOR_NODES,
    accept_lines,
    load_lines,
    step_lines,
    store_lines,
)
from sweep.kernels.adams.weights import plain_weights
from sweep.kernels.lanes import DIVERGED, LANES, LIFT_OFF, PARADOX, RUNNING, count_constants
from sweep.kernels.stepper import compile_lanes, make_step
from sweep.kernels.tableau import DOPRI5
from sweep.models import slip
from sweep.models.model import Array
from sweep.models.slip_split import SPLIT, implicit, momentum, newton, slow

# dopri5 takes steps of half the layer's width until the slip has come close (e^-14); every second of its last
# is a point of the history.  BDF5 would lose more in one such step than dopri5 in all.
_SHARE, _DOPRI5_STEPS = 0.5, 28

# While the slip still decays, a level runs on beyond its doubling, until that does not show in the next one:
# floor of the spin error at t = 400 below 1e-10; none: up to twelve times the method's own error at h = 0.03.
_LAYER_LEVELS, _EXTRA_STEPS = 2, 6

_N_STATES, _N_CONSTANTS = len(SPLIT.states), count_constants(SPLIT)

POINT = ("f{}_0", "f{}_1", "f{}_2", "f{}_3", "f{}_4", "v{}_0", "v{}_1")
"""Rows of a point of the history: slopes of (u, M), slip."""

# What a group keeps: of a trajectory, and of a point of its history.
_MATRIX = tuple(f"P{i}{j}" for i in range(4) for j in range(4))
_CONSTANTS = tuple(f"constant{i}" for i in range(_N_CONSTANTS))
_ROWS = (*SPLIT.states, *_CONSTANTS, "spacing", "h", "status", "ticks", "work", "per_weight", *_MATRIX)
_POINT = (*POINT, "power{}")
_POINT_SIZE = len(_POINT) * LANES

ROWS = ("step", "begin", "status", "f0_0", "power0", "work")
"""Rows of an image that `start_up` needs to know of; work may be none, -1."""


def count_levels(mu: Array, step: Array) -> Array:
    """Doublings of the history's spacing from two steps of dopri5 to `step`, at least one."""
    return np.maximum(1, np.ceil(np.log2(step * (2.2 * mu + 2.2) / (2 * _SHARE)))).astype(np.int64)


def _steps(levels: int) -> Array:
    """Steps of the method on each level, before its doubling, shape (levels,)."""
    steps = np.full(levels, HISTORY - 1)
    steps[:_LAYER_LEVELS] += _EXTRA_STEPS
    return steps


def duration(levels: Array) -> Array:
    """Time that start-up covers, in steps."""
    most = levels.max()
    in_spacings = _DOPRI5_STEPS / 2 + np.cumsum(_steps(most) * 2.0 ** np.arange(most))
    return np.asarray(in_spacings[levels - 1] / 2.0**levels)


def start_up(images: Array, rows: tuple[int, ...], starts: Array, levels: Array) -> None:
    """Carry images at t = 0 on by the first `duration(levels)` steps, in place.

    Parameters
    ----------
    images : with states and constants of the split model first, as `Kernel` lays them out
    rows : where they have what `ROWS` names; from power0 on, the power of friction at the last three
        points, newest first; from f0_0 on, the eight points of the history, newest last
    starts : the slip model's states, shape (cells, 7)
    levels : doublings, of `count_levels`

    Notes
    -----
    A trajectory that fails keeps the last sound states, and their time; its history is worth nothing.
    """
    cells = np.argsort(levels, kind="stable")
    counts = np.bincount(levels)
    # Where in this order a group ends: after LANES cells, or with its level.
    ends = [np.arange(last, last - n, -LANES)[::-1] for n, last in zip(counts, np.cumsum(counts), strict=True)]
    _start_up(images, rows, starts, levels, _steps(levels.max()), cells, np.concatenate(ends))


def _at(name: str) -> str:
    """Where the loops below keep a quantity of one lane; point 0 of the history is the oldest of `points`."""
    for i, pattern in enumerate(_POINT):
        for slot in range(HISTORY + 1):
            if name == pattern.format(slot):
                return f"points[{slot * _POINT_SIZE + i * LANES} + lane]"
    if name in _WEIGHTS:
        return f"({_WEIGHTS[name]!r} * h)"
    return f"group[{_ROWS.index(name) * LANES} + lane]"


_WEIGHTS = {
    "gamma": BDF_GAMMA,
    **{f"predict{j}": float(w) for j, w in enumerate(plain_weights(PREDICTOR_NODES))},
    **{f"correct{j}": float(w) for j, w in enumerate(plain_weights(CORRECTOR_NODES))},
}

_STATES = f"({' '.join(f'y{i},' for i in range(_N_STATES))})"

_BEGIN_STEP = [
    *load_lines(_at),
    f"h, status, work = {_at('h')}, {_at('status')}, {_at('work')}",
    f"active = status == {RUNNING}",
]


def _end_step(ticks: str) -> list[str]:
    return [f"{_at('ticks')} += {ticks} if accepted else 0.0", f"{_at('work')} = work + (done if accepted else 0.0)"]


def _power(slot: int) -> list[str]:
    """Power of friction, μ R v², at a point."""
    return [
        f"v3 = -({_at(f'v{slot}_0')} * geometry[4] + {_at(f'v{slot}_1')} * geometry[5])",
        f"{_at(f'power{slot}')} = p[13] * (num / den) * "
        f"({_at(f'v{slot}_0')} * {_at(f'v{slot}_0')} + {_at(f'v{slot}_1')} * {_at(f'v{slot}_1')} + v3 * v3)",
    ]


_DOPRI5 = [
    *_BEGIN_STEP,
    f"slip_constants = ({' '.join(f'p[{i}],' for i in (0, 1, 2, 3, 7, 8, 9, 10, 11, 12, 13))})",
    f"new, _, _, done, sound, airborne, jammed = step({_STATES}, slip_constants, h)",
    "accepted = active & sound",
    *(f"{_at(name)} = new[{i}] if accepted else y{i}" for i, name in enumerate(SPLIT.states)),
    f"failure = {PARADOX} if jammed else ({LIFT_OFF} if airborne else {DIVERGED})",
    f"{_at('status')} = failure if active & (not sound) else status",
    *_end_step("0.5"),
]

_TO_SPLIT = [*load_lines(_at), f"s = momentum({_STATES}, p)"]

# A state of the slip model as point 0.
_RECORD = [
    *_TO_SPLIT,
    "f, geometry = slow(s[0], s[1], s[2], s[3], s[4], s[5], s[6], p)",
    "_, _, num, den = newton(s[0], s[1], s[5], s[6], geometry, p, 0.0, 0.0, 0.0)",
    *(f"{_at(f'f0_{i}')} = f[{i}]" for i in range(5)),
    *(f"{_at(f'v0_{i}')} = s[{5 + i}]" for i in range(2)),
    *_power(0),
]

_REPLACE = [*_TO_SPLIT, *(f"{_at(name)} = s[{i}]" for i, name in enumerate(SPLIT.states))]

_SET_STEP = [
    *load_lines(_at),
    f"h = ticks * {_at('spacing')}",
    f"{_at('h')} = h",
    f"{_at('per_weight')} = 1.0 / {_at('correct0')}",
    f"matrix = implicit({_at('correct0')}, p)",
    *(f"{_at(name)} = matrix[{i}]" for i, name in enumerate(_MATRIX)),
]

# From points 0 … 7 to point 8; the work by the Adams-Moulton formula of order four.
_ADVANCE = [
    *_BEGIN_STEP,
    *step_lines(_at, range(HISTORY)[::-1]),
    *store_lines(_at, HISTORY),
    *_power(HISTORY),
    f"done = h / 24.0 * (9.0 * {_at('power8')} + 19.0 * {_at('power7')} - 5.0 * {_at('power6')} + {_at('power5')})",
    "sound = (num > 0.0) & (den > 0.0)",
    "accepted = active & sound",
    *accept_lines(_at),
    *_end_step("ticks"),
]


def _make_run() -> Any:
    """Compiled (group, points, steps) -> None: a group through all its levels."""
    names = {"slow": slow, "newton": newton, "momentum": momentum, "implicit": implicit}
    names["step"] = make_step(DOPRI5, slip.rhs, _N_STATES)
    record = compile_lanes("record", "group, points", _RECORD, LANES, names)
    replace = compile_lanes("replace", "group", _REPLACE, LANES, names)
    dopri5 = compile_lanes("dopri5", "group", _DOPRI5, LANES, names)
    set_step = compile_lanes("set_step", "group, ticks", _SET_STEP, LANES, names)
    advance = compile_lanes("advance", "group, points, ticks", _ADVANCE, LANES, names)
    size, dopri5_steps = _POINT_SIZE, _DOPRI5_STEPS

    @numba.njit(**OPTIONS)
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
                advance(group, points[n * size : (n + HISTORY + 1) * size], 2.0**level)
            # Every second point, the last among them.
            for j in range(HISTORY):
                at = (steps[level] - HISTORY + 1 + 2 * j) * size
                points[j * size : (j + 1) * size] = points[at : at + size]

    return run


def _make_load() -> Any:
    """Compiled (images, rows, starts, cells, levels) -> group of these cells."""
    n_rows, n_states, n_constants = len(_ROWS), _N_STATES, _N_CONSTANTS
    SPACING, H = (_ROWS.index(name) * LANES for name in ("spacing", "h"))

    @numba.njit(**OPTIONS)
    def load(images: Any, rows: Any, starts: Any, cells: Any, levels: int) -> Any:
        group = np.zeros(n_rows * LANES)
        for lane in range(LANES):
            # The last cell goes into the lanes that would stay empty.
            cell = cells[min(lane, len(cells) - 1)]
            for i in range(n_states):
                group[i * LANES + lane] = starts[cell, i]
            for i in range(n_states, n_states + n_constants):
                group[i * LANES + lane] = images[cell, i]
            group[SPACING + lane] = images[cell, rows[0]] / 2.0**levels
            group[H + lane] = 0.5 * group[SPACING + lane]
        return group

    return load


def _make_store() -> Any:
    """Compiled (images, rows, cells, group, points) -> None: what came out into the images of these cells."""
    n_states, n_point, size = _N_STATES, len(POINT), _POINT_SIZE
    SPACING, STATUS, TICKS, WORK = (_ROWS.index(name) * LANES for name in ("spacing", "status", "ticks", "work"))

    @numba.njit(**OPTIONS)
    def store(images: Any, rows: Any, cells: Any, group: Any, points: Any) -> None:
        _, begin, status, history, power, work = rows
        for lane in range(len(cells)):
            image = images[cells[lane]]
            for i in range(n_states):
                image[i] = group[i * LANES + lane]
            for j in range(HISTORY):
                for i in range(n_point):
                    image[history + n_point * j + i] = points[j * size + i * LANES + lane]
            for j in range(3):
                image[power + j] = points[(HISTORY - 1 - j) * size + n_point * LANES + lane]
            image[begin] = group[TICKS + lane] * group[SPACING + lane]
            image[status] = group[STATUS + lane]
            if work >= 0:
                image[work] = group[WORK + lane]

    return store


def _make_start_up() -> Callable[..., None]:
    load, run, store, size = _make_load(), _make_run(), _make_store(), _POINT_SIZE

    def run_all(images: Any, rows: Any, starts: Any, levels: Any, steps: Any, cells: Any, ends: Any) -> None:
        for g in numba.prange(len(ends)):
            mine = cells[(ends[g - 1] if g else 0) : ends[g]]
            doublings = levels[mine[0]]
            group, points = load(images, rows, starts, mine, doublings), np.zeros((HISTORY + steps.max()) * size)
            run(group, points, steps[:doublings])
            store(images, rows, mine, group, points)

    compiled: Callable[..., None] = parallel(run_all, "start-up", slip.__file__)
    return compiled


_start_up = _make_start_up()
