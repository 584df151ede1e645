"""How the bodies of trajectories turn and travel over the table, beside an independent derivation and integrator."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import newton, own
from support.physics import KANE_LEVINSON
from support.runs import Heard

import sweep
from sweep.config import load_config
from sweep.models.model import stack

SERIES = ("heading", "roll_angle", "pitch_angle", "table_x", "table_y")

PAPERS = {
    "body": {"a": 10, "b": 3, "delta": 0.1}, "friction": {"mu": 20},
    "start": {"n0": 0.3, "x0": 1.0, "y0": -0.4},
}  # fmt: skip
STONE: dict[str, Any] = {
    "units": "SI", "gravity": 9.81, "body": {n: v for n, v in KANE_LEVINSON.items() if n != "gravity"},
    "friction": {"mu": 5.0},
    "start": {"roll": 0.02, "pitch": -0.03, "omega1": 0.1, "omega2": -0.2, "omega3": -5, "slip1": 0.01, "slip2": 0.02},
}  # fmt: skip
BOWL = {
    **STONE, "body": {"surface": "paraboloid", "a": 0.1, "b": 0.3, "c": 0.02, "offset": 0.005, "mass": 0.5,
                      "Ixx": 1e-4, "Iyy": 5e-4, "Izz": 5.5e-4, "Ixy": 3e-5},
}  # fmt: skip
FAR_UP = BOWL | {"friction": {"mu": 20, "sigma": 1e-4}, "start": {"n0": -5, "x0": 0.04, "y0": 0.004}}
"""It starts from a contact point far up its sides, where it differs from the ellipsoid of the same curvatures."""
SLIDING = STONE | {"start": STONE["start"] | {"slip1": 0.2}}
DRY = SLIDING | {"friction": {"law": "coulomb", "regularisation": "tanh", "mu": 0.5, "speed": 0.02, "sigma": 1e-4}}
FADING = SLIDING | {"model": "fading.py", "friction": {"mu": 0.5, "speed": 0.01, "fading": 0.1, "sigma": 1e-4}}
SPINNING = STONE | {"friction": {"mu": 20, "mu_spinning": 0.2, "radius_spinning": 2e-3, "speed_spinning": 0.5}}
ROLLING = {**PAPERS, "model": "noslip", "friction": {}}


@pytest.mark.parametrize(
    ("scene", "law", "t_end"),
    [
        (PAPERS, "viscous", 10.0),
        pytest.param(ROLLING, None, 40.0, marks=pytest.mark.campaign),
        pytest.param(STONE, "viscous", 1.0, marks=pytest.mark.campaign),
        pytest.param(BOWL, "viscous", 1.0, marks=pytest.mark.campaign),
        pytest.param(FAR_UP, "viscous", 0.4, marks=pytest.mark.campaign),
        pytest.param(DRY, "coulomb-tanh", 0.5, marks=pytest.mark.campaign),
        pytest.param(FADING, "fading", 0.5, marks=pytest.mark.campaign),
        pytest.param(SPINNING, "viscous", 1.0, marks=pytest.mark.campaign),
    ],
    ids=["slip", "noslip", "general", "paraboloid", "far up", "dry", "own law", "spinning"],
)  # fmt: skip
def test_attitude_and_path_are_those_of_newton_and_euler(
    scene: dict[str, Any], law: str | None, t_end: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(own.write(tmp_path))  # where fading.py is
    config, told = load_config(scene, {"t_end": t_end, "tolerance": 1e-12}), Heard()
    cell, model = config.grid.columns(), config.equations
    parameters = {"surface": scene["body"].get("surface")} | {name: float(v[0]) for name, v in cell.items()}
    one = sweep.trajectory(config, every=t_end / 50, reporter=told).isel(trajectory=0)
    assert {progress.unit for progress in told.seen} == {"s" if "units" in scene else "sqrt(c/g)"}
    assert one["energy_error"] < 1e-7
    assert one.attrs.get("surface") == parameters["surface"]
    if "x0" in parameters:
        assert one["contact_x"][0] == pytest.approx(parameters["x0"], rel=1e-12)
        assert one["contact_y"][0] == pytest.approx(parameters["y0"], rel=1e-12)
    expected = newton.pose(stack(model.start(cell))[:, 0], parameters, law, one["time"].values)
    for name, values in zip(SERIES, expected, strict=True):
        size = parameters["c"] if name.startswith("table") else 1.0
        assert np.ptp(values) > 0.02 * size
        np.testing.assert_allclose(one[name], values, rtol=0, atol=1e-9 * size, err_msg=name)
