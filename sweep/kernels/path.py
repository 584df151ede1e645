"""Integrate the turning of bodies and their path on the table, along trajectories that are known at some instants.

From each state the motion goes on to the next instant in steps of dopri5 as long as those of the trajectory, with
heading and path as further unknowns.  So both have the order of the trajectory, whose kernel does not have them, and
all stretches between two instants are stepped side by side.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from sweep.jit import Cached, exactly_compiled, full_width, parallel
from sweep.kernels.codegen import make_access
from sweep.kernels.layout import LANES, Layout, constants_of
from sweep.kernels.runge_kutta import DOPRI5, make_step
from sweep.kernels.samples import in_lanes
from sweep.models.generated import compile_inline, tuple_of
from sweep.models.model import Array, Model

_NAMES = ("heading", "along", "across")


def stretches(model: Model, states: Array, constants, interval: Array, step: Array) -> Array:
    """The changes of heading and path on stretches of trajectories, for a model that has a `path`.

    Parameters
    ----------
    states : at their beginnings, shape (states, stretches)
    constants : of the model, each of shape (stretches,)
    interval, step : their lengths, and the longest steps wanted, each of shape (stretches,)

    Returns
    -------
    The angle turned, and the displacement of the contact point along the directions of X and Y turned by the heading at
    the end; shape (3, stretches).
    """
    rows = np.concatenate([states, np.zeros((len(_NAMES), len(interval))), [*constants], interval[None]])
    order, steps, lanes = in_lanes(rows, np.ceil(interval / step).astype(np.int64))
    compiled_path(model)(lanes, steps)
    gained = lanes.reshape(len(steps), len(rows), LANES)[:, len(states) : len(states) + len(_NAMES)]
    found = np.empty((len(_NAMES), len(order)))
    found[:, order] = gained.transpose(1, 0, 2).reshape(len(_NAMES), -1)[:, : len(order)]
    return found


@cache
def compiled_path(model: Model) -> Cached:
    """Compiled (lanes, steps) -> None: `stretches` for groups of lanes, in place."""
    from numba import prange

    n, moving = len(model.states), (*model.states, *_NAMES)
    layout = Layout((*moving, *constants_of(model), "interval"))
    load, load_constants, store = make_access(model, layout, moving)
    lines = [
        f"y = {tuple_of(f'z[{i}]' for i in range(n))}",
        "slopes, extras = rhs(y, p)",
        f"turning, along, across = path(y, z[{n + 1}], z[{n + 2}], p)",
        f"return {tuple_of([*(f'slopes[{i}]' for i in range(n)), 'turning', 'along', 'across'])}, extras",
    ]
    extended = compile_inline("extended", "z, p", lines, {"rhs": model.rhs, "path": model.path})
    step, INTERVAL, wide, lanes = make_step(DOPRI5, extended, len(moving)), layout.at("interval"), full_width(), LANES

    @exactly_compiled
    def integrate(group, steps):
        wide()
        for _ in range(steps):
            for lane in range(lanes):
                z = load(group, lane)
                new, _, _, _, _, _ = step(z, load_constants(group, lane), group[INTERVAL + lane] / steps)
                store(group, lane, True, new, z)

    def run(groups, steps):
        for g in prange(len(groups)):
            integrate(groups[g], steps[g])

    return parallel(run, "(f8[:, ::1], i8[::1])", f"path-{model.key}")
