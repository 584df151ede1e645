"""A neighbour of each trajectory, which takes the same steps from a start a little off: how fast the two part.

After each block of steps the neighbour is brought back along the straight line to the distance `APART`, and what the
distance has grown by is kept until the next (Benettin, Galgani, Giorgilli and Strelcyn 1980).  It is measured in the
states as they are; which norm is taken does not matter in the long run.

The neighbour follows the linearised flow up to `APART` times its second derivatives, and round-off adds about 1e-16 /
`APART` at each step.  Both are of the order of 1e-8, once a block and not accumulated.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sweep.jit import exactly_compiled, full_width
from sweep.kernels.codegen import compile_inline, make_load, make_store
from sweep.kernels.layout import BLOCK, LANES, Layout
from sweep.models.model import Array, Model

APART = 1e-8
"""Distance of the neighbour at the start of a block."""

GROWTH = "neighbour_growth"
"""Logarithm of the growth of the distance during the last block."""

_DONE = "neighbour_done"


def rows(model: Model) -> tuple[str, ...]:
    """Names of the quantities that a neighbour adds to an image."""
    return (*_states(model), _DONE, GROWTH)


def start(model: Model, states: Array) -> dict[str, Array]:
    """Values of the quantities that do not start at zero, each of shape (cells,); `states` of shape (states, cells)."""
    offset = APART / np.sqrt(len(states))
    return dict(zip(_states(model), states + offset, strict=True))


def _states(model: Model) -> tuple[str, ...]:
    return tuple(f"neighbour.{name}" for name in model.states)


def make_follow(step: Any, model: Model, constants: tuple[str, ...], layout: Layout) -> Any:
    """Compiled (group) -> None: lets the neighbours of all lanes catch up, and brings them back.

    Parameters
    ----------
    step : as made by `sweep.kernels.runge_kutta.make_step`
    constants : names of the constants in the image
    """
    own, states = make_load(model.states, layout), _states(model)
    load, store = make_load(states, layout), make_store(states, layout)
    load_constants = make_load(constants, layout, model.constants)
    distance, towards = _make_distance(len(states)), _make_towards(len(states))
    STEP, DONE, CAUGHT_UP, GREW = map(layout.at, ("step", "done", _DONE, GROWTH))
    block, lanes, apart, wide = BLOCK, LANES, APART, full_width()

    @exactly_compiled
    def catch_up(group: Any) -> None:
        wide()
        for _ in range(block):
            for lane in range(lanes):
                z = load(group, lane)
                p = load_constants(group, lane)
                h, behind = group[STEP + lane], group[CAUGHT_UP + lane] < group[DONE + lane]
                new, _, _, _, _, _ = step(z, p, h)
                store(group, lane, behind, new, z)
                group[CAUGHT_UP + lane] += 1.0 if behind else 0.0

    # Not in one function with the steps: beside the logarithms LLVM vectorised those less well (40 in place of 21 ns).
    @exactly_compiled
    def follow(group: Any) -> None:
        wide()
        catch_up(group)
        for lane in range(lanes):
            y, z = own(group, lane), load(group, lane)
            d = distance(y, z)
            group[GREW + lane] = np.log(d / apart)
            store(group, lane, d > 0.0, towards(y, z, apart / d), z)

    return follow


def _make_distance(n: int) -> Any:
    """Inline (states, states) -> their distance."""
    squares = " + ".join(f"(z[{i}] - y[{i}]) * (z[{i}] - y[{i}])" for i in range(n))
    return compile_inline("distance", f"def distance(y, z):\n    return np.sqrt({squares})", {"np": np})


def _make_towards(n: int) -> Any:
    """Inline (y, z, share) -> the point at this share of the way from y to z."""
    point = " ".join(f"y[{i}] + share * (z[{i}] - y[{i}])," for i in range(n))
    return compile_inline("towards", f"def towards(y, z, share):\n    return ({point})", {})
