"""What the stiff method needs of a model: its equations in variables in which only the slip is stiff.

The angular momentum M about the contact point takes the place of ω.  Forces at the contact point have no torque about
it, so neither friction nor the normal force appears in u' and M'.  See `sweep.models.stiff.slip`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from sweep.models.model import Array, Columns, Model, Ripple

STATES = ("u1", "u2", "M1", "M2", "M3", "v1", "v2")


class Geometry(NamedTuple):
    """What `slow` computes on its way and `newton` needs as well; components along the body axes."""

    u3: Any
    x: Any
    """Contact point x_p."""
    y: Any
    z: Any
    t1: Any
    """u1/u3; t2 is u2/u3, so that v3 = -(t1 v1 + t2 v2)."""
    t2: Any
    v3: Any
    w1: Any
    """ω."""
    w2: Any
    w3: Any
    du1: Any
    """u'."""
    du2: Any
    du3: Any
    s1: Any
    """s = v_0 - x_p'."""
    s2: Any
    s3: Any
    q1: Any
    """u × x_p."""
    q2: Any
    q3: Any


@dataclass(frozen=True)
class StiffForm:
    """A model with slip in the variables `STATES`."""

    full: Model
    """The model as the configuration names it."""
    model: Model
    """The same in these variables; its constants `p` contain those of `full`."""
    momentum: Callable[..., Any]
    """Inline, (states of `full`, p) -> states."""
    slow: Callable[..., Any]
    """Inline, (states one by one, p) -> ((u1', u2', M1', M2', M3'), geometry), where `newton` needs the latter."""
    newton: Callable[..., Any]
    """Inline, (u1, u2, v1, v2, geometry, p, γ, b1, b2) -> (v1, v2, numerator and denominator of the normal force R at
    the old v): one Newton step from v for v = b + γ v_p'(v)."""
    power: Callable[..., Any]
    """Inline, (R, v1, v2, geometry, p) -> the power that friction dissipates."""
    implicit: Callable[..., Any]
    """Inline, (weight, p) -> (1 - weight J)⁻¹ row by row, sixteen numbers, where J is the matrix of the rocking about
    upright rest without slip in (u1, u2, M1, M2)."""
    fastest_rocking: Callable[[Any], Array]
    """(p) -> the higher frequency of that rocking, shape (cells,)."""
    time_unit: Callable[[Columns], Array]
    """(columns) -> sqrt(c/g) in the model's units, shape (cells,)."""
    slip_decay: Callable[[Columns], Array]
    """(columns) -> rate at which the slip decays at first, shape (cells,)."""
    rise: Callable[[Columns], Array]
    """(columns) -> share by which the rattle may raise the decay rate of the slip, shape (cells,)."""
    resistance: Callable[[Columns], Array]
    """(columns) -> bound on friction's resistance in 1/sqrt(g c), shape (cells,)."""
    damping: Callable[[Columns], Array]
    """(columns) -> bound on the rate at which couples damp the angular velocity, shape (cells,)."""
    resolves_modes: bool
    """Whether `sweep.models.stiff.modes` can resolve a small rattle of it into its modes."""

    def velocities(self, y: Array, p: Any) -> Array:
        """The states of `full` from these, shape (7, cells): the inverse of `momentum`."""
        return _velocities(self.slow, y, p)


def subset(constants: type[Any], p: Any) -> Any:
    """Those of the constants `p` that another model has, as its record."""
    return constants(*(getattr(p, name) for name in constants._fields))


def in_momentum(full: Model, constants: type[Any], momentum: Any, slow: Any, energy: Any, ripple: Ripple) -> Model:
    """The model `full` in the variables `STATES`; the other arguments are as of `StiffForm` and `Model`."""

    def start(columns: Columns) -> tuple[Array, ...]:
        states: tuple[Array, ...] = momentum(full.start(columns), constants.of(columns))
        return states

    def observe(y: Array, p: Any) -> dict[str, Array]:
        return full.observe(_velocities(slow, y, p), subset(full.constants, p))

    return replace(
        full, states=STATES, constants=constants, start=start, energy=energy, observe=observe, ripple=ripple
    )  # fmt: skip


def _velocities(slow: Any, y: Array, p: Any) -> Array:
    _, geometry = slow(*y, p)
    return np.stack(np.broadcast_arrays(y[0], y[1], geometry.w1, geometry.w2, geometry.w3, y[5], y[6]))
