"""The bodies in `configs/`: their numbers are what their first lines say, and they turn the way they should."""

import re
import runpy
from math import pi
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support import ROOT

import sweep
from sweep.config import load_config

INERTIA = runpy.run_path(str(ROOT / "scripts" / "body_inertia.py"))
COMPUTED = [path for path in sorted((ROOT / "configs").glob("*.yaml")) if "body_inertia.py" in path.read_text()]


def test_half_an_ellipsoid() -> None:
    a, b, c, density = 0.08, 0.03, 0.02, 1000.0
    found = INERTIA["properties"]((a, b, c), c, (1.0, 1.0), 0.3, density)
    mass, low = 2 / 3 * pi * a * b * c * density, 3 / 8 * c
    expected = {"mass": mass, "offset": low, "Ixx": mass * ((b**2 + c**2) / 5 - low**2), "Ixy": 0.0}
    expected |= {"Iyy": mass * ((a**2 + c**2) / 5 - low**2), "Izz": mass * (a**2 + b**2) / 5}
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=1e-12, abs=1e-18), name


def test_a_turned_outline_turns_the_inertia() -> None:
    """A thin disc of a flat hull: the long axis of the mass goes from x towards y."""
    found = INERTIA["properties"]((9.0, 9.0, 1.0), 0.5, (0.2, 0.04), 0.1, 1000.0)
    angle = 0.5 * np.arctan2(-2 * found["Ixy"], found["Iyy"] - found["Ixx"])
    assert angle == pytest.approx(0.1, abs=1e-6)


@pytest.mark.parametrize("path", COMPUTED, ids=lambda path: path.stem)
def test_numbers_are_those_of_the_shape(path: Path) -> None:
    (command,) = re.findall(r"^# \$ python scripts/body_inertia.py (.*)$", path.read_text(), re.MULTILINE)
    given = load_config(path).parameters
    for name, value in INERTIA["parse"](command.split()).items():
        assert given[name].numbers[0] == pytest.approx(value, rel=6e-5), name


def test_there_are_three_computed_bodies() -> None:
    assert [path.stem for path in COMPUTED] == ["pebble", "plastic_toy", "wooden"]


def kuypers(time: float) -> float:
    """The spin of his body, in his axes with z up: angles α and β, F in place of -Ixy, and P below G."""
    I1, I2, I3, delta, squares = 2e-4, 1.6e-3, 1.7e-3, 0.1, np.array([0.2, 0.03, 0.02]) ** 2
    A, B = ((I1 + I2) / 2 + sign * (I1 - I2) / 2 * np.cos(2 * delta) for sign in (1, -1))
    F = -(I1 - I2) / 2 * np.sin(2 * delta)
    J, g, c = np.array([[A, -F, 0], [-F, B, 0], [0, 0, I3]]), 9.81, 1e-4

    def down(alpha: complex, beta: complex) -> np.ndarray:
        return np.array([np.cos(alpha) * np.sin(beta), -np.sin(alpha), -np.cos(alpha) * np.cos(beta)])

    def contact(alpha: complex, beta: complex) -> np.ndarray:
        mu = down(alpha, beta)
        return squares * mu / np.sqrt(squares @ (mu * mu)) + np.array([0, 0, 1e-3])

    def slopes(_: float, y: np.ndarray) -> np.ndarray:
        alpha, beta, omega = y[0], y[1], y[2:]
        turn = (omega[2] * np.cos(beta) - omega[0] * np.sin(beta)) / np.cos(alpha)
        rates = omega[0] * np.cos(beta) + omega[2] * np.sin(beta), omega[1] - turn * np.sin(alpha)
        x, mu = contact(alpha, beta), down(alpha, beta)
        moving = contact(alpha + 1e-30j * rates[0], beta + 1e-30j * rates[1]).imag / 1e-30
        pull = -np.cross(omega, moving + np.cross(omega, x)) - g * mu
        torque = np.cross(x, pull) - np.cross(omega, J @ omega) - c * omega
        return np.array([*rates, *np.linalg.solve(J + (x @ x) * np.eye(3) - np.outer(x, x), torque)])

    end = solve_ivp(slopes, (0, time), [-0.02, -0.02, 0, 0, -8.0], "DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
    return float(-end[2:] @ down(*end[:2]))


def test_the_wackelstein_is_kuypers() -> None:
    """His axes point up, ours down."""
    found = sweep.run(ROOT / "configs" / "wackelstein.yaml", omega3=[8.0], t_end=2.0)
    assert float(found["spin_final"][0]) == pytest.approx(kuypers(float(found["t_stop"][0])), abs=1e-7)
    assert int(found["reversals"][0]) == 1


@pytest.mark.parametrize(
    ("name", "reverses"),
    [("plastic_toy", 4.0), ("pebble", 4.0), pytest.param("wooden", -4.0, marks=pytest.mark.campaign)],
)
def test_which_way_a_body_reverses(name: str, reverses: float) -> None:
    fixed = {"sigma": 5e-6} if name == "wooden" else {"mu": 0.3}
    found = sweep.run(ROOT / "configs" / f"{name}.yaml", n0=[reverses, -reverses], t_end=6.0, **fixed)
    assert (found["reversals"] > 0).values.tolist() == [True, False]
