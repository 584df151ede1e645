"""The slip model derived a second way, for comparison: Newton and Euler with the force unknown.

The contact is not solved by hand: the unknowns (ω', v_g', R) come from a linear system that states
Euler's equation, Newton's equation and that the contact point does not leave the plane.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp


def contact(u: np.ndarray, a: float, b: float, c: float, delta: float) -> np.ndarray:
    turn = _turn(delta)
    A = turn.T @ np.diag([a**2, b**2, c**2]) @ turn
    return -A @ u / np.sqrt(u @ A @ u)


def derivative(states: np.ndarray, a: float, b: float, c: float, delta: float, mu: float) -> tuple[np.ndarray, float]:
    """y' and the normal force R for y = (u1, u2, ω1, ω2, ω3, v1, v2)."""
    slopes, R, _ = _solution(states, a, b, c, delta, mu)
    return slopes, R


def _solution(
    states: np.ndarray, a: float, b: float, c: float, delta: float, mu: float
) -> tuple[np.ndarray, float, float]:
    """As `derivative`, and the determinant of the linear system, which vanishes where no force solves it."""
    u = np.array([*states[:2], -np.sqrt(1 - states[0] ** 2 - states[1] ** 2)])
    omega = states[2:5]
    v_p = np.array([*states[5:], -(states[5] * u[0] + states[6] * u[1]) / u[2]])
    inertia = np.diag([b**2 + c**2, a**2 + c**2, a**2 + b**2]) / 5
    du = np.cross(u, omega)
    x_p = contact(u, a, b, c, delta)
    eps = 1e-6  # the contact point's velocity by central differences: no formula shared
    dx = (contact(_unit(u + eps * du), a, b, c, delta) - contact(_unit(u - eps * du), a, b, c, delta)) / (2 * eps)
    v_g = v_p + np.cross(x_p, omega)
    force = u - mu * v_p  # per unit of R

    # Unknowns: ω' (body), the inertial acceleration of the centre of mass, R.
    matrix, right = np.zeros((7, 7)), np.zeros(7)
    matrix[:3, :3], matrix[:3, 6] = inertia, -np.cross(x_p, force)
    right[:3] = -np.cross(omega, inertia @ omega)
    matrix[3:6, 3:6], matrix[3:6, 6] = np.eye(3), -force
    right[3:6] = -u
    # d/dt (v_p · u) = 0 with v_p = v_g - x_p × ω and u fixed in space:
    # (a_g - dx × ω - x_p × ω' - ω × (x_p × ω)) · u = 0
    matrix[6, 3:6] = u
    matrix[6, :3] = -np.cross(u, x_p)
    right[6] = (np.cross(dx, omega) + np.cross(omega, np.cross(x_p, omega))) @ u
    solution = np.linalg.solve(matrix, right)
    domega, accel, R = solution[:3], solution[3:6], solution[6]
    dv_g = accel - np.cross(omega, v_g)
    dv_p = dv_g - np.cross(dx, omega) - np.cross(x_p, domega)
    return np.array([du[0], du[1], *domega, dv_p[0], dv_p[1]]), R, np.linalg.det(matrix)


def _turn(delta: float) -> np.ndarray:
    return np.array([[np.cos(delta), -np.sin(delta), 0], [np.sin(delta), np.cos(delta), 0], [0, 0, 1]])


def _unit(u: np.ndarray) -> np.ndarray:
    return u / np.linalg.norm(u)


def end(
    a: float, b: float, c: float, delta: float, mu: float, n0: float, x0: float, y0: float, t_end: float
) -> tuple[float, float, float, float]:
    """When and how a trajectory ends, by SciPy: the time, and then u3², normal force and determinant.

    It ends where one of these vanishes, or where the force grows beyond all bounds.  Force and determinant often vanish
    together, so that the force stays finite, and SciPy steps across.
    """
    turn = _turn(delta)
    inverse = turn.T @ np.diag([a**-2.0, b**-2.0, c**-2.0]) @ turn
    # The point (x0, y0, z) of the surface, with z > 0, where the normal of the surface is -u.
    point = np.array([x0, y0, 0.0])
    point[2] = c * np.sqrt(1 - point @ inverse @ point)
    u = -_unit(inverse @ point)

    def slopes(_: float, y: np.ndarray) -> np.ndarray:
        return derivative(y, a, b, c, delta, mu)[0]

    def force(_: float, y: np.ndarray) -> float:
        return derivative(y, a, b, c, delta, mu)[1]

    def determinant(_: float, y: np.ndarray) -> float:
        return _solution(y, a, b, c, delta, mu)[2]

    def jams(_: float, y: np.ndarray) -> float:
        return force(0.0, y) - 1e4

    def topples(_: float, y: np.ndarray) -> float:
        return _height(y) - 1e-8

    events = [force, jams, topples, determinant]
    for event in events:
        event.terminal = True  # type: ignore[attr-defined]
    with np.errstate(all="ignore"):
        solution = solve_ivp(
            slopes, (0, t_end), [*u[:2], *(n0 * u), 0.0, 0.0], "DOP853",
            rtol=1e-9, atol=1e-12, events=events,
        )  # fmt: skip
    assert solution.status == 1
    y, time = solution.y[:, -1], solution.t[-1]
    if len(solution.t_events[2]):  # u3 vanishes linearly in time, so u3² does like its square
        time += _height(y) / (y[:2] @ slopes(time, y)[:2])
    return time, _height(y), force(time, y), determinant(time, y)


def _height(y: np.ndarray) -> float:
    """u3²."""
    return 1 - y[0] ** 2 - y[1] ** 2
