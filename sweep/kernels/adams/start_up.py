"""Start-up of the stiff method: from zero slip, through the initial layer of width 1/μ, to a history of eight points.

The slip does not start at its quasi-steady value, which the nonstiff variables determine.  Short steps of dopri5
resolve the transition, and leave a first history.  The stiff method goes on from this with plain weights, and doubles
its step until it reaches the final one.  `LANES` trajectories that need the same number of doublings run side by side.
Each is computed independently, so their choice does not matter.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from sweep.jit import Cached, compiled, full_width, on_all_threads, serial
from sweep.kernels.adams.step import (
    BDF_GAMMA,
    CORRECT,
    CORRECTOR_NODES,
    HISTORY,
    MATRIX,
    POINT,
    PREDICT,
    PREDICTOR_NODES,
    make_advance,
    make_history,
    make_weights,
    work_of,
)
from sweep.kernels.adams.weights import plain_weights
from sweep.kernels.codegen import make_accept, make_access, make_scatter
from sweep.kernels.layout import LANES, Layout, Table, constants_of
from sweep.kernels.runge_kutta import DOPRI5, make_step
from sweep.kernels.status import RUNNING
from sweep.models.model import Array
from sweep.models.stiff.form import StiffForm
from sweep.models.theory.rocking import implicit

# Steps of dopri5, in widths of the layer, and their number.  A step is at least half that long, unless the final one is
# shorter.  Every second one of the last steps is a point of the history.  The slip has forgotten how it began
# after a quarter of them, but while it has not, BDF5 would lose more accuracy in one step than dopri5 does in all of
# them, and such an error hardly depends on the step, so no second run reveals it.  With half as many, one of 278
# wide cells was off by more than 3 times a tolerance of 1e-10 without notice; with a quarter, hard taps left 5 to 20
# times the error.
_SHARE, _DOPRI5_STEPS = 0.5, 224

# A level is the part of start-up before each doubling of the step.  While the slip still decays, a level takes extra
# steps, so that the decay does not affect the next one.  With them the floor of the error in spin at t = 400 is below
# 1e-10; without, the error is up to twelve times that of the method itself at h = 0.03.
_LAYER_LEVELS, _EXTRA_STEPS = 2, 6

# A point of the history has the power of friction after the quantities of `POINT`.
_POWER, _POINT_SIZE = len(POINT) * LANES, (len(POINT) + 1) * LANES


@cache
def layout(form: StiffForm) -> Layout:
    """The quantities that a group keeps of a trajectory."""
    more = ("spacing", "h", "status", "ticks", "work", "per_weight", *MATRIX)
    return Layout((*form.model.states, *constants_of(form.model), *more))


def count_levels(slip_decay: Array, step: Array) -> Array:
    """Number of levels, one or more: doublings of the spacing of the history, from two steps of dopri5 to `step`.

    `slip_decay` is the rate at which the slip decays at first; both it and the result are of shape (cells,).
    """
    step = np.minimum(step, 1e9)  # a sphere at rest has no motion for a step to resolve
    return np.maximum(1, np.ceil(np.log2(step * slip_decay / (2 * _SHARE)))).astype(np.int64)


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


def start_up(form: StiffForm, step: Array, constants: Array, starts: Array, levels: Array) -> tuple[Table, Array]:
    """Take trajectories through start-up, from t = 0 to `duration(levels)` steps.

    Parameters
    ----------
    step : the final step, in sqrt(c/g), shape (cells,)
    constants : constants of the form model, shape (cells, constants)
    starts : states of the full model at t = 0, shape (cells, 7)
    levels : number of levels, from `count_levels`, shape (cells,)

    Returns
    -------
    The quantities of `layout` at the end, the states being those of the form model; and the history: its points, oldest
    first, each with the quantities of `POINT` and the power of friction, shape (cells, 8, 8).  A trajectory that fails
    keeps its last sound states and their time; its history is then meaningless.
    """
    batches = [
        cells[begin : begin + LANES]
        for count in np.unique(levels)
        for cells in [np.flatnonzero(levels == count)]
        for begin in range(0, len(cells), LANES)
    ]
    kept, begins = layout(form), np.concatenate([starts, constants], axis=1)
    ended, history = np.empty((len(step), len(kept.names))), np.empty((len(step), HISTORY, _POINT_SIZE // LANES))

    def take(cells: Array) -> None:
        """Take the cells of one group through start-up; empty lanes repeat the last cell."""
        lanes, steps = np.pad(cells, (0, LANES - len(cells)), mode="edge"), _steps(levels[cells[0]])
        group = np.zeros((len(kept.names), LANES))
        group[: begins.shape[1]] = begins[lanes].T
        group[kept.index("spacing")] = step[lanes] / 2.0 ** len(steps)
        group[kept.index("h")] = 0.5 * group[kept.index("spacing")]
        points = np.zeros((HISTORY + steps.max(), _POINT_SIZE // LANES, LANES))
        run(group.ravel(), points.ravel(), steps)
        ended[cells] = group[:, : len(cells)].T
        history[cells] = np.moveaxis(points[:HISTORY, :, : len(cells)], -1, 0)

    run = compiled_start_up(form)
    on_all_threads(take, batches)
    return Table(ended, kept), history


@cache
def _weights() -> dict[str, float]:
    """The plain weights, in steps; they take as long as the rest of this module to make."""
    weights = (*plain_weights(PREDICTOR_NODES), *plain_weights(CORRECTOR_NODES), BDF_GAMMA)
    return dict(zip((*PREDICT, *CORRECT, "gamma"), map(float, weights), strict=True))


def _make_layer_step(form: StiffForm):
    """Compiled (group) -> None: a step of dopri5 of all lanes."""
    kept, full = layout(form), form.full
    (load, load_constants, _), accept = make_access(form.model, kept), make_accept(form.model, kept)
    step, lanes, wide = make_step(DOPRI5, full.rhs, len(full.states)), LANES, full_width()
    H, STATUS, TICKS, WORK = map(kept.at, ("h", "status", "ticks", "work"))

    @compiled
    def layer_step(group):
        wide()
        for lane in range(lanes):
            y, p, status = load(group, lane), load_constants(group, lane), group[STATUS + lane]
            new, _, work, sound, airborne, jammed = step(y, p, group[H + lane])
            accepted = accept(group, lane, status, status == RUNNING, y, new, sound, airborne, jammed)
            group[TICKS + lane] += 0.5 if accepted else 0.0
            group[WORK + lane] += work if accepted else 0.0

    return layer_step


def _make_record(form: StiffForm):
    """Compiled (group, points) -> None: makes the first point from states of the full model."""
    load, load_constants, _ = make_access(form.model, layout(form))
    _, put = make_history(_POINT_SIZE)
    momentum, nonstiff, newton, power = form.momentum, form.nonstiff, form.newton, form.power
    lanes, wide, power_at = LANES, full_width(), _POWER

    @compiled
    def record(group, points):
        wide()
        for lane in range(lanes):
            p = load_constants(group, lane)
            s = momentum(load(group, lane), p)
            f, geometry = nonstiff(s[0], s[1], s[2], s[3], s[4], s[5], s[6], p)
            _, _, num, den = newton(s[0], s[1], s[5], s[6], geometry, 0.0, 0.0, 0.0, p)
            put(points, 0, lane, f + s[5:])
            points[power_at + lane] = power(num / den, s[5], s[6], geometry, p)

    return record


def _make_replace(form: StiffForm):
    """Compiled (group) -> None: replaces states of the full model by those of the stiff form."""
    load, load_constants, store = make_access(form.model, layout(form))
    momentum, lanes, wide = form.momentum, LANES, full_width()

    @compiled
    def replace(group):
        wide()
        for lane in range(lanes):
            y = load(group, lane)
            store(group, lane, True, momentum(y, load_constants(group, lane)), y)

    return replace


def _make_set_step(form: StiffForm):
    """Compiled (group, ticks) -> None: sets the step, in units of the first spacing, and what depends on it."""
    kept, rocking, weight = layout(form), form.rocking, _weights()[CORRECT[0]]
    _, load_constants, _ = make_access(form.model, kept)
    store = make_scatter("group, lane", [f"group[{kept.at(name)} + lane]" for name in MATRIX])
    SPACING, H, PER_WEIGHT = map(kept.at, ("spacing", "h", "per_weight"))
    lanes, wide = LANES, full_width()

    @compiled
    def set_step(group, ticks):
        wide()
        for lane in range(lanes):
            h = ticks * group[SPACING + lane]
            group[H + lane] = h
            group[PER_WEIGHT + lane] = 1.0 / (weight * h)
            store(group, lane, implicit(weight * h, rocking(load_constants(group, lane))))

    return set_step


def _make_advance(form: StiffForm):
    """Compiled (group, points, ticks) -> None: a step from the first eight points to the ninth."""
    kept, weights = layout(form), _weights()

    def at(name: str) -> str:
        return f"({weights[name]!r} * h)" if name in weights else f"group[{kept.at(name)} + lane]"

    load, load_constants, _ = make_access(form.model, kept)
    load_points, put = make_history(_POINT_SIZE)
    load_weights = make_weights("group, lane, h", at)
    advance_lane, accept = make_advance(form), make_accept(form.model, kept)
    H, STATUS, TICKS, WORK = map(kept.at, ("h", "status", "ticks", "work"))
    newest, newest_power, lanes, wide = HISTORY * _POINT_SIZE, HISTORY * _POINT_SIZE + _POWER, LANES, full_width()
    size = _POINT_SIZE

    @compiled
    def advance(group, points, ticks):
        wide()
        for lane in range(lanes):
            y, p, h = load(group, lane), load_constants(group, lane), group[H + lane]
            status = group[STATUS + lane]
            active = status == RUNNING
            w = load_weights(group, lane, h)
            new, slopes, _, (num, den), power = advance_lane(y, load_points(points, 0, lane), w, p)
            accepted = accept(group, lane, status, active, y, new, (num > 0.0) & (den > 0.0), num <= 0.0, den <= 0.0)
            put(points, newest, lane, slopes + new[5:])
            last = newest_power + lane
            points[last] = power
            work = work_of(h, power, points[last - size], points[last - 2 * size], points[last - 3 * size])
            group[TICKS + lane] += ticks if accepted else 0.0
            group[WORK + lane] += work if accepted else 0.0

    return advance


@cache
def compiled_start_up(form: StiffForm) -> Cached:
    """Compiled (group, points, steps) -> None: takes a group through all its levels."""
    layer_step, record, replace = _make_layer_step(form), _make_record(form), _make_replace(form)
    set_step, advance = _make_set_step(form), _make_advance(form)
    size, layer_steps = _POINT_SIZE, _DOPRI5_STEPS

    def run(group, points, steps):
        for n in range(layer_steps + 1):
            if n:
                layer_step(group)
            back = layer_steps - n
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

    return serial(run, "(f8[::1], f8[::1], i8[::1])", f"start-up-{form.full.name}")
