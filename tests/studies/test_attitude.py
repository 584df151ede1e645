"""How the bodies of trajectories turn and travel over the table, beside an independent derivation and integrator."""

from typing import Any

import numpy as np
import pytest
from support import newton
from support.physics import KANE_LEVINSON

import sweep
from sweep.config import load_config
from sweep.models.model import stack

SERIES = ("heading", "roll_angle", "pitch_angle", "table_x", "table_y")

PAPERS = {
    "body": {"a": 10, "b": 3, "delta": 0.1}, "friction": {"mu": 20},
    "start": {"n0": 0.3, "x0": 1.0, "y0": -0.4},
}  # fmt: skip
STONE = {
    "units": "SI", "gravity": 9.81, "body": {n: v for n, v in KANE_LEVINSON.items() if n != "gravity"},
    "friction": {"mu": 5.0},
    "start": {"roll": 0.02, "pitch": -0.03, "omega1": 0.1, "omega2": -0.2, "omega3": -5, "slip1": 0.01, "slip2": 0.02},
}  # fmt: skip
BOWL = {
    **STONE, "body": {"surface": "paraboloid", "a": 0.1, "b": 0.3, "c": 0.02, "offset": 0.005, "mass": 0.5,
                      "Ixx": 1e-4, "Iyy": 5e-4, "Izz": 5.5e-4, "Ixy": 3e-5},
}  # fmt: skip
ROLLING = {**PAPERS, "model": "noslip", "friction": {}}


@pytest.mark.parametrize(
    ("scene", "law", "t_end"),
    [
        (PAPERS, "viscous", 10.0),
        pytest.param(ROLLING, None, 40.0, marks=pytest.mark.campaign),
        pytest.param(STONE, "viscous", 1.0, marks=pytest.mark.campaign),
        pytest.param(BOWL, "viscous", 1.0, marks=pytest.mark.campaign),
    ],
    ids=["slip", "noslip", "general", "paraboloid"],
)  # fmt: skip
def test_attitude_and_path_are_those_of_newton_and_euler(scene: dict[str, Any], law: str | None, t_end: float) -> None:
    config = load_config(scene, {"t_end": t_end, "tolerance": 1e-12})
    cell, model = config.grid.columns(), config.equations
    parameters = {"surface": scene["body"].get("surface")} | {name: float(v[0]) for name, v in cell.items()}
    one = sweep.trajectory(config, every=t_end / 50).isel(trajectory=0)
    expected = newton.pose(stack(model.start(cell))[:, 0], parameters, law, one["time"].values)
    for name, values in zip(SERIES, expected, strict=True):
        size = parameters["c"] if name.startswith("table") else 1.0
        assert np.ptp(values) > 0.02 * size
        np.testing.assert_allclose(one[name], values, rtol=0, atol=1e-9 * size, err_msg=name)
