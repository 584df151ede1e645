"""What the stiff method needs of a model: its equations in variables in which only the slip is stiff.

The angular momentum M about the contact point takes the place of ω.  Forces at the contact point have no torque about
it, so neither friction nor the normal force appears in u' and M'.  See `sweep.models.stiff.slip`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from sweep.models.model import Array, Columns, Model


@dataclass(frozen=True)
class StiffForm:
    """A model with slip in the variables (u1, u2, M1, M2, M3, v1, v2)."""

    full: Model
    """The model as the configuration names it."""
    model: Model
    """The same in these variables; its constants `p` contain those of `full`."""
    momentum: Callable[..., Any]
    """Inline, (states of `full`, p) -> states."""
    velocities: Callable[[Array, Any], Array]
    """(states, of shape (7, cells); p) -> states of `full`, of the same shape."""
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
