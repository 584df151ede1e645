"""How a body turns about the vertical and travels over the table.

The axes of the table are X, Y and Z, upwards.  The body's own, x, y and z, downwards, come from (X, -Y, -Z) by turns of
-heading about z, of roll about x and of pitch about y, each time about the axis in its current position:

    u = (cos(roll) sin(pitch), -sin(roll), -cos(roll) cos(pitch)).

The heading, positive in the sense of the spin, is the one thing that does not follow from u.  With h = sqrt(u1² + u3²)
it obeys

    heading' = (ω1 u1 + ω3 u3) / h²,

from e_y' = ω × e_y for the body's y axis.  The contact point moves over the table at the velocity m = v_p + x_p',
because it is at x_G + x_p and x_G' = v_p + x_p × ω.  Along the directions that X and Y get by the heading,

    m_along = (u1 m3 - u3 m1) / h,   m_across = -m2 / h.

Seen from above, an axis e of the body turns, by e' = ω × e, at the rate (n - (e·u)(e·ω)) / (1 - (e·u)²), where n is the
spin.
"""

from __future__ import annotations

import numpy as np

from sweep.jit import inline
from sweep.models.model import Array
from sweep.models.vectors import Vector


def of_rolling(contact):
    """Make `Model.path` for states that begin with (u1, u2, ω1, ω2, ω3), on a surface with this `contact` point."""

    def path(y, along, across, p):
        return moving((*y[:5], 0.0, 0.0), along, across, p)

    moving = of_slipping(contact)
    return path


def of_slipping(contact):
    """As `of_rolling`, for states that begin with (u1, u2, ω1, ω2, ω3, v1, v2)."""

    def path(y, along, across, p):
        u1, u2, w1, w2, w3, v1, v2 = y[:7]
        (_, _, u3), inv_u3, _, _, dx = contact(u1, u2, Vector(w1, w2, w3), p)
        m1, m2, m3 = dx + Vector(v1, v2, -(v1 * u1 + v2 * u2) * inv_u3)
        square = u1 * u1 + u3 * u3
        turning, h = (w1 * u1 + w3 * u3) / square, np.sqrt(square)
        # The directions along and across turn with the heading.
        return turning, (u1 * m3 - u3 * m1) / h + turning * across, -m2 / h - turning * along

    return path


@inline
def turning(y, spin, axis):
    """The rate at which an axis of the body in its x-y plane, given by its components, turns, seen from above.

    The states y begin with (u1, u2, ω1, ω2, ω3).
    """
    (u1, u2, w1, w2, _), (e1, e2) = y[:5], axis
    upright = e1 * u1 + e2 * u2
    return (spin - upright * (e1 * w1 + e2 * w2)) / (1 - upright * upright)


def angles(u1: Array, u2: Array) -> tuple[Array, Array]:
    """Roll and pitch, shape as u1 and u2."""
    return -np.arcsin(u2), np.arctan2(u1, np.sqrt(1 - u1**2 - u2**2))


def lead(u1: Array, u2: Array, angle: Array) -> Array:
    """The heading of axes that are turned by `angle` about z, less that of the axes of u1 and u2."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.asarray(-np.arctan2(sin * np.sqrt(1 - u1**2 - u2**2), cos * (1 - u2**2) + sin * u1 * u2))
