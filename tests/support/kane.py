"""The general equations derived a second way, by Kane's method with SymPy, to compare with `sweep.models.general`.

The body is an ellipsoid on a plane with any inertia and with its centre of mass G below the ellipsoid's centre.  Its
orientation is given by angles about z (down), then about x, then about y, as in Kane and Levinson (1982).  The
generalised speeds are the components ω1, ω2, ω3 of the angular velocity along the body's axes, and the velocity s1, s2,
s3 of the point of the body in contact: along the ground, and away from it.  s3 is zero, an auxiliary speed that brings
the normal force N into the equations

    F_r + F_r* = 0,   r = 1 … 6.

They are linear in ω', s' and N.  Without slip s1 and s2 are zero as well, and only the equations of ω and of s3 are
taken.  Friction is -N k s, by the laws of `newton.py`, and the couple is -(σ + N κ) ω.  There are neither couples about
the normal nor Contensou's law.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache

import numpy as np
import sympy as sp

from sweep.models import find
from sweep.models.model import take
from sweep.parameters import PARAMETERS

from .newton import LAWS, axes, rounded, turned

Array = np.ndarray

BODY = ("a", "b", "c", "offset", "mass", "gravity", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
STATE = ("roll", "pitch", "omega1", "omega2", "omega3", "s1", "s2")
FORCES = ("k", "sigma", "kappa")


@cache
def kane() -> Callable[..., list[Array]]:
    """(body, state, forces) -> the equations M x = f of x = (ω', s', N), then u', V and V', with v = V (s1, s2).

    Vectors are columns of components along the body's axes.
    """
    parameters = sp.symbols(" ".join((*BODY, *FORCES)))
    a, b, c, offset, m, g, Ixx, Iyy, Izz, Ixy, Ixz, Iyz, k, sigma, kappa = parameters
    roll, pitch, *speeds = state = sp.symbols(" ".join(STATE))
    auxiliary, N = sp.symbols("s3 N")
    speeds += [auxiliary]
    changes = sp.symbols("x:5")  # ω', s1' and s2'; s3 stays zero

    # Axes that turn with the body about the vertical: forward, sideways, and down.
    lean = sp.Matrix([[1, 0, 0], [0, sp.cos(roll), sp.sin(roll)], [0, -sp.sin(roll), sp.cos(roll)]])
    tip = sp.Matrix([[sp.cos(pitch), 0, -sp.sin(pitch)], [0, 1, 0], [sp.sin(pitch), 0, sp.cos(pitch)]])
    forward, sideways, down = ((tip * lean).col(i) for i in range(3))
    omega = sp.Matrix(speeds[:3])
    # ω = yaw' down + roll' (axis x before pitch) + pitch' (axis y)
    turns = sp.Matrix.hstack(down, tip.col(0), sp.Matrix([0, 1, 0])).inv() * omega

    def rate(vector: sp.Matrix) -> sp.Matrix:
        """Rate of the components."""
        moving = zip((roll, pitch, *speeds[:5]), (turns[1], turns[2], *changes), strict=True)
        return sum((vector.diff(q) * speed for q, speed in moving), sp.zeros(*vector.shape))

    # The lowest point P of (x/a)² + (y/b)² + (z/c)² = 1, from G.
    squares = sp.diag(a**2, b**2, c**2)
    contact = squares * down / sp.sqrt((down.T * squares * down)[0]) - sp.Matrix([0, 0, offset])
    v_P = speeds[3] * forward + speeds[4] * sideways - auxiliary * down
    v_G = v_P - omega.cross(contact)
    J = sp.Matrix([[Ixx, Ixy, Ixz], [Ixy, Iyy, Iyz], [Ixz, Iyz, Izz]])
    inertial = m * (rate(v_G) + omega.cross(v_G)), J * rate(omega) + omega.cross(J * omega)

    at_P = -N * down - N * k * (speeds[3] * forward + speeds[4] * sideways)
    couple = -(sigma + N * kappa) * omega
    equations = []
    for speed in speeds:
        P, G, turn = v_P.diff(speed), v_G.diff(speed), omega.diff(speed)
        active = at_P.dot(P) + m * g * down.dot(G) + couple.dot(turn)
        equations.append((active - inertial[0].dot(G) - inertial[1].dot(turn)).xreplace({auxiliary: sp.Integer(0)}))

    unknown = (*changes, N)
    matrix = sp.Matrix(equations).jacobian(unknown)
    rest = -sp.Matrix(equations).xreplace(dict.fromkeys(unknown, sp.Integer(0)))
    along = sp.Matrix.hstack(forward, sideways)
    found = (matrix, rest, rate(-down), along, rate(along))
    return sp.lambdify([parameters[: len(BODY)], state, parameters[len(BODY) :]], found, cse=True)


def slopes(y: Array, p: Mapping[str, float], law: str | None, rolling: bool, damped: bool) -> tuple[Array, float]:
    """y' and N by Kane's method, for y = u1, u2, ω1, ω2, ω3 and, with a law, v1, v2."""
    u3 = -np.sqrt(1 - y[0] ** 2 - y[1] ** 2)
    roll = -np.arcsin(y[1])
    pitch = np.arctan2(y[0], -u3)
    speed = np.linalg.norm(y[2:5])
    body = [p[name] for name in BODY]
    kappa = p["mu_rolling"] * p["radius"] / rounded(speed, p["speed_rolling"]) if rolling else 0.0
    sigma = p["sigma"] if damped else 0.0

    def at(s: Array, k: float) -> tuple[Array, ...]:
        found = kane()(body, [roll, pitch, *y[2:5], *s], [k, sigma, kappa])
        return tuple(np.asarray(each, float) for each in found)

    if law is None:
        matrix, rest, du, _, _ = at(np.zeros(2), 0.0)
        x = np.linalg.solve(matrix[np.ix_([0, 1, 2, 5], [0, 1, 2, 5])], rest[[0, 1, 2, 5], 0])
        return np.array([*du[:2, 0], *x[:3]]), x[3]
    v = np.array([y[5], y[6], -(y[0] * y[5] + y[1] * y[6]) / u3])
    size = np.linalg.norm(v)
    s = at(np.zeros(2), 0.0)[3].T @ v
    matrix, rest, du, along, along_rate = at(s, LAWS[law](size, p) / size)
    x = np.linalg.solve(matrix, rest[:, 0])
    return np.array([*du[:2, 0], *x[:3], *(along @ x[3:5] + along_rate @ s)[:2]]), x[5]


def random_case(random: np.random.Generator) -> tuple[dict[str, float], Array]:
    """A body of any inertia that can be, with friction, and a state far from upright."""
    size = np.sort(random.uniform(0.02, 0.2, 3))[::-1]
    mass, turn = random.uniform(0.1, 2), np.linalg.qr(random.normal(size=(3, 3)))[0]
    squares = size**2
    J = mass / 5 * turn @ np.diag(squares.sum() - squares) @ turn.T
    p = dict(zip(("a", "b", "c"), size, strict=True)) | {"offset": random.uniform(0, 0.5) * size[2], "mass": mass}
    p |= {"gravity": random.uniform(1, 20), "Ixx": J[0, 0], "Iyy": J[1, 1], "Izz": J[2, 2]}
    p |= {"Ixy": J[0, 1], "Ixz": J[0, 2], "Iyz": J[1, 2]}
    p |= {"mu": random.uniform(0.1, 1), "mu_static": 1.2, "mu_viscous": 0.3, "speed_stick": 0.02}
    p |= {"speed": random.uniform(0.01, 0.2), "sigma": 1e-3, "mu_rolling": 0.1, "radius": 0.004, "speed_rolling": 3.0}
    return p, np.array([*random.uniform(-0.5, 0.5, 2), *random.uniform(-6, 6, 3), *random.uniform(-0.1, 0.1, 2)])


def difference(law: str | None, couples: tuple[str, ...], trials: int) -> float:
    """Find the largest relative difference of y', and of N, at random states of random bodies."""
    model = find("+".join([*(["slip", law] if law else ["noslip", "solid"]), *couples, "offset", "skew", "gravity"]))
    random, worst = np.random.default_rng(1), 0.0
    for _ in range(trials):
        p, y = random_case(random)
        y = y[: len(model.states)]
        expected, N = slopes(turned(y, axes(p)), p, law, "rolling" in couples, "sigma" in couples)
        expected = turned(expected, -axes(p))
        columns = {name: np.array([value]) for name, value in p.items() if name in PARAMETERS}
        found, (_, _, force, _) = model.rhs(tuple(y), take(model.constants.of(columns), 0))
        worst = max(worst, np.abs(np.array(found) - expected).max() / np.abs(expected).max())
        worst = max(worst, abs(force * p["mass"] / N - 1))
    return float(worst)
