"""Samples what is seen of many trajectories at instants that they share: no images, no looks, no counts.

The steps are dopri5's, and a whole number of them leads from one instant to the next.  Trajectories side by side take
the same number, so that those which differ little, as the columns of a Jacobian do, differ smoothly.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from sweep.jit import Cached, exactly_compiled, full_width, inline, parallel
from sweep.kernels.codegen import compile_inline, make_load, make_store, tuple_of
from sweep.kernels.layout import LANES, Layout
from sweep.kernels.runge_kutta import make_step
from sweep.kernels.tableau import DOPRI5
from sweep.models.model import Array, Columns, Model, stack


def sampled(
    model: Model,
    columns: Columns,
    step: Array,
    interval: float,
    count: int,
    seen=None,
    axis: Array | None = None,
) -> Array:
    """Spins at the times 0, `interval`, …, shape (cells, count); NaN from where a body lifts off or a run diverges.

    Parameters
    ----------
    columns : physical parameters by name, each of shape (cells,)
    step : the longest steps wanted, shape (cells,)
    interval : from one instant to the next, in the model's unit of time, as `step`
    count : number of instants
    seen : in place of the spin: inline (states, spin, axis) -> number
    axis : of the body, which `seen` needs; its components along the axes of the states, shape (3, cells)
    """
    if not len(step):
        return np.empty((0, count))
    axis = np.zeros((3, len(step))) if axis is None else axis
    rows = np.concatenate([stack(model.start(columns)), stack(tuple(model.constants.of(columns))), axis])
    order, steps, lanes = in_lanes(rows, np.ceil(interval / step).astype(np.int64))
    spins = np.empty((len(steps), count, LANES))
    _compiled(model, seen or _spin)(lanes, interval / steps, steps, spins)
    found = np.empty((len(order), count))
    found[order] = spins.transpose(0, 2, 1).reshape(-1, count)[: len(order)]
    return found


def in_lanes(rows: Array, needed: Array) -> tuple[Array, Array, Array]:
    """Put cells that need about as many steps side by side.

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
    # Idle lanes of the last group follow its last cell once more.
    filled = order[np.minimum(np.arange(groups * LANES), len(order) - 1)]
    steps = needed[filled].reshape(groups, LANES).max(axis=1)
    lanes = rows[:, filled].reshape(len(rows), groups, LANES).transpose(1, 0, 2)
    return order, steps, np.ascontiguousarray(lanes).reshape(groups, -1)


@inline
def _spin(y, spin, axis):
    return spin


@cache
def _compiled(model: Model, seen) -> Cached:
    """Compiled (lanes, h, steps, spins) -> None: `sampled` for groups of lanes."""
    from numba import prange

    constants, axis = tuple(f"constant.{name}" for name in model.constants._fields), ("axis_1", "axis_2", "axis_3")
    layout, n = Layout((*model.states, *constants, *axis)), len(model.states)
    load_states, load_axis = make_load(model.states, layout), make_load(axis, layout)
    load_constants = make_load(constants, layout, model.constants)
    store, step, wide, lanes = make_store(model.states, layout), make_step(DOPRI5, model.rhs, n), full_width(), LANES
    lost = compile_inline("lost", "", [f"return {tuple_of(['np.nan'] * n)}"], {"np": np})

    @exactly_compiled
    def follow(group, h, steps, spins):
        wide()
        for k in range(len(spins)):
            for i in range(steps):
                for lane in range(lanes):
                    y = load_states(group, lane)
                    new, spin, _, sound, _, _ = step(y, load_constants(group, lane), h)
                    store(group, lane, sound, new, lost())
                    spins[k, lane] = seen(y, spin, load_axis(group, lane)) if i == 0 else spins[k, lane]

    def run(groups, h, steps, spins):
        for g in prange(len(groups)):
            follow(groups[g], h[g], steps[g], spins[g])

    types = "(f8[:, ::1], f8[::1], i8[::1], f8[:, :, ::1])"
    return parallel(run, types, f"samples-{seen.__name__}-{model.key}")
