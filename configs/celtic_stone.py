"""The Celtic stone of nonholonomic mechanics: an elliptic paraboloid that rolls without slip on a plane that holds it.

It is `model: noslip` on `surface: paraboloid` with one difference: the contact lasts even where the plane has to pull.
Borisov and Mamaev (2003) and those who followed them study that model, at energies at which a stone on a table would
have lifted off; here it goes on.  The parameters are theirs as well: the principal moments of inertia I1, I2 and I3,
the radii of curvature a1 and a2 at the lowest point, the angle delta between the axes of both, and the total energy E.
The mass and the height h of the centre of mass at rest are one, and g is 100, so that E is 100 at rest.

With axes on the body along the principal axes of inertia, γ the upward normal, r the contact point from the centre of
mass and M the angular momentum about it, their equations are

    M' = M × ω + r' × (ω × r) + g r × γ,   γ' = γ × ω,   M = I ω + r × (ω × r),   E = M·ω/2 - g r·γ.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from sweep.jit import inline
from sweep.models.general import rigid_body
from sweep.models.model import COUNT, ENERGY, SPIN, Array, Columns, zeros
from sweep.models.variants import variant
from sweep.parameters import Parameter

GRAVITY = 100.0
NOSLIP = variant("noslip+solid+gravity+paraboloid")
motion = NOSLIP.rhs

PARAMETERS = (
    *(
        Parameter(f"I{i}", "body", "m h2", f"principal moment of inertia {i}", value, above=0, below=1e6)
        for i, value in ((1, 5.0), (2, 6.0), (3, 7.0))
    ),
    *(
        Parameter(f"a{i}", "body", "h", f"radius of curvature {i} at the lowest point", value, above=1, below=1e6)
        for i, value in ((1, 9.0), (2, 4.0))
    ),
    *(
        Parameter(f"omega{i}", "start", "1", f"direction of the angular velocity along {axis}", value)
        for i, axis, value in ((1, "x", 0.0), (2, "y", 0.0), (3, "z", -1.0))
    ),
    Parameter("E", "start", "m g h/100", "total energy", 752.0, above=100, below=1e6),
)


def body(columns: Columns) -> Mapping[str, Array]:
    """What `noslip` calls these parameters."""
    I1, I2, one = columns["I1"], columns["I2"], 1.0 + 0.0 * columns["I1"]
    cos, sin = np.cos(columns["delta"]), np.sin(columns["delta"])
    return {
        "a": 0.5 / columns["a1"], "b": 0.5 / columns["a2"], "c": one, "gravity": GRAVITY * one,
        "Ixx": I1 * cos**2 + I2 * sin**2, "Iyy": I1 * sin**2 + I2 * cos**2, "Izz": columns["I3"],
        "Ixy": (I1 - I2) * sin * cos,
    }  # fmt: skip


class Constants(NOSLIP.constants):  # type: ignore[misc, name-defined]
    @classmethod
    def of(cls, columns: Columns) -> "Constants":
        return cls(*NOSLIP.constants.of(body(columns)))


def attitude(columns: Columns) -> tuple[tuple[Array, ...], Array]:
    """u1, u2 and the direction of ω at the start, and the square of the factor that gives it the energy."""
    axes, p = rigid_body.axes(body(columns)), Constants.of(columns)
    u = rigid_body.turned(np.cos(columns["roll"]) * np.sin(columns["pitch"]), -np.sin(columns["roll"]), axes)
    w = *rigid_body.turned(columns["omega1"], columns["omega2"], axes), columns["omega3"]
    _, resting, _ = NOSLIP.energy((*u, 0 * u[0], 0 * u[0], 0 * u[0]), p)
    spin, rattle, J = NOSLIP.energy((*u, *w), p)
    with np.errstate(divide="ignore", invalid="ignore"):
        return (*u, *w), (columns["E"] - GRAVITY - resting) / (rattle + J * spin**2 / 2 - resting)


def start(columns: Columns) -> tuple[Array, ...]:
    (u1, u2, *w), square = attitude(columns)
    return u1, u2, *(np.sqrt(square) * each for each in w)


@inline
def rhs(y: Any, p: Any) -> Any:
    """That of `noslip`; a normal force of 1.0 says that the stone never lifts off."""
    slopes, (spin, _, _, _) = motion(y, p)
    return slopes, (spin, 0.0, 1.0, 1.0)


MODEL = replace(
    NOSLIP,
    name="celtic_stone",
    summary="an elliptic paraboloid that rolls without slip on a plane that holds it",
    parameters=("delta", "roll", "pitch"),
    own_parameters=PARAMETERS,
    offers=frozenset({COUNT, SPIN, ENERGY}),
    constants=Constants,
    start=start,
    slower_period=lambda columns: NOSLIP.slower_period(body(columns)),
    turned=lambda columns: NOSLIP.turned(body(columns)),
    rhs=rhs,
    ripple=replace(NOSLIP.ripple, of=lambda columns: NOSLIP.ripple.of(body(columns))),
    fastest_decay=zeros,
    spin_unit=lambda columns: rigid_body.spin_unit(body(columns)),
    impossible=lambda columns: NOSLIP.impossible(body(columns)) | ~(attitude(columns)[1] > 0),
    radians_a_step=0.07,
    fastest_motion=lambda columns: 2 * np.sqrt(2 * columns["E"] / columns["I1"]),
)
