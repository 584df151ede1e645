"""Sample the quantity that a film shows, for many trajectories at common instants: no state rows, no checks, no counts.

The steps are dopri5's, and a whole number of them leads from one instant to the next.  The number follows from a cell's
own step, so that cells with the same step, such as the columns of a Jacobian, differ smoothly, and no cell depends on
its neighbours.
"""

from __future__ import annotations

from functools import cache
from typing import Literal

import numpy as np

from sweep.jit import Cached, exactly_compiled, full_width, inline, parallel
from sweep.kernels.codegen import make_access, make_load
from sweep.kernels.layout import LANES, Layout, constants_of
from sweep.kernels.runge_kutta import DOPRI5, make_step
from sweep.models import attitude
from sweep.models.generated import compile_inline, tuple_of
from sweep.models.model import Array, Columns, Model, stack

Seen = Literal["spin", "gyroscope", "heading"]
"""The quantities that a film can show."""


def sampled(
    model: Model,
    columns: Columns,
    step: Array,
    times: Array,
    what: Seen = "spin",
    delay: Array | None = None,
    longest_delay: float = 0.0,
) -> Array:
    """Integrate trajectories through the instants of a film, shape (cells, instants).

    Values are NaN after a body lifts off or a run diverges.  For a model without attitude, a gyroscope shows the
    spin, and the heading is the integral of the spin.

    Parameters
    ----------
    columns : physical parameters by name, each of shape (cells,)
    step : the longest steps wanted, in the model's unit of time as `times`, shape (cells,)
    times : the instants, ascending and not negative, shape (instants,)
    delay : from the start of each trajectory to `times` = 0, shape (cells,); by default there is none
    longest_delay : the number of steps of the delay follows from this, so that it does not depend on the delay
    """
    zero, angle = np.zeros_like(step), model.turned(columns)
    early = zero if delay is None else longest_delay - delay
    motion = (*model.start(columns), zero) if what == "heading" else model.start(columns)
    own = np.cos(angle), np.sin(angle), step, early, zero, zero, zero
    rows = stack((*motion, *model.constants.of(columns), *own))
    order, _, lanes = in_lanes(rows, -step)
    shown = np.empty((len(lanes), len(times), LANES))
    compiled_samples(model, what)(lanes, np.diff(times, prepend=-longest_delay), shown)
    found = np.empty((len(order), len(times)))
    found[order] = shown.transpose(0, 2, 1).reshape(-1, len(times))[: len(order)]
    return found


def in_lanes(rows: Array, needed: Array) -> tuple[Array, Array, Array]:
    """Put cells that need about the same number of steps side by side.

    Parameters
    ----------
    rows : quantities of the cells, shape (quantities, cells)
    needed : steps that each cell needs, shape (cells,)

    Returns
    -------
    The order of the cells; the most steps that one of a group needs, shape (groups,); and the groups, shape (groups,
    quantities * LANES).
    """
    order = np.argsort(needed, kind="stable")
    groups = -(-len(order) // LANES)
    # Idle lanes of the last group repeat its last cell.
    filled = order[np.minimum(np.arange(groups * LANES), len(order) - 1)]
    steps = needed[filled].reshape(groups, LANES).max(axis=1)
    lanes = rows[:, filled].reshape(len(rows), groups, LANES).transpose(1, 0, 2)
    return order, steps, np.ascontiguousarray(lanes).reshape(groups, len(rows) * LANES)


@cache
def compiled_samples(model: Model, what: Seen) -> Cached:
    """Compiled (lanes, gaps, shown) -> None: `sampled` for groups of lanes."""
    from numba import prange

    heads = what == "heading"
    states = (*model.states, "heading") if heads else model.states
    layout = Layout((*states, *constants_of(model), "cos", "sin", "step", "early", "steps", "length", "lost"))
    load, load_constants, store = make_access(model, layout, states)
    load_axis = make_load(("cos", "sin"), layout)
    both = {"constants": load_constants, "axis": load_axis}
    load_both = compile_inline("load", "group, lane", ["return constants(group, lane), axis(group, lane)"], both)
    load_known, rhs = (load_both, _with_heading(model)) if heads else (load_constants, model.rhs)
    step, show = make_step(DOPRI5, rhs, len(states)), _make_show(model, what)
    STEP, EARLY, STEPS, LENGTH, LOST = map(layout.at, ("step", "early", "steps", "length", "lost"))
    wide, lanes = full_width(), LANES

    @exactly_compiled
    def integrate(group, gaps, shown):
        wide()
        for k in range(len(gaps)):
            most = 0.0
            for lane in range(lanes):
                steps = np.ceil(gaps[k] / group[STEP + lane])
                length = gaps[k] - (group[EARLY + lane] if k == 0 else 0.0)
                group[STEPS + lane], group[LENGTH + lane] = steps, length / max(steps, 1.0)
                most = max(most, steps)
            for number in range(int(most)):
                for lane in range(lanes):
                    y = load(group, lane)
                    new, _, _, sound, _, _ = step(y, load_known(group, lane), group[LENGTH + lane])
                    active = number < group[STEPS + lane]
                    store(group, lane, active, new, y)
                    group[LOST + lane] = 1.0 if active & (not sound) else group[LOST + lane]
            for lane in range(lanes):
                value = show(load(group, lane), load_constants(group, lane))
                shown[k, lane] = np.nan if group[LOST + lane] > 0.0 else value

    def run(groups, gaps, shown):
        for g in prange(len(groups)):
            integrate(groups[g], gaps, shown[g])

    return parallel(run, "(f8[:, ::1], f8[::1], f8[:, :, ::1])", f"samples-{what}-{model.key}")


def _with_heading(model: Model):
    """Inline (states, (constants, axis)) -> slopes and extras as of `Model.rhs`, with the heading as the last state."""
    n = len(model.states)
    lines = [
        "p, axis = q",
        f"slopes, extras = rhs({tuple_of(f'z[{i}]' for i in range(n))}, p)",
        f"return {tuple_of([*(f'slopes[{i}]' for i in range(n)), 'turning(z, extras[0], axis)'])}, extras",
    ]
    turning = attitude.turning if model.path else _spin
    return compile_inline("extended", "z, q", lines, {"rhs": model.rhs, "turning": turning})


@inline
def _spin(y, spin, axis):
    return spin


def _make_show(model: Model, what: Seen):
    """Inline (states, constants) -> the quantity that a film shows."""
    shown = {"heading": "y[-1]", "gyroscope": "-y[4]" if model.path else ""}.get(what) or "energy(y, p)[0]"
    return compile_inline("show", "y, p", [f"return {shown}"], {"energy": model.energy})
