"""The friction law at the contact point: viscous, f = -μ v_p (Takano 2011, visf).

This file holds what the equations of motion and the methods know of the law, but for one thing: the implicit step for
the slip, `newton` of `sweep.models.stiff.slip`, has the force and its derivative written out.  Forces are per unit of
the normal force R, so the friction force on the body is R f.  The slip velocity v_p and all forces are given by
components along the body axes; `p` are the constants of the model.  Other laws are in `sweep.models.general.laws`.

The first two functions are inlined into the kernels, where they work on scalars.  They are also called with arrays,
which are complex where a Jacobian is computed by complex steps; so they have to be analytic in v_p, without `abs`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sweep.jit import inline
from sweep.models.model import Array, Columns

PARAMETERS = ("mu",)
"""The law's physical parameters, of `sweep.parameters`."""

CONSTANTS = ("mu",)
"""Names of what the functions below read of the constants `p` of a model."""


def constants(columns: Columns) -> tuple[Array, ...]:
    """Values of `CONSTANTS`, each of shape (cells,)."""
    return (columns["mu"],)


@inline
def contact_force(u1: Any, u2: Any, u3: Any, v1: Any, v2: Any, v3: Any, p: Any) -> Any:
    """u + f, the normal force and friction together, per unit of R, at the slip velocity v_p = (v1, v2, v3)."""
    return u1 - p.mu * v1, u2 - p.mu * v2, u3 - p.mu * v3


@inline
def dissipation(R: Any, v1: Any, v2: Any, v3: Any, p: Any) -> Any:
    """Power that friction dissipates, -R f · v_p >= 0."""
    return p.mu * R * (v1 * v1 + v2 * v2 + v3 * v3)


def strongest_resistance(columns: Columns) -> Array:
    """Upper bound on -df/dv, the rate at which the force grows with the slip velocity, shape (cells,)."""
    return np.asarray(columns["mu"])
