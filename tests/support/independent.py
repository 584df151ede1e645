"""The slip model derived a second way, for comparison: Newton and Euler with the force unknown.

The contact is not solved by hand: the unknowns (ω', v_g', R) come from a linear system that states
Euler's equation, Newton's equation and that the contact point does not leave the plane.
"""

from __future__ import annotations

import numpy as np


def contact(u: np.ndarray, a: float, b: float, c: float, delta: float) -> np.ndarray:
    turn = np.array([[np.cos(delta), -np.sin(delta), 0], [np.sin(delta), np.cos(delta), 0], [0, 0, 1]])
    A = turn.T @ np.diag([a**2, b**2, c**2]) @ turn
    return -A @ u / np.sqrt(u @ A @ u)


def derivative(states: np.ndarray, a: float, b: float, c: float, delta: float, mu: float) -> tuple[np.ndarray, float]:
    """y' and the normal force R for y = (u1, u2, ω1, ω2, ω3, v1, v2)."""
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
    return np.array([du[0], du[1], *domega, dv_p[0], dv_p[1]]), R


def _unit(u: np.ndarray) -> np.ndarray:
    return u / np.linalg.norm(u)
