"""The example of a user's model: the tippe top, against Newton and Euler's equations of a body and published theory."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support import ROOT
from support.newton import cross
from support.runs import settled

import sweep

CONFIG = ROOT / "configs" / "tippe_top.yaml"
TOP = {"eccentricity": 0.3, "ratio": 0.936, "C": 0.4, "mu": 0.3, "n0": 6.0, "tilt": 0.1}
Z = np.array([0.0, 0.0, 1.0])


def slopes(y: np.ndarray, p: dict[str, float]) -> np.ndarray:
    """Of the matrix that turns body axes into space, the angular velocity and the velocity of G, both in space.

    Nothing is solved by hand: the accelerations and the normal force are unknowns of one linear system.
    """
    turned, w, v = y[:9].reshape(3, 3), y[9:12], y[12:]
    e, C = turned[:, 2], p["C"]
    a = p["eccentricity"] * e - Z
    inertia = turned @ np.diag([p["ratio"] * C, p["ratio"] * C, C]) @ turned.T
    force = Z - p["mu"] * (v + cross(w, a))  # per unit of the normal force
    moving = p["eccentricity"] * cross(w, e)
    matrix, right = np.zeros((7, 7)), np.zeros(7)
    matrix[:3, :3], matrix[:3, 6], right[:3] = np.eye(3), -force, -Z
    matrix[3:6, 3:6], matrix[3:6, 6] = inertia, -cross(a, force)
    right[3:6] = -cross(w, inertia @ w)
    # The velocity of the contact point has no vertical part.
    matrix[6, :3], matrix[6, 3:6], right[6] = Z, cross(a, Z), -cross(w, moving) @ Z
    found = np.linalg.solve(matrix, right)
    return np.concatenate([np.cross(w, turned.T).T.ravel(), found[3:6], found[:3]])


def at_start(p: dict[str, float]) -> np.ndarray:
    sin, cos = np.sin(p["tilt"]), np.cos(p["tilt"])
    turned = np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]])
    return np.concatenate([turned.ravel(), p["n0"] * turned[:, 2], np.zeros(3)])


@pytest.mark.campaign
@pytest.mark.parametrize(
    "more", [{"tilt": 1.0}, {"eccentricity": 0.2, "ratio": 1.4, "C": 0.35, "mu": 1.0, "n0": 5.0, "tilt": 0.4}]
)
def test_a_tippe_top_moves_as_newton_and_euler_say(more: dict[str, float]) -> None:
    top = TOP | more
    asked = {**top, "t_end": 15, "stop_early": False}
    one = sweep.trajectory(CONFIG, tolerance=1e-12, every=1.0, **asked)
    start, times = at_start(top), one["time"].values
    y = solve_ivp(lambda _, y: slopes(y, top), (0, times[-1]), start, "DOP853", times, rtol=1e-12, atol=1e-13).y
    e = y[:9].reshape(3, 3, -1)[:, 2]
    np.testing.assert_allclose(one["spin"], (y[9:12] * e).sum(axis=0), rtol=0, atol=2e-9)
    np.testing.assert_allclose(one["inclination"], np.arccos(e[2]), rtol=0, atol=1e-7)


def test_a_tippe_top_turns_over_while_energy_balances_and_jelletts_integral_stays() -> None:
    one = sweep.trajectory(CONFIG, t_end=100, stop_early=False, **TOP)
    assert one["inclination"].min() < 0.2
    assert one["inclination"].max() > 3.0
    assert int(one["reversals"]) == 1
    lost = float(one["energy"][0] - one["energy"][-1])
    assert lost > 0.5 * float(one["energy"][0])
    total = one["energy"] + one["dissipated"]
    np.testing.assert_allclose(total, total[0], rtol=1e-7)
    assert float(one["energy_error"]) < 1e-7
    jellett = TOP["C"] * TOP["n0"] * (np.cos(TOP["tilt"]) - TOP["eccentricity"])
    np.testing.assert_allclose(one["jellett"], jellett, rtol=1e-8)


def test_a_tippe_top_turns_over_completely_if_its_moments_are_in_the_published_range() -> None:
    """1 - α < A/C < 1 + α; below it does not turn over, above not completely."""
    tops = {**TOP, "mu": 1.0, "ratio": [0.6, 0.9, 1.1, 1.5]}
    ends = sweep.run(CONFIG, t_end=2000, stop_early=False, **tops)
    alpha, ratio = TOP["eccentricity"], ends["ratio"]
    upside_down = -TOP["n0"] * (np.cos(TOP["tilt"]) - alpha) / (1 + alpha)
    np.testing.assert_array_equal(
        np.abs(ends["spin_final"] - upside_down) < 1e-6, (1 - alpha < ratio) & (ratio < 1 + alpha)
    )
    assert ends["reversals"].values.tolist() == [0, 1, 1, 1]


@pytest.mark.campaign
def test_the_map_shows_where_it_turns_over() -> None:
    """Fast tops turn over from α = 1 - A/C on, slow ones never: upright spin is stable for them."""
    counts = sweep.run(CONFIG, eccentricity=[0.04, 0.055, 0.08, 0.2, 0.3], n0=[1.0, 7.0])["reversals"]
    assert counts.sel(n0=7.0).values.ravel().tolist() == [0, 0, 1, 1, 1]
    assert not counts.sel(n0=1.0).any()


@pytest.mark.release
def test_no_settled_top_reverses_later() -> None:
    """Tops of any shape, started at any inclination; some of them reverse a dozen times."""
    draw, n = np.random.default_rng(1).uniform, 400
    tops = {"eccentricity": draw(0.01, 0.6, n), "ratio": draw(0.6, 1.8, n), "C": draw(0.2, 0.6, n)}
    tops |= {"mu": 10 ** draw(-2, 0.5, n), "n0": draw(0.2, 8, n), "tilt": draw(0, 3, n)}
    asked = {"model": str(CONFIG.with_suffix(".py")), "cases": tops, "max_failed_fraction": 1}
    ends, later, which = settled(asked, 0.7, t_end=1000)
    for low, high in ((0, 0), (1, 1), (2, 99)):
        assert (which & (low <= ends["reversals"]) & (ends["reversals"] <= high)).any()
    assert (ends["spin_final"] * later["spin_final"] > 0).values[which].all()


def test_the_automatic_step_keeps_the_tolerance() -> None:
    asked = {**TOP, "n0": [2.0, 6.0], "eccentricity": [0.1, 0.3], "t_end": 100, "stop_early": False}
    exact = sweep.run(CONFIG, tolerance=1e-13, **asked)["spin_final"]
    for tolerance in (1e-6, 1e-8, 1e-10):
        found = sweep.run(CONFIG, tolerance=tolerance, **asked)["spin_final"]
        assert abs(found - exact).max() < tolerance
