"""A tangent to each trajectory, carried along by the linearised flow, shows how fast neighbours part.

It is carried by the same Runge-Kutta formula, applied to the equations and their directional derivative together
(`sweep.kernels.differentiate`): the exact derivative of the steps.  After each block of steps it is brought back to the
length one, and the logarithm of its growth is kept until the next (Benettin, Galgani, Giorgilli and Strelcyn
1980).  Lengths are those of the states as they are; which norm is taken does not matter in the long run.

A neighbour at a small distance could not replace the tangent.  While one mode of the rattle grows, the other
decays to less than 1e-8 of it, and the round-off in the difference of two trajectories fills it in again.  At a = 10,
b = 3, δ = 0.288, n0 = 0.0325 that gave an exponent of 0.009 for a motion that has none.
"""

from __future__ import annotations

import numpy as np

from sweep.jit import exactly_compiled, full_width
from sweep.kernels.codegen import make_access, make_load
from sweep.kernels.layout import BLOCK, LANES, Layout
from sweep.models.generated import compile_inline, tuple_of
from sweep.models.model import Array, Model

GROWTH = "tangent_growth"
"""Logarithm of the growth of the tangent during the last block."""

_DONE = "tangent_done"


def quantities(model: Model) -> tuple[str, ...]:
    """Names of the quantities that a tangent adds to an image."""
    return (*_places(model), _DONE, GROWTH)


def start(model: Model, states: Array) -> dict[str, Array | float]:
    """Values of the quantities that do not start at zero; `states` of shape (states, cells)."""
    values = (*states, *[len(states) ** -0.5] * len(states))
    return dict(zip(_places(model), values, strict=True))


def _places(model: Model) -> tuple[str, ...]:
    """Names of the point at which the tangent has arrived, and of the tangent's components."""
    return tuple(f"{what}.{name}" for what in ("foot", "tangent") for name in model.states)


def make_follow(step, model: Model, layout: Layout):
    """Compiled (group) -> None: advances the tangents of all lanes to the time of their trajectories.

    `step` is that of the equations and their derivative, as made by `sweep.kernels.runge_kutta.make_step`.
    """
    n, names = len(model.states), _places(model)
    own, (load, load_constants, store) = make_load(model.states, layout), make_access(model, layout, names)
    squares = " + ".join(f"z[{i}] * z[{i}]" for i in range(n, 2 * n))
    length = compile_inline("length", "z", [f"return np.sqrt({squares})"], {"np": np})
    # The states plus the tangent times a share.
    both = tuple_of([*(f"y[{i}]" for i in range(n)), *(f"share * z[{i}]" for i in range(n, 2 * n))])
    begin = compile_inline("begin", "y, z, share", [f"return {both}"], {})
    STEP, DONE, CAUGHT_UP, GREW = map(layout.at, ("step", "done", _DONE, GROWTH))
    block, lanes, wide = BLOCK, LANES, full_width()

    @exactly_compiled
    def catch_up(group):
        wide()
        for _ in range(block):
            for lane in range(lanes):
                z = load(group, lane)
                p = load_constants(group, lane)
                h, behind = group[STEP + lane], group[CAUGHT_UP + lane] < group[DONE + lane]
                new, _, _, _, _, _ = step(z, p, h)
                store(group, lane, behind, new, z)
                group[CAUGHT_UP + lane] += 1.0 if behind else 0.0

    # Separate from the steps, which LLVM vectorised less well next to the logarithms.
    @exactly_compiled
    def follow(group):
        wide()
        catch_up(group)
        for lane in range(lanes):
            z = load(group, lane)
            d = length(z)
            group[GREW + lane] = np.log(d)
            store(group, lane, d > 0.0, begin(own(group, lane), z, 1.0 / d), z)

    return follow
