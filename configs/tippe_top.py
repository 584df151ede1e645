"""The tippe top: a sphere whose centre of mass lies off its centre turns over when it is spun fast on a plane.

Lengths are in the radius R, times in sqrt(R/g), and the mass is one.  The axis e points from the centre of mass G to
the centre of the sphere, up at rest, and a = α e - ẑ leads from G to the contact point.  L is the angular momentum
about G, V the horizontal velocity of G, and ω3 = L·e/C the spin about the axis:

    L' = a × F,   V' = F - (F·ẑ) ẑ,   e' = ω × e,   ω = L/A + ω3 (1 - C/A) e,
    F = N (ẑ - μ v),   v = V + (ω × a) - the vertical part of it.

As G is at the height 1 - α e·ẑ, the normal force is

    N = (1 - (α/A²) ẑ·(L × (L × e))) / (1 + (α/A) ẑ·((a × (ẑ - μ v)) × e)).

All of this is in axes fixed in space, where nothing is singular when the top stands on its head.  There ω3 has changed
sign, while the top turns about the vertical in the same sense as before: a reversal is an inversion.

Friction takes energy but leaves Jellett's integral -L·a as it is.  Spun fast enough, a top turns over completely if
1 - α < A/C < 1 + α (S. Rauch-Wojciechowski and N. Rutstam, SIGMA 10 (2014), 017, arXiv 1306.2470).

With both, a trajectory knows when its spin can reverse no more.  For λ = -L·a and c = e·ẑ the least energy of any
motion, and that of a motion with ω3 = 0, are

    U(c) = λ² / (2 (A (1 - c²) + C (c - α)²)) + α (1 - c)  and  U0(c) = λ² / (2 A (1 - c²)) + α (1 - c).

So ω3 stays what it is once the energy is below the least U0, which is at c0, or below U at some c between c0 and the
present one: the top is caught in a well that has no ω3 = 0.  Of these wells only that of upright spin is looked for.
"""

from typing import Any, NamedTuple

import numpy as np

from sweep.jit import inline
from sweep.models.model import Array, Columns, Model, Offer
from sweep.parameters import Parameter

PARAMETERS = (
    Parameter("eccentricity", "body", "R", "distance α of the centre of mass", 0.3,
              above=0, below=1, description="Distance of the centre of mass from the centre of the sphere."),
    Parameter("ratio", "body", "1", "ratio A/C of the moments of inertia", 0.936,
              at_least=0.5, below=10, description="Moment of inertia across the axis, divided by that along it."),
    Parameter("C", "body", "m R2", "moment of inertia about the axis", 0.4, above=0, below=1),
    Parameter("mu", "friction", "1/sqrt(g R)", "coefficient of viscous friction μ", 0.15, at_least=0, below=100),
    Parameter("n0", "start", "sqrt(g/R)", "start spin about the axis", 7.0, above=0, below=1000),
    Parameter("tilt", "start", "radian", "start angle of the axis with the vertical", 0.1, at_least=0, below=3.1),
)  # fmt: skip

MARGIN = 1 - 1e-6
"""For the errors of the integration: energies below another by less do not count as below."""


class Constants(NamedTuple):
    alpha: Any
    A: Any
    C: Any
    mu: Any
    least: Any
    ridge: Any
    over: Any

    @classmethod
    def of(cls, columns: Columns) -> "Constants":
        A = columns["ratio"] * columns["C"]
        return cls(columns["eccentricity"], A, columns["C"], columns["mu"], *barriers(columns))


def barriers(columns: Columns) -> tuple[Array, Array, Array]:
    """The least U0, and the ridge that rings upright spin: its c, and U there."""
    alpha, C, A = columns["eccentricity"], columns["C"], columns["ratio"] * columns["C"]
    jellett = C * columns["n0"] * (np.cos(columns["tilt"]) - alpha)

    def U(c: Array) -> Array:
        return jellett**2 / (2 * (A * (1 - c**2) + C * (c - alpha) ** 2)) + alpha * (1 - c)

    low, high = 0 * alpha, 0 * alpha + 1
    for _ in range(50):  # U0 is convex
        c0 = (low + high) / 2
        rises = jellett**2 * c0 > alpha * A * (1 - c0**2) ** 2
        low, high = np.where(rises, low, c0), np.where(rises, c0, high)
    least = jellett**2 / (2 * A * (1 - c0**2)) + alpha * (1 - c0)
    ridge, over = c0, U(c0)
    for share in np.linspace(0, 1, 200, endpoint=False):
        c = c0 + share * (1 - c0)
        ridge, over = np.where(U(c) > over, c, ridge), np.maximum(U(c), over)
    return MARGIN * least, ridge, MARGIN * over


