"""Any body on a plane, derived a second way: Newton and Euler in axes fixed in space, with all forces unknown.

Nothing is solved by hand, and mass, gravity and couples enter as they are.  The laws are written as functions of |v|.
"""

from collections.abc import Callable, Mapping, Sequence
from types import SimpleNamespace

import numpy as np
from scipy.integrate import solve_ivp

from sweep.models.general import laws

Vector = np.ndarray


def rounded(x: float, s: float) -> float:
    return x if x >= s else x**2 / s * (1 - x / (3 * s)) + s / 3


def _stribeck(x: float, p: Mapping[str, float]) -> float:
    t = min(x / p["speed"], 1.0)
    mu = p["mu_static"] + (p["mu"] - p["mu_static"]) * (10 * t**3 - 15 * t**4 + 6 * t**5)
    return mu * x / np.sqrt(x**2 + p["speed_stick"] ** 2) + p["mu_viscous"] * x


LAWS: dict[str, Callable[[float, Mapping[str, float]], float]] = {
    "viscous": lambda x, p: p["mu"] * x,
    "none": lambda x, p: 0.0,  # noqa: ARG005
    "coulomb": lambda x, p: p["mu"] * x / np.sqrt(x**2 + p["speed"] ** 2),
    "stribeck": _stribeck,
}
"""Friction force per unit of normal force, at the slip velocity x >= 0: the package's laws."""

FRICTION = {"radius_contact": 0.004, "mu": 0.4, "mu_static": 0.7, "mu_viscous": 0.3, "speed": 0.05, "speed_stick": 0.02}
"""Values of the parameters of all laws."""

OWN = {"fading": lambda x, p: p["mu"] * x / np.hypot(x, p["speed"]) / (1 + (x / p["fading"]) ** 2)}
"""The law of a user's model, in `support.own`."""


def contensou(v: float, n: float, p: Mapping[str, float]) -> tuple[float, float]:
    """Force and couple against slip and spin, per unit of normal force: those that `test_general` finds correct."""
    k, m = laws.LAWS["contensou"].coupled(v**2, n**2, SimpleNamespace(**p))
    return k * v, m * n


def derivative(y: Vector, p: Mapping[str, float], law: str | None) -> tuple[Vector, float, float]:
    """y', the normal force and the dissipated power; without a law there is no slip.

    Parameters
    ----------
    y : u1, u2, ω1, ω2, ω3 and, with a law, v1 and v2, in the axes of inertia about z (`axes`)
    p : parameters by name; without `Ixx` of the paper's body, whose axes of inertia are at `delta` from its own
    """
    slopes, N, power, _ = _solution(y, p, law)
    return slopes, N, power


def _attitude(y: Vector, law: str | None) -> tuple[Vector, Vector]:
    """The downward normal, and the slip velocity in the body's axes."""
    u = np.array([y[0], y[1], -np.sqrt(1 - y[0] ** 2 - y[1] ** 2)])
    return u, np.array([*y[5:], -(y[5] * u[0] + y[6] * u[1]) / u[2]]) if law else np.zeros(3)


def _solution(y: Vector, p: Mapping[str, float], law: str | None) -> tuple[Vector, float, float, float]:
    """As `derivative`, and the determinant of the linear system, which vanishes where no force solves it."""
    m, g = p.get("mass", 1.0), p.get("gravity", 1.0)
    u, slip = _attitude(y, law)
    side = _unit(cross(u, [1.0, 0, 0]))
    space = np.array([cross(side, u), side, u])  # rows: axes fixed in space, in the body's components
    J = space @ inertia(p) @ space.T
    omega, up = space @ y[2:5], np.array([0, 0, 1.0])
    v = space @ slip
    du = cross(u, y[2:5])
    x_p = space @ contact(u, p)
    # The velocity of the contact point, in space, as the body turns: by a complex step.
    moving = space @ (contact(u + 1e-30j * du, p).imag / 1e-30) + cross(omega, x_p)

    # Unknowns: a_G, ω' and the contact force F; ω' is the same in both systems of axes.
    matrix, right = np.zeros((9, 9)), np.zeros(9)
    matrix[:3, :3], matrix[:3, 6:], right[:3] = m * np.eye(3), -np.eye(3), -m * g * up
    speed = np.linalg.norm(omega)
    matrix[3:6, 3:6], matrix[3:6, 6:] = J, -_cross(x_p)
    right[3:6] = -cross(omega, J @ omega) - p.get("sigma", 0.0) * omega
    rolling = p["mu_rolling"] * p["radius"] / rounded(speed, p["speed_rolling"]) if "mu_rolling" in p else 0.0
    matrix[3:6, 8] += rolling * omega
    n = omega[2]
    spinning = (
        p["mu_spinning"] * p["radius_spinning"] / rounded(abs(n), p["speed_spinning"]) if "mu_spinning" in p else 0
    )
    matrix[5, 8] += spinning * n
    # The acceleration of the point of the body in contact, plus that of the contact moving on in the body, is v'.
    acceleration = np.hstack([np.eye(3), -_cross(x_p)])
    drift = -cross(omega, moving)
    if law:
        matrix[6, :6], right[6] = acceleration[2], drift[2]
        size = np.linalg.norm(v)
        if law == "contensou":
            force, couple = contensou(size, n, p)
            matrix[5, 8] += couple
            spinning += couple / n
        else:
            force = (LAWS | OWN)[law](size, p)
        friction = force * v / size if size else v
        matrix[7:, 6:8], matrix[7:, 8] = np.eye(2), friction[:2]
    else:
        matrix[6:, :6], right[6:] = acceleration, drift
    found = np.linalg.solve(matrix, right)
    N, turning = found[8], space.T @ found[3:6]
    slopes = [du[0], du[1], *turning]
    if law:
        in_space = acceleration @ found[:6] - drift
        slopes += list((space.T @ in_space - cross(y[2:5], space.T @ v))[:2])
    power = -found[6:] @ v + (p.get("sigma", 0.0) + N * rolling) * speed**2 + N * spinning * n**2
    return np.array(slopes), N, power, np.linalg.det(matrix)


