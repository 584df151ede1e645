"""How a general body is set off: from a point of contact, or by angles, angular velocity and slip.

The parameters decide: with `n0` the start is the paper's, otherwise it is given by angles.
"""

from __future__ import annotations

import numpy as np

from sweep.models.general import rigid_body
from sweep.models.general.surfaces import ELLIPSOID, Surface
from sweep.models.model import Array, Columns

POINT = ("n0", "x0", "y0")
"""Parameters of the paper's start."""

ANGLES = ("roll", "pitch", "omega1", "omega2", "omega3")
SLIP = ("slip1", "slip2")


def rolling(columns: Columns, surface: Surface = ELLIPSOID) -> tuple[Array, ...]:
    """u1, u2, ω1, ω2 and ω3 at t = 0, each of shape (cells,)."""
    if "n0" in columns:
        u1, u2, u3 = surface.normal(columns, *point(columns))
        u1, u2 = rigid_body.turned(u1, u2, rigid_body.axes(columns))
        n0 = columns["n0"]
        return u1, u2, n0 * u1, n0 * u2, n0 * u3
    roll, pitch = columns["roll"], columns["pitch"]
    u = rigid_body.turned(np.cos(roll) * np.sin(pitch), -np.sin(roll), rigid_body.axes(columns))
    return *u, *rigid_body.turned(columns["omega1"], columns["omega2"], rigid_body.axes(columns)), columns["omega3"]


def spin(columns: Columns, surface: Surface = ELLIPSOID) -> Array:
    """The spin n at t = 0, shape (cells,)."""
    u1, u2, w1, w2, w3 = rolling(columns, surface)
    return np.asarray(u1 * w1 + u2 * w2 - np.sqrt(1 - u1**2 - u2**2) * w3)


def slipping(columns: Columns, surface: Surface = ELLIPSOID) -> tuple[Array, ...]:
    """As `rolling`, with the slip v1 and v2 as well, all in the axes of the states.

    `slip1` and `slip2` are components along the ground: along the direction that x has, seen from above, when the body
    is turned from upright first by `roll` about x and then by `pitch` about y, and across it.
    """
    states = rolling(columns, surface)
    if "n0" in columns:
        return *states, np.zeros_like(states[0]), np.zeros_like(states[0])
    roll, pitch, along, across = (columns[name] for name in ("roll", "pitch", *SLIP))
    v1, v2 = along * np.cos(pitch) + across * np.sin(roll) * np.sin(pitch), across * np.cos(roll)
    return *states, *rigid_body.turned(v1, v2, rigid_body.axes(columns))


def point(columns: Columns) -> tuple[Array, Array]:
    """The start contact point in the axes of the surface; `x0` and `y0` are along axes that are turned by δ."""
    x, y, delta = columns["x0"], columns["y0"], columns.get("delta", 0.0)
    cos, sin = np.cos(delta), np.sin(delta)
    return x * cos - y * sin, x * sin + y * cos
