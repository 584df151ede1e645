"""Start-up of the stiff method: from zero slip, through the initial layer of width 1/μ, to a history of eight points.

The slip does not start at its slow value, the one that follows from the slow variables.  Short steps of dopri5 resolve
the transition, and leave a first history.  The stiff method goes on from this with plain weights, and doubles its
step until it reaches the final one.  `LANES` trajectories that need the same number of doublings run side by side.
Each is computed independently, so their choice does not matter.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from sweep.jit import Cached, on_all_threads, serial
from sweep.kernels.adams.step import (
    BDF_GAMMA,
    CORRECT,
    CORRECTOR_NODES,
    HISTORY,
    MATRIX,
    POINT,
    PREDICT,
    PREDICTOR_NODES,
    SLIPS,
    SLOPES,
    WORK_RULE,
    At,
    advance_lines,
    load_lines,
    names,
    places,
)
from sweep.kernels.adams.weights import plain_weights
from sweep.kernels.codegen import compile_lanes
from sweep.kernels.layout import LANES, Layout, Table, constants_of
from sweep.kernels.runge_kutta import make_step
from sweep.kernels.status import DIVERGED, LIFT_OFF, PARADOX, RUNNING
from sweep.kernels.tableau import DOPRI5
from sweep.models.model import Array
from sweep.models.stiff.form import StiffForm
from sweep.models.theory.rocking import implicit

# Steps of dopri5, in widths of the layer, and their number.  A step is at least half that long, unless the final one is
# shorter.  Every second one of the last steps is a point of the history.  The slip has forgotten how it began
# after a quarter of them, but while it has not, BDF5 would lose more accuracy in one step than dopri5 does in all of
# them, and such an error hardly depends on the step, so no companion run reveals it.  With half as many, one of 278
# wide cells was off by more than 3 times a tolerance of 1e-10 without notice; with a quarter, hard taps left 5 to 20
# times the error.
_SHARE, _DOPRI5_STEPS = 0.5, 224

# A level is the part of start-up before each doubling of the step.  While the slip still decays, a level takes extra
# steps, so that the decay does not affect the next one.  With them the floor of the error in spin at t = 400 is below
# 1e-10; without, the error is up to twelve times that of the method itself at h = 0.03.
_LAYER_LEVELS, _EXTRA_STEPS = 2, 6

# The quantities of a point of the history.
_POINT = (*POINT, "power{}")
_POINTS, _POINT_SIZE = places(_POINT), len(_POINT) * LANES


@cache
def layout(form: StiffForm) -> Layout:
    """The quantities that a group keeps of a trajectory."""
    more = ("spacing", "h", "status", "ticks", "work", "per_weight", *MATRIX)
    return Layout((*form.model.states, *constants_of(form.model), *more))


def count_levels(slip_decay: Array, step: Array) -> Array:
    """Number of levels, one or more: doublings of the spacing of the history, from two steps of dopri5 to `step`.

    `slip_decay` is the rate at which the slip decays at first; both it and the result are of shape (cells,).
    """
    step = np.minimum(step, 1e9)  # a sphere at rest has no motion for a step to follow
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
    ended, history = np.empty((len(step), len(kept.names))), np.empty((len(step), HISTORY, len(_POINT)))

    def take(cells: Array) -> None:
        """Take the cells of one group through start-up; empty lanes repeat the last cell."""
        lanes, steps = np.pad(cells, (0, LANES - len(cells)), mode="edge"), _steps(levels[cells[0]])
        group = np.zeros((len(kept.names), LANES))
        group[: begins.shape[1]] = begins[lanes].T
        group[kept.index("spacing")] = step[lanes] / 2.0 ** len(steps)
        group[kept.index("h")] = 0.5 * group[kept.index("spacing")]
        points = np.zeros((HISTORY + steps.max(), len(_POINT), LANES))
        run(group.ravel(), points.ravel(), steps)
        ended[cells] = group[:, : len(cells)].T
        history[cells] = np.moveaxis(points[:HISTORY, :, : len(cells)], -1, 0)

    run = compiled_start_up(form)
    on_all_threads(take, batches)
    return Table(ended, kept), history


def _places(form: StiffForm) -> At:
    """The place where the loops below keep a quantity of one lane; point 0 of the history is the oldest."""
    kept = layout(form)

    def at(name: str) -> str:
        if name in _POINTS:
            return f"points[{_POINTS[name]} + lane]"
        if name in _weights():
            return f"({_weights()[name]!r} * h)"
        return f"group[{kept.at(name)} + lane]"

    return at


@cache
def _weights() -> dict[str, float]:
    """The plain weights, in steps; they take as long as the rest of this module to make."""
    weights = (*plain_weights(PREDICTOR_NODES), *plain_weights(CORRECTOR_NODES), BDF_GAMMA)
    return dict(zip((*PREDICT, *CORRECT, "gamma"), map(float, weights), strict=True))


def _begin_step(form: StiffForm, at: At) -> list[str]:
    return [
        *load_lines(form, at),
        f"h, status, work = {at('h')}, {at('status')}, {at('work')}",
        f"active = status == {RUNNING}",
    ]


def _end_step(at: At, ticks: str) -> list[str]:
    return [f"{at('ticks')} += {ticks} if accepted else 0.0", f"{at('work')} = work + (done if accepted else 0.0)"]


def _dopri5(form: StiffForm, at: At) -> list[str]:
    return [
        *_begin_step(form, at),
        "new, _, done, sound, airborne, jammed = step(y, p, h)",
        "accepted = active & sound",
        *(f"{at(name)} = new[{i}] if accepted else y[{i}]" for i, name in enumerate(form.model.states)),
        f"failure = {PARADOX} if jammed else ({LIFT_OFF} if airborne else {DIVERGED})",
        f"{at('status')} = failure if active & (not sound) else status",
        *_end_step(at, "0.5"),
    ]


def _record(form: StiffForm, at: At) -> list[str]:
    """Make point 0 of the history from a state of the full model."""
    return [
        *load_lines(form, at),
        "s = momentum(y, p)",
        "f, geometry = slow(s[0], s[1], s[2], s[3], s[4], s[5], s[6], p)",
        "_, _, num, den = newton(s[0], s[1], s[5], s[6], geometry, 0.0, 0.0, 0.0, p)",
        *(f"{at(name.format(0))} = f[{i}]" for i, name in enumerate(SLOPES)),
        *(f"{at(name.format(0))} = s[{5 + i}]" for i, name in enumerate(SLIPS)),
        f"{at('power0')} = power(num / den, s[5], s[6], geometry, p)",
    ]


def _replace(form: StiffForm, at: At) -> list[str]:
    """Replace a state of the full model by the state of the stiff form."""
    replaced = (f"{at(name)} = s[{i}]" for i, name in enumerate(form.model.states))
    return [*load_lines(form, at), "s = momentum(y, p)", *replaced]


def _set_step(form: StiffForm, at: At) -> list[str]:
    return [
        *load_lines(form, at),
        f"h = ticks * {at('spacing')}",
        f"{at('h')} = h",
        f"{at('per_weight')} = 1.0 / {at('correct0')}",
        f"matrix = implicit({at('correct0')}, rocking(p))",
        *(f"{at(name)} = matrix[{i}]" for i, name in enumerate(MATRIX)),
    ]


def _advance(form: StiffForm, at: At) -> list[str]:
    """Steps from points 0 … 7 to point 8."""
    return [
        *_begin_step(form, at),
        *advance_lines(form, at),
        f"{at('power8')} = power",
        f"done = {WORK_RULE.format('power', at('power7'), at('power6'), at('power5'))}",
        *_end_step(at, "ticks"),
    ]


@cache
def compiled_start_up(form: StiffForm) -> Cached:
    """Compiled (group, points, steps) -> None: takes a group through all its levels."""
    at = _places(form)
    known = names(form) | {"slow": form.slow, "newton": form.newton, "power": form.power}
    known |= {"momentum": form.momentum, "implicit": implicit, "rocking": form.rocking}
    known["step"] = make_step(DOPRI5, form.full.rhs, len(form.model.states))
    record = compile_lanes("record", "group, points", _record(form, at), known)
    replace = compile_lanes("replace", "group", _replace(form, at), known)
    dopri5 = compile_lanes("dopri5", "group", _dopri5(form, at), known)
    set_step = compile_lanes("set_step", "group, ticks", _set_step(form, at), known)
    advance = compile_lanes("advance", "group, points, ticks", _advance(form, at), known)
    size, dopri5_steps = _POINT_SIZE, _DOPRI5_STEPS

    def run(group, points, steps):
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

    return serial(run, "(f8[::1], f8[::1], i8[::1])", f"start-up-{form.full.name}")