def energy(y: Vector, p: Mapping[str, float], law: str | None) -> float:
    """Energy per unit mass, above that of upright rest."""
    u, v = _attitude(y, law)
    x_p, m = contact(u, p), p.get("mass", 1.0)
    v_g, rest = v + cross(x_p, y[2:5]), p["c"] - p.get("offset", 0.0)
    return float((y[2:5] @ inertia(p) @ y[2:5] / m + v_g @ v_g) / 2 - p.get("gravity", 1.0) * (x_p @ u + rest))


def follow(y: Vector, p: Mapping[str, float], law: str | None, times: Vector, rtol: float = 1e-12) -> Vector:
    """The states at `times`, shape (states, times)."""
    solution = solve_ivp(
        lambda t, y: derivative(y, p, law)[0],  # noqa: ARG005
        (0, times[-1]), y, "DOP853", times, rtol=rtol, atol=rtol / 100,
    )  # fmt: skip
    return np.asarray(solution.y)


def spin(y: Vector) -> Vector:
    """The spins of states of shape (states, times)."""
    return np.asarray(np.sum(y[2:5] * [y[0], y[1], -np.sqrt(1 - y[0] ** 2 - y[1] ** 2)], axis=0))


def pose(y: Vector, p: Mapping[str, float], law: str | None, times: Vector, rtol: float = 1e-12) -> Vector:
    """Heading, roll and pitch, and the contact point on the table, shape (5, times).

    The angles are of the axes of the surface, or of those of inertia of the paper's body.

    By the matrix that turns the body and by its centre of mass: no angle is integrated, and no contact point.
    """
    n, (u, _) = len(y), _attitude(y, law)
    own = _turn(axes(p) if "Ixx" in p else 0.0)  # rows: the axes of which the angles are
    across = _unit(cross(cross(u, own[1]), u))
    first = np.array([cross(u, across), -across, u])  # rows: X, Y and Z in the body's components

    def slopes(_: float, z: Vector) -> Vector:
        turn, (u, slip), omega = z[n:-3].reshape(3, 3), _attitude(z[:n], law), z[2:5]
        velocity = turn @ (slip + cross(contact(u, p), omega))
        return np.concatenate([derivative(z[:n], p, law)[0], (turn @ _cross(omega)).ravel(), velocity])

    begin = np.concatenate([y, first.ravel(), -first @ contact(u, p)])
    solution = solve_ivp(slopes, (0, times[-1]), begin, "DOP853", times, rtol=rtol, atol=rtol / 100)
    found = []
    for z in solution.y.T:
        turn = z[n:-3].reshape(3, 3)
        place = z[-3:] + turn @ contact(_attitude(z[:n], law)[0], p)
        assert abs(place[2]) < 100 * rtol
        turn = turn @ own.T
        y_axis = turn[:, 1]
        found.append(
            [np.arctan2(y_axis[0], -y_axis[1]), -np.arcsin(y_axis[2]), np.arctan2(turn[2, 0], -turn[2, 2]), *place[:2]]
        )
    return np.vstack([np.unwrap([each[0] for each in found]), np.array(found).T[1:]])


def inertia(p: Mapping[str, float]) -> Vector:
    if "Ixx" not in p:
        return np.diag([p["b"] ** 2 + p["c"] ** 2, p["a"] ** 2 + p["c"] ** 2, p["a"] ** 2 + p["b"] ** 2]) / 5
    turn = _turn(axes(p))
    return np.asarray(turn.T @ _given(p) @ turn)