def start(columns: Columns) -> tuple[Array, ...]:
    e1, e3 = np.sin(columns["tilt"]), np.cos(columns["tilt"])
    L, nothing = columns["C"] * columns["n0"], 0 * columns["n0"]
    return L * e1, nothing, L * e3, e1, nothing, e3, nothing, nothing


@inline
def motion(y: Any, p: Any) -> Any:
    """e', ω3, and the horizontal slip velocity v of the contact point."""
    L1, L2, L3, e1, e2, e3, V1, V2 = y
    d1, d2, d3 = (L2 * e3 - L3 * e2) / p.A, (L3 * e1 - L1 * e3) / p.A, (L1 * e2 - L2 * e1) / p.A
    spin = (L1 * e1 + L2 * e2 + L3 * e3) / p.C
    more = spin * (1.0 - p.C / p.A)
    # ω × a = α e' - ω × ẑ
    v1 = V1 + p.alpha * d1 - (L2 / p.A + more * e2)
    v2 = V2 + p.alpha * d2 + (L1 / p.A + more * e1)
    return d1, d2, d3, spin, v1, v2


@inline
def rhs(y: Any, p: Any) -> Any:
    L1, L2, _, e1, e2, e3, _, _ = y
    d1, d2, d3, spin, v1, v2 = motion(y, p)
    f1, f2 = -p.mu * v1, -p.mu * v2
    a1, a2, a3 = p.alpha * e1, p.alpha * e2, p.alpha * e3 - 1.0
    # The torque per unit of N.
    t1, t2, t3 = a2 - a3 * f2, a3 * f1 - a1, a1 * f2 - a2 * f1
    denominator = 1.0 + p.alpha / p.A * (t1 * e2 - t2 * e1)
    N = (1.0 - p.alpha / p.A * (L1 * d2 - L2 * d1)) / denominator
    power = N * p.mu * (v1 * v1 + v2 * v2)
    return (N * t1, N * t2, N * t3, d1, d2, d3, N * f1, N * f2), (spin, power, N, denominator)


@inline
def energy(y: Any, p: Any) -> Any:
    """ω3, the energy above rest without that of ω3, and C."""
    _, _, _, _, _, e3, V1, V2 = y
    d1, d2, d3, spin, _, _ = motion(y, p)
    drift = V1 * V1 + V2 * V2 + (p.alpha * d3) * (p.alpha * d3)
    return spin, 0.5 * (drift + p.A * (d1 * d1 + d2 * d2 + d3 * d3)) + p.alpha * (1.0 - e3), p.C


@inline
def decided(y: Any, p: Any) -> Any:
    spin, rest, inertia = energy(y, p)
    total = rest + 0.5 * inertia * spin * spin
    return (total < p.least) | ((total < p.over) & (y[5] > p.ridge))


def observe(y: Array, p: Any) -> dict[str, Array]:
    L, e = y[:3], y[3:6]
    jellett = L[2] - p.alpha * (L * e).sum(axis=0)
    return {"inclination": np.arccos(np.clip(e[2], -1, 1)), "jellett": jellett, "normal_force": rhs(tuple(y), p)[1][2]}


def nutation(columns: Columns) -> Array:
    """Period of the nutation at the start, over which the spin is averaged."""
    return 2 * np.pi * columns["ratio"] / columns["n0"]


def fastest(columns: Columns) -> Array:
    """Nutation at its fastest: the energy at the start bounds the angular velocity."""
    least = columns["C"] * np.minimum(columns["ratio"], 1)
    square = (columns["C"] * columns["n0"] ** 2 + 2 * columns["eccentricity"] * (1 - np.cos(columns["tilt"]))) / least
    return np.sqrt(square) * np.maximum(1, 1 / columns["ratio"]) + np.sqrt(columns["eccentricity"] / least)


def decay(columns: Columns) -> Array:
    """Friction changes the slip at the rate μ N (1 + |a|²/J), with N up to what the fastest turning asks for."""
    alpha, least = columns["eccentricity"], columns["C"] * np.minimum(columns["ratio"], 1)
    return columns["mu"] * (1 + alpha * columns["n0"] ** 2) * (1 + (1 + alpha) ** 2 / least)


MODEL = Model(
    name="tippe_top",
    summary="a sphere with its centre of mass off its centre, on a plane with viscous friction",
    own_parameters=PARAMETERS,
    offers=frozenset({Offer.COUNT, Offer.SPIN, Offer.ENERGY}),
    states=("L1", "L2", "L3", "e1", "e2", "e3", "V1", "V2"),
    spin_state=2,
    constants=Constants,
    start=start,
    rhs=rhs,
    energy=energy,
    decided=decided,
    observe=observe,
    series=(
        ("inclination", "radian", "angle of the axis with the vertical"),
        ("jellett", "m R sqrt(g R)", "Jellett's integral"),
    ),
    slower_period=nutation,
    fastest_motion=fastest,
    fastest_decay=decay,
    radians_a_step=0.05,
)
