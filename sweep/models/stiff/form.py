"""Define what the stiff method needs from a model: its equations in variables in which only the slip is stiff.

The angular momentum M about the contact point takes the place of ω.  Forces at the contact point have no torque about
it, so neither friction nor the normal force appears in u' and M'.  See `sweep.models.stiff.slip`.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sweep.jit import inline
from sweep.models.model import Array, Columns, Model, Ripple, never_upright

STATES = ("u1", "u2", "M1", "M2", "M3", "v1", "v2")


Geometry = namedtuple("Geometry", "u3 x y z t1 t2 v3 w1 w2 w3 du1 du2 du3 s1 s2 s3 q1 q2 q3")
"""Intermediate results of `nonstiff` that `newton` needs as well; components along the axes of the states.

They belong to u; the contact point x_p = (x, y, z); t = u/u3, so that v3 = -(t1 v1 + t2 v2); v_p; ω; u'; s = v_0 -
x_p'; and q = u × x_p.
"""


@dataclass(frozen=True)
class StiffForm:
    """A model with slip in the variables `STATES`."""

    full: Model
    """The model under its name in the configuration."""
    model: Model
    """The same model in these variables; it has the same constants p."""
    momentum: Callable[..., Any]
    """Inline, (states of `full`, p) -> states."""
    nonstiff: Callable[..., Any]
    """Inline, (states one by one, p) -> ((u1', u2', M1', M2', M3'), geometry), where `newton` needs the latter."""
    newton: Callable[..., Any]
    """Inline, (u1, u2, v1, v2, geometry, γ, b1, b2, p) -> (v1, v2, numerator and denominator of the normal force R at
    the old v): one Newton step from v for v = b + γ v_p'(v)."""
    power: Callable[..., Any]
    """Inline, (R, v1, v2, geometry, p) -> the power that friction dissipates."""
    rocking: Callable[[Any], Any]
    """Inline, (p) -> the `Rocking` about upright rest without slip."""
    unit: Callable[[Any], Any]
    """Inline, (p) -> sqrt(g/h), with the height h of the centre of mass: in the paper's units of spin 1."""
    slip_decay: Callable[[Columns], Array]
    """(columns) -> rate at which the slip decays at first, shape (cells,)."""
    rest_decay: Callable[[Columns], Array]
    """(columns) -> rate at which the slip decays at upright rest, shape (cells,)."""
    damping: Callable[[Columns], Array]
    """(columns) -> bound on the rate at which couples damp the angular velocity, shape (cells,)."""


def in_momentum(full: Model, momentum, nonstiff, ripple: Ripple) -> Model:
    """The model `full` in the variables `STATES`, without the functions that take its own states.

    The other arguments are those of `StiffForm` and `Model`.
    """
    full_energy = full.energy

    def start(columns: Columns) -> tuple[Array, ...]:
        states: tuple[Array, ...] = momentum(full.start(columns), full.constants.of(columns))
        return states

    def observe(y, p):
        return full.observe(velocities(nonstiff, y, p), p)

    @inline
    def energy(y, p):
        u1, u2, M1, M2, M3, v1, v2 = y
        _, geometry = nonstiff(u1, u2, M1, M2, M3, v1, v2, p)
        return full_energy((u1, u2, geometry.w1, geometry.w2, geometry.w3, v1, v2), p)

    return replace(
        full, states=STATES, start=start, energy=energy, observe=observe, ripple=ripple, rhs=no_rhs,
        upright=never_upright, path=None,
    )  # fmt: skip


def no_rhs(y, p):
    """Stand in for the right-hand side, which a model in `STATES` does not have."""
    raise NotImplementedError("a stiff method takes `nonstiff` and `newton`, not a right-hand side")


def velocities(nonstiff, y: Array, p) -> Array:
    """The states of the full model, shape (7, cells), from the `STATES` y: the inverse of `StiffForm.momentum`."""
    _, geometry = nonstiff(*y, p)
    return np.stack(np.broadcast_arrays(y[0], y[1], geometry.w1, geometry.w2, geometry.w3, y[5], y[6]))