def _given(p: Mapping[str, float]) -> Vector:
    """The matrix of inertia in the axes of the surface."""
    xy, xz, yz = (p.get(name, 0.0) for name in ("Ixy", "Ixz", "Iyz"))
    return np.array([[p["Ixx"], xy, xz], [xy, p["Iyy"], yz], [xz, yz, p["Izz"]]])


def axes(p: Mapping[str, float]) -> float:
    """The angle from the axes of the surface to the principal axes of inertia about z, the one nearest to them."""
    if "Ixx" not in p:
        return p["delta"]
    _, vectors = np.linalg.eigh(_given(p)[:2, :2])
    nearest = vectors[:, np.argmax(np.abs(vectors[0]))]
    return float(np.arctan2(nearest[1], nearest[0]) if nearest[0] > 0 else np.arctan2(-nearest[1], -nearest[0]))


def turned(y: Vector, angle: float) -> Vector:
    """States, or their rates, along axes from which those that they are given along are turned by `angle`."""
    turn, y = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]), y.copy()
    for first in (0, 2, 5)[: 3 if len(y) > 5 else 2]:
        y[first : first + 2] = turn @ y[first : first + 2]
    return y


def contact(u: Vector, p: Mapping[str, float]) -> Vector:
    """The lowest point of the surface, from the centre of mass."""
    turn = _turn(axes(p))
    if p.get("surface") == "paraboloid":  # where the gradient of z + (a x² + b y²)/c is along -u
        u = turn @ u
        x, y = p["c"] / 2 / p["a"] * u[0] / u[2], p["c"] / 2 / p["b"] * u[1] / u[2]
        z = p["c"] * (1 - p["a"] * (x / p["c"]) ** 2 - p["b"] * (y / p["c"]) ** 2) - p["offset"]
        return np.asarray(turn.T @ np.array([x, y, z]))
    semi = np.array([p["a"], p["b"], p["c"]])
    return turn.T @ (-semi * _unit(semi * (turn @ u))) - np.array([0, 0, p.get("offset", 0.0)])


def _turn(delta: float) -> Vector:
    return np.array([[np.cos(delta), -np.sin(delta), 0], [np.sin(delta), np.cos(delta), 0], [0, 0, 1]])


def cross(a: Sequence[float] | Vector, b: Sequence[float] | Vector) -> Vector:
    """Of two vectors; ten times as fast as `numpy.cross`, which is for many."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _cross(x: Vector) -> Vector:
    """The matrix of x ×."""
    return np.array([[0, -x[2], x[1]], [x[2], 0, -x[0]], [-x[1], x[0], 0]])


def _unit(u: Vector) -> Vector:
    return u / np.sqrt(u @ u)


def end(*, t_end: float, n0: float, x0: float, y0: float, **p: float) -> tuple[float, float, float, float, float]:
    """When and how a trajectory of the paper's body ends: time and spin, and then u3², normal force and determinant.

    It ends where one of these vanishes, or where the force grows beyond all bounds.  Force and determinant often vanish
    together, so that the force stays finite, and SciPy steps across.
    """
    turn = _turn(p["delta"])
    inverse = turn.T @ np.diag([p["a"] ** -2.0, p["b"] ** -2.0, p["c"] ** -2.0]) @ turn
    # The point (x0, y0, z) of the surface, with z > 0, where the normal of the surface is -u.
    point = np.array([x0, y0, 0.0])
    point[2] = p["c"] * np.sqrt(1 - point @ inverse @ point)
    u = -_unit(inverse @ point)

    def height(y: Vector) -> float:
        return 1 - y[0] ** 2 - y[1] ** 2

    def slopes(_: float, y: Vector) -> Vector:
        return _solution(y, p, "viscous")[0]

    events = [
        lambda _, y: _solution(y, p, "viscous")[1],  # lifts off
        lambda _, y: _solution(y, p, "viscous")[1] - 1e6,  # jams
        lambda _, y: height(y) - 1e-8,  # topples
        lambda _, y: _solution(y, p, "viscous")[3],
    ]
    for event in events:
        event.terminal = True  # type: ignore[attr-defined]
    with np.errstate(all="ignore"):
        solution = solve_ivp(
            slopes, (0, t_end), [*u[:2], *(n0 * u), 0.0, 0.0], "DOP853", rtol=1e-11, atol=1e-14, events=events
        )  # fmt: skip
    assert solution.status == 1
    y, time = solution.y[:, -1], solution.t[-1]
    rates, force, _, determinant = _solution(y, p, "viscous")
    down, left = np.array([*y[:2], -np.sqrt(height(y))]), 0.0
    if len(solution.t_events[2]):  # u3 vanishes linearly in time, so u3² does like its square
        left = height(y) / (y[:2] @ rates[:2])
    spin = y[2:5] @ down + left * rates[2:5] @ down
    return time + left, spin, height(y), force, determinant
