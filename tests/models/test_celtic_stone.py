"""The Celtic stone of Borisov and Mamaev, against their equations in M and γ, and against what is known of it."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support import ROOT
from support.newton import cross

import sweep

CONFIG = ROOT / "configs" / "celtic_stone.yaml"
BOWLS, G = np.array([9.0, 4.0]), 100.0
STONE = {"I1": 2.0, "I2": 6.0, "I3": 7.0, "a1": 9.0, "a2": 4.0, "delta": 0.485, "E": 752.0, "roll": 0.02,
         "pitch": -0.02, "omega1": 0.0, "omega2": 0.0, "omega3": -1.0}  # fmt: skip
CYCLE = {"roll": -0.655, "pitch": 0.369, "omega1": -0.245, "omega2": -0.909, "omega3": -0.337}
"""A start near the cycle that becomes Lorenz-like, with I1 = 2 and delta = 0.485."""
FLIP = np.array([1.0, -1.0, -1.0])
"""From the axes of `sweep`, in which z points down."""


def turn(p: dict[str, float]) -> np.ndarray:
    """From the axes of the surface to those of inertia."""
    c, s = np.cos(p["delta"]), np.sin(p["delta"])
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def contact(up: np.ndarray, p: dict[str, float]) -> np.ndarray:
    x = -BOWLS * (t := (turn(p).T @ up)[:2] / up[2])
    return turn(p) @ np.array([*x, -1 - x @ t / 2])


def matrix(r: np.ndarray, p: dict[str, float]) -> np.ndarray:
    """M = (this) ω."""
    return np.diag([p["I1"], p["I2"], p["I3"]]) + (r @ r) * np.eye(3) - np.outer(r, r)


def motion(z: np.ndarray, p: dict[str, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """z' for z = (M, γ), ω and r."""
    M, up = z[:3], z[3:]
    r = contact(up, p)
    w = np.linalg.solve(matrix(r, p), M)
    moves = cross(up, w)
    x, t = turn(p).T @ r, (turn(p).T @ up) / up[2]
    dt = ((turn(p).T @ moves)[:2] - t[:2] * moves[2]) / up[2]
    dr = turn(p) @ np.array([*(-BOWLS * dt), -x[:2] @ dt])
    return np.concatenate([cross(M, w) + cross(dr, cross(w, r)) + G * cross(r, up), moves]), w, r


def to_theirs(y: np.ndarray, p: dict[str, float]) -> np.ndarray:
    """(M, γ) of the states (u1, u2, ω1, ω2, ω3)."""
    up = turn(p) @ (FLIP * np.array([y[0], y[1], -np.sqrt(1 - y[0] ** 2 - y[1] ** 2)]))
    return np.concatenate([matrix(contact(up, p), p) @ turn(p) @ (FLIP * y[2:]), up])


def energy(z: np.ndarray, p: dict[str, float]) -> float:
    _, w, r = motion(z, p)
    return float(z[:3] @ w / 2 - G * r @ z[3:])


def normal_force(z: np.ndarray, p: dict[str, float]) -> float:
    """g + the second derivative of the height -r·γ of the centre of mass, whose first is -r·γ'."""

    def climbs(z: np.ndarray) -> np.ndarray:
        slopes, _, r = motion(z, p)
        return np.asarray(-r @ slopes[3:])

    return float(G + climbs(z + 1e-30j * motion(z, p)[0]).imag / 1e-30)  # a complex step


def set_off(p: dict[str, float]) -> np.ndarray:
    """The states at the start, by the energy."""
    y = np.array([np.cos(p["roll"]) * np.sin(p["pitch"]), -np.sin(p["roll"]), *(p[f"omega{i}"] for i in (1, 2, 3))])
    still, turning = (energy(to_theirs(y * [1, 1, k, k, k], p), p) for k in (0, 1))
    y[2:] *= np.sqrt((p["E"] - still) / (turning - still))
    return y


@pytest.mark.campaign
@pytest.mark.parametrize("more", [{}, CYCLE, {"I1": 5.0, "delta": -0.2, "E": 500.0}], ids=["still", "cycle", "other"])
def test_it_moves_by_the_equations_of_borisov_and_mamaev_and_the_plane_has_to_pull(more: dict[str, float]) -> None:
    stone = STONE | more
    one = sweep.trajectory(CONFIG, every=0.05, t_end=2, tolerance=1e-12, **stone).isel(trajectory=0)
    times = one["time"].values
    z = solve_ivp(lambda _, z: motion(z, stone)[0], (0, times[-1]), to_theirs(set_off(stone), stone), "DOP853",
                  times, rtol=1e-12, atol=1e-12).y.T  # fmt: skip
    assert energy(z[0], stone) == pytest.approx(stone["E"], rel=1e-13)
    spins = [motion(each, stone)[1] @ each[3:] for each in z]
    np.testing.assert_allclose(one["spin"], spins, rtol=0, atol=1e-6)
    forces = [normal_force(each, stone) for each in z]
    np.testing.assert_allclose(one["normal_force"], forces, rtol=1e-5, atol=1e-3)
    assert more or min(forces) < -0.5 * G


@pytest.mark.campaign
def test_a_stable_cycle_becomes_chaotic_beyond_its_period_doubling() -> None:
    """Its Floquet multipliers, computed apart from this, make it stable from 742 to 747.7 and a saddle at 752."""
    energies = [*np.linspace(743, 746, 8), *np.linspace(751.5, 752.5, 8)]
    found = sweep.run(CONFIG, t_end=400, progress=False, **(STONE | CYCLE | {"E": energies}))
    exponents = found["lyapunov"].values
    assert np.abs(exponents[:8]).max() < 0.02
    assert 0.008 < exponents[8:].mean() < 0.04
    assert float(found["energy_error"].max()) < 1e-6
