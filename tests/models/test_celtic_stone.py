"""The Celtic stone of Borisov and Mamaev, against Newton and Euler's equations and what is known of it."""

from typing import Any

import numpy as np
import pytest
from support import ROOT, newton
from support.physics import turned_inertia

import sweep

CONFIG = ROOT / "configs" / "celtic_stone.yaml"
G = 100.0
STONE = {"I1": 2.0, "I2": 6.0, "I3": 7.0, "a1": 9.0, "a2": 4.0, "delta": 0.485, "E": 752.0, "roll": 0.02,
         "pitch": -0.02, "omega1": 0.0, "omega2": 0.0, "omega3": -1.0}  # fmt: skip
CYCLE = {"roll": -0.655, "pitch": 0.369, "omega1": -0.245, "omega2": -0.909, "omega3": -0.337}
"""A start near the cycle that becomes Lorenz-like, with I1 = 2 and delta = 0.485."""


def in_its_surface(p: dict[str, float]) -> dict[str, Any]:
    """The body in the axes of its surface."""
    inertia = turned_inertia(p["I1"], p["I2"], p["I3"], p["delta"])
    shape = {"surface": "paraboloid", "a": 0.5 / p["a1"], "b": 0.5 / p["a2"], "c": 1.0, "offset": 0.0}
    return shape | inertia | {"mass": 1.0, "gravity": G}


def set_off(p: dict[str, float]) -> np.ndarray:
    """The states at the start, by the energy above that of the plane."""
    y = np.array([np.cos(p["roll"]) * np.sin(p["pitch"]), -np.sin(p["roll"]), *(p[f"omega{i}"] for i in (1, 2, 3))])
    y = newton.turned(y, -newton.axes(in_its_surface(p)))
    still, turning = (newton.energy(y * [1, 1, k, k, k], in_its_surface(p), None) + G for k in (0, 1))
    y[2:] *= np.sqrt((p["E"] - still) / (turning - still))
    return y


@pytest.mark.campaign
@pytest.mark.parametrize("more", [{}, CYCLE, {"I1": 5.0, "delta": -0.2, "E": 500.0}], ids=["still", "cycle", "other"])
def test_it_moves_as_newton_and_euler_say_and_the_plane_has_to_pull(more: dict[str, float]) -> None:
    stone = STONE | more
    one = sweep.trajectory(CONFIG, every=0.05, t_end=2, tolerance=1e-12, **stone).isel(trajectory=0)
    body = in_its_surface(stone)
    y = newton.follow(set_off(stone), body, None, one["time"].values)
    np.testing.assert_allclose(one["spin"], newton.spin(y), rtol=0, atol=1e-6)
    forces = [newton.derivative(each, body, None)[1] for each in y.T]
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
