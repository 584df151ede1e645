"""Says what the stiff method needs of a model: its equations in variables in which only the slip is stiff.

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
"""What `slow` computes on its way and `newton` needs as well; components along the body axes.

They are of u; the contact point x_p = (x, y, z); t = u/u3, so that v3 = -(t1 v1 + t2 v2); v_p; ω; u'; s = v_0 - x_p';
and q = u × x_p.
"""


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
    rocking: Callable[[Any], Any]
    """Inline, (p) -> the `Rocking` about upright rest without slip."""
    time_unit: Callable[[Columns], Array]
    """(columns) -> sqrt(c/g) in the model's units, shape (cells,)."""
    slip_decay: Callable[[Columns], Array]
    """(columns) -> rate at which the slip decays at first, shape (cells,)."""
    rise: Callable[[Columns], Array]
    """(columns) -> share by which the rattle may raise the decay rate of the slip, shape (cells,)."""
    damping: Callable[[Columns], Array]
    """(columns) -> bound on the rate at which couples damp the angular velocity, shape (cells,)."""


@inline
def slopes(u, M, v, t, x_p, w, du, dx, gravity):
    """`StiffForm.slow` from what a model computes on its way, without the torque of couples.

    Parameters
    ----------
    u, M, v, x_p, w, du, dx : u, M, v_p, x_p, ω, u' and x_p', three components each
    t : u1/u3 and u2/u3
    """
    (u1, u2, u3), (M1, M2, M3), (v1, v2, v3), (x, y, z), (w1, w2, w3), (du1, du2, du3) = u, M, v, x_p, w, du
    s1, s2, s3 = y * w3 - z * w2, z * w1 - x * w3, x * w2 - y * w1
    g1, g2, g3 = s1 + v1, s2 + v2, s3 + v3
    s1, s2, s3 = s1 - dx[0], s2 - dx[1], s3 - dx[2]
    q1, q2, q3 = u2 * z - u3 * y, u3 * x - u1 * z, u1 * y - u2 * x
    dM1 = (s2 * g3 - s3 * g2) - (w2 * M3 - w3 * M2) - gravity * q1
    dM2 = (s3 * g1 - s1 * g3) - (w3 * M1 - w1 * M3) - gravity * q2
    dM3 = (s1 * g2 - s2 * g1) - (w1 * M2 - w2 * M1) - gravity * q3
    geometry = Geometry(u3, x, y, z, t[0], t[1], v3, w1, w2, w3, du1, du2, du3, s1, s2, s3, q1, q2, q3)
    return (du1, du2, dM1, dM2, dM3), geometry


@inline
def newton_step(
    u1, u2, v1, v2, geometry, alpha, T, k, g, gamma, b1, b2
):  # fmt: skip
    """`StiffForm.newton` for ω' = α without contact force, T = 1 - [x_p] J⁻¹ [x_p], a resistance k, and gravity g.

    The Jacobian is that of R G, with dR/dv included.  The gyroscopic terms of v_p' are left out of it, because they
    are not stiff.  Everything is multiplied by den², so that R itself is never computed.
    """
    u3, x, y, z, t1, t2, v3, w1, w2, w3, du1, du2, du3, s1, s2, s3, q1, q2, q3 = geometry
    (al1, al2, al3), (T11, T12, T13, T22, T23, T33) = alpha, T
    f1, f2, f3 = u1 - k * v1, u2 - k * v2, u3 - k * v3
    G1, G2, G3 = T11 * f1 + T12 * f2 + T13 * f3, T12 * f1 + T22 * f2 + T23 * f3, T13 * f1 + T23 * f2 + T33 * f3
    den = u1 * G1 + u2 * G2 + u3 * G3
    num = g + (s1 * du1 + s2 * du2 + s3 * du3) + (q1 * al1 + q2 * al2 + q3 * al3)
    e1, e2, e3 = s1 + v1, s2 + v2, s3 + v3
    rest1 = g * u1 + (y * al3 - z * al2) + (w2 * e3 - w3 * e2)
    rest2 = g * u2 + (z * al1 - x * al3) + (w3 * e1 - w1 * e3)

    # With v3 = -(t1 v1 + t2 v2): dG_i/dv_j = -k S_ij and d den/dv_j = -k e_j.
    S11, S12 = T11 - T13 * t1, T12 - T13 * t2
    S21, S22 = T12 - T23 * t1, T22 - T23 * t2
    S31, S32 = T13 - T33 * t1, T23 - T33 * t2
    e1, e2 = u1 * S11 + u2 * S21 + u3 * S31, u1 * S12 + u2 * S22 + u3 * S32
    gn = gamma * num
    k, dd = gn * k, den * den
    m11, m12 = dd + k * (den * S11 - G1 * e1), k * (den * S12 - G1 * e2)
    m21, m22 = k * (den * S21 - G2 * e1), dd + k * (den * S22 - G2 * e2)
    r1 = den * (den * ((b1 - v1) - gamma * rest1) + gn * G1)
    r2 = den * (den * ((b2 - v2) - gamma * rest2) + gn * G2)
    d = 1.0 / (m11 * m22 - m12 * m21)
    return v1 + d * (m22 * r1 - m12 * r2), v2 + d * (m11 * r2 - m21 * r1), num, den


def subset(constants: type[Any], p):
    """Those of the constants `p` that another model has, as its record."""
    return constants(*(getattr(p, name) for name in constants._fields))


def in_momentum(full: Model, constants: type[Any], momentum, slow, ripple: Ripple) -> Model:
    """The model `full` in the variables `STATES`, without the functions that take its own states.

    The other arguments are as of `StiffForm` and `Model`.
    """

    def start(columns: Columns) -> tuple[Array, ...]:
        states: tuple[Array, ...] = momentum(full.start(columns), constants.of(columns))
        return states

    def observe(y, p):
        return full.observe(velocities(slow, y, p), subset(full.constants, p))

    full_energy = full.energy

    @inline
    def energy(y, p):
        u1, u2, M1, M2, M3, v1, v2 = y
        _, geometry = slow(u1, u2, M1, M2, M3, v1, v2, p)
        return full_energy((u1, u2, geometry.w1, geometry.w2, geometry.w3, v1, v2), p)

    return replace(
        full, states=STATES, constants=constants, start=start, energy=energy, observe=observe, ripple=ripple,
        rhs=no_rhs, upright=never_upright, path=None,
    )  # fmt: skip


def no_rhs(y, p):
    """Stand for the right-hand side that a model in `STATES` does not have."""
    raise NotImplementedError("a stiff method takes `slow` and `newton`, not a right-hand side")


def velocities(slow, y: Array, p) -> Array:
    """The states of the full model, shape (7, cells), from the `STATES` y: the inverse of `StiffForm.momentum`."""
    _, geometry = slow(*y, p)
    return np.stack(np.broadcast_arrays(y[0], y[1], geometry.w1, geometry.w2, geometry.w3, y[5], y[6]))
