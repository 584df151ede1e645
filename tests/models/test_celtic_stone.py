"""The Celtic stone of Borisov and Mamaev, against their equations in M and γ, and against what is known of it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support import ROOT
from support.kernels import finish

import sweep
from sweep.kernels.layout import BLOCK
from sweep.kernels.methods import make_kernel
from sweep.models.model import stack

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
    moves = np.cross(up, w)
    x, t = turn(p).T @ r, (turn(p).T @ up) / up[2]
    dt = ((turn(p).T @ moves)[:2] - t[:2] * moves[2]) / up[2]
    dr = turn(p) @ np.array([*(-BOWLS * dt), -x[:2] @ dt])
    return np.concatenate([np.cross(M, w) + np.cross(dr, np.cross(w, r)) + G * np.cross(r, up), moves]), w, r


def slope(function, z: np.ndarray, way: np.ndarray):  # type: ignore[no-untyped-def]
    """The derivative along `way`, by a complex step."""
    return function(z + 1e-30j * way).imag / 1e-30


def to_theirs(y: np.ndarray, p: dict[str, float]) -> np.ndarray:
    """(M, γ) of the states (u1, u2, ω1, ω2, ω3)."""
    up = turn(p) @ (FLIP * np.array([y[0], y[1], -np.sqrt(1 - y[0] ** 2 - y[1] ** 2)]))
    return np.concatenate([matrix(contact(up, p), p) @ turn(p) @ (FLIP * y[2:]), up])


def to_ours(z: np.ndarray, p: dict[str, float]) -> np.ndarray:
    return np.concatenate([(FLIP * (turn(p).T @ z[3:]))[:2], FLIP * (turn(p).T @ motion(z, p)[1])])


def energy(z: np.ndarray, p: dict[str, float]) -> float:
    _, w, r = motion(z, p)
    return float(z[:3] @ w / 2 - G * r @ z[3:])


def normal_force(z: np.ndarray, p: dict[str, float]) -> float:
    """g + the second derivative of the height -r·γ of the centre of mass, whose first is -r·γ'."""

    def climbs(z: np.ndarray) -> np.ndarray:
        slopes, _, r = motion(z, p)
        return np.asarray(-r @ slopes[3:])

    return float(G + slope(climbs, z, motion(z, p)[0]))


def set_off(p: dict[str, float]) -> np.ndarray:
    """The states at the start, by the energy."""
    y = np.array([np.cos(p["roll"]) * np.sin(p["pitch"]), -np.sin(p["roll"]), *(p[f"omega{i}"] for i in (1, 2, 3))])
    still, turning = (energy(to_theirs(y * [1, 1, k, k, k], p), p) for k in (0, 1))
    y[2:] *= np.sqrt((p["E"] - still) / (turning - still))
    return y


def test_it_moves_by_the_equations_of_borisov_and_mamaev_and_the_plane_has_to_pull() -> None:
    one = sweep.trajectory(CONFIG, t_end=2, tolerance=1e-12, every=0.05, **STONE).isel(trajectory=0)
    times = one["time"].values
    z = solve_ivp(lambda _, z: motion(z, STONE)[0], (0, times[-1]), to_theirs(set_off(STONE), STONE), "DOP853",
                  times, rtol=1e-12, atol=1e-12).y.T  # fmt: skip
    assert energy(z[0], STONE) == pytest.approx(752, rel=1e-13)
    spins = [motion(each, STONE)[1] @ each[3:] for each in z]
    np.testing.assert_allclose(one["spin"], spins, rtol=0, atol=1e-6)
    forces = [normal_force(each, STONE) for each in z]
    np.testing.assert_allclose(one["normal_force"], forces, rtol=1e-5, atol=1e-3)
    assert min(forces) < -0.5 * G


def test_the_exponent_is_that_of_their_equations() -> None:
    """Over the very same stretch, from the same direction, on three motions: the tangent is carried in M and γ."""
    cells = [STONE, STONE | CYCLE, STONE | {"I1": 5.0, "delta": -0.2, "E": 500.0}]
    config = sweep.load_config(CONFIG)
    made = make_kernel("dopri5", config.equations, config.measure, config.integrator.tolerance)
    body = {name: np.array([cell[name] for cell in cells]) for name in STONE}
    table = made.images(body, np.full(3, 6e-4), 1.0, None)
    table = made.table(finish(made, table, settle=False))
    measured = next(each for each in made.measurements if each.name == "lyapunov")
    found = measured.read(table, np.empty(0))["lyapunov"]
    starts = stack(config.equations.start(body)).T
    for i, p in enumerate(cells):
        full, length = int(table["full_bins"][i]), table["bin_width"][i] * BLOCK * table["step"][i]
        np.testing.assert_allclose(starts[i], set_off(p), rtol=1e-12, atol=1e-13)
        assert found[i] == pytest.approx(growth(p, (full - full // 2) * length, full * length), abs=1e-4)


def growth(p: dict[str, float], begin: float, end: float) -> float:
    """The mean rate at which a tangent (1, …, 1) to the states grows between two times."""

    def both(_: float, q: np.ndarray) -> np.ndarray:
        return np.concatenate([motion(q[:6], p)[0], slope(lambda z: motion(z, p)[0], q[:6], q[6:])])

    y = set_off(p)
    q = np.concatenate([to_theirs(y, p), slope(lambda y: to_theirs(y, p), y, np.full(5, 5**-0.5))])
    found = solve_ivp(both, (0, end), q, "DOP853", (begin, end), rtol=1e-10, atol=1e-10).y.T
    first, last = (np.linalg.norm(slope(lambda z: to_ours(z, p), each[:6], each[6:])) for each in found)
    return float(np.log(last / first) / (end - begin))


def test_a_stable_cycle_becomes_chaotic_beyond_its_period_doubling() -> None:
    """Its Floquet multipliers, computed apart from this, make it stable from 742 to 747.7 and a saddle at 752."""
    energies = [*np.linspace(743, 746, 8), *np.linspace(751.5, 752.5, 8)]
    found = sweep.run(CONFIG, t_end=400, progress=False, **(STONE | CYCLE | {"E": energies}))
    exponents = found["lyapunov"].values
    assert np.abs(exponents[:8]).max() < 0.02
    assert 0.008 < exponents[8:].mean() < 0.04
    assert float(found["energy_error"].max()) < 1e-6
