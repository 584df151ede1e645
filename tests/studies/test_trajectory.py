"""Single trajectories: their steps, their series, and how bodies turn and travel, beside an independent derivation."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from support import Write, newton, own
from support.physics import IN_SI
from support.runs import Heard

import sweep
from sweep.config import load_config
from sweep.models.model import stack
from sweep.plots.trajectories import reversal_times

SERIES = ("heading", "roll_angle", "pitch_angle", "table_x", "table_y")

PAPERS = {
    "body": {"a": 10, "b": 3, "delta": 0.1}, "friction": {"mu": 20},
    "start": {"n0": 0.3, "x0": 1.0, "y0": -0.4},
}  # fmt: skip
STONE: dict[str, Any] = IN_SI | {
    "friction": {"mu": 5.0},
    "start": {"roll": 0.02, "pitch": -0.03, "omega1": 0.1, "omega2": -0.2, "omega3": -5, "slip1": 0.01, "slip2": 0.02},
}
BOWL = {
    **STONE, "body": {"surface": "paraboloid", "a": 0.1, "b": 0.3, "c": 0.02, "offset": 0.005, "mass": 0.5,
                      "Ixx": 1e-4, "Iyy": 5e-4, "Izz": 5.5e-4, "Ixy": 3e-5},
}  # fmt: skip
FAR_UP = BOWL | {"friction": {"mu": 20}, "start": {"n0": -5, "x0": 0.04, "y0": 0.004}}
"""It starts from a contact point far up its sides, where it differs from the ellipsoid of the same curvatures."""
SLIDING = STONE | {"start": STONE["start"] | {"slip1": 0.2}}
DRY = SLIDING | {"friction": {"law": "coulomb", "mu": 0.5, "speed": 0.02, "sigma": 1e-4}}
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
        pytest.param(DRY, "coulomb", 0.5, marks=pytest.mark.campaign),
        pytest.param(FADING, "fading", 0.5, marks=pytest.mark.campaign),
        pytest.param(SPINNING, "viscous", 1.0, marks=pytest.mark.campaign),
    ],
    ids=["slip", "noslip", "general", "paraboloid", "far up", "dry", "own law", "spinning"],
)  # fmt: skip
def test_attitude_and_path_are_those_of_newton_and_euler(
    scene: dict[str, Any], law: str | None, t_end: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(own.write(tmp_path))  # where fading.py is
    config, heard = load_config(scene, {"t_end": t_end, "tolerance": 1e-12}), Heard()
    cell, model = config.grid.columns(), config.equations
    parameters = {"surface": scene["body"].get("surface")} | {name: float(v[0]) for name, v in cell.items()}
    one = sweep.trajectory(config, every=t_end / 50, progress=heard)
    assert {progress.unit for progress in heard.seen} == {"s" if "units" in scene else "sqrt(c/g)"}
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


STANDARD = "name: standard\nfriction: {mu: [60, 75]}\nintegrator: {t_end: 1500}\n"


def test_sampling_does_not_touch_the_steps(write: Write) -> None:
    swept = sweep.run(write(STANDARD), method="dopri5")
    followed = sweep.trajectory(write(STANDARD), every=3.0, stop_early=True)
    np.testing.assert_array_equal(followed.spin_final, swept.spin_final)
    np.testing.assert_array_equal(followed.energy_error, swept.energy_error)
    for i in range(2):
        last = followed.isel(mu=i).dropna("time")
        assert float(last.spin[-1]) == float(swept.spin_final[i])
        assert float(last.time[-1]) == pytest.approx(float(swept.t_stop[i]), rel=1e-15)
        assert float(last.time[0]) == 0


def test_trajectories_of_different_steps_are_sampled_at_the_same_times(write: Write) -> None:
    config = sweep.load_config(write(STANDARD), {"t_end": 60.0})
    both = sweep.trajectory(config, at={"mu": [60, 300]}, every=0.7)
    assert both.step[0] != both.step[1]
    assert both.spin.dims == ("mu", "time")
    np.testing.assert_allclose(both.time, np.append(np.arange(0, 60, 0.7), 60), atol=1e-11)
    for i, mu in enumerate((60, 300)):
        one = sweep.trajectory(config, mu=mu, every=1e-6)  # every step
        for name in ("spin", "contact_x", "dissipated", "ripple_free_spin"):
            expected = np.asarray(CubicSpline(one.time, one[name])(both.time))
            np.testing.assert_allclose(both[name][i], expected, rtol=0, atol=3e-7 * np.abs(expected).max())


@pytest.mark.parametrize("n0", [-0.006, -0.015])
def test_a_trajectory_goes_on_to_its_end_and_stays_where_a_sweep_says(n0: float, write: Write) -> None:
    """A sweep leaves both before t = 25; the rattle of the second grows later, and turns the spin."""
    config = sweep.load_config(write(STANDARD), {"mu": 75.0, "n0": n0, "t_end": 8000.0, "tolerance": 1e-8})
    swept, one = sweep.run(config), sweep.trajectory(config, every=20.0)
    assert float(swept.t_stop) < 25
    assert (float(one.t_stop), float(one.time[-1]), one.sizes["time"]) == (8000, pytest.approx(8000), 401)
    assert float(one.spin[-1]) == pytest.approx(float(swept.spin_rest), rel=4e-3)
    assert (one.status, one.reversals) == (swept.status, swept.reversals)
    assert bool(abs(one.spin[-1] / one.spin[0]) < 0.6) == (n0 == -0.015)


def test_a_trajectory_without_an_end_ends_when_it_has_settled(write: Write) -> None:
    assert float(sweep.trajectory(write(STANDARD), mu=75, n0=-0.006, t_end="settled").t_stop) < 20


def test_more_samples_than_memory_holds_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sweep.studies.trajectory.MAX_SAMPLES", 100)
    config = load_config({"friction": {"mu": 60}}, {"t_end": 60.0})
    with pytest.raises(sweep.InputError, match=r"every: the samples are too many .*; give 1\.2 "):
        sweep.trajectory(config, at={"b": [3, 4]}, every=1.1)
    assert sweep.trajectory(config, at={"b": [3, 4]}, every=1.2).sizes["time"] == 51


def test_a_trajectory_that_diverges_at_once_has_its_start(write: Write) -> None:
    """Its step is beyond the stability limit, about 2.8 over the fastest rate of friction, so that no step is whole."""
    one = sweep.trajectory(write(STANDARD), mu=100, method="dopri5", step=0.15)
    assert (one.sizes["time"], float(one.time[0]), float(one.t_stop)) == (1, 0, 0)
    assert one.sweep.diverged
    assert float(one.spin[0]) == pytest.approx(0.05)
    assert float(one.table_x[0]) == float(one.heading[0]) == 0


def test_the_last_samples_before_a_trajectory_diverges_give_no_warning() -> None:
    """The energy of some of them overflows.  Found by tests/machine."""
    body = {"a": 10, "b": 3, "c": 0.51, "delta": [0.06, 0.033]}
    start = {"n0": 0.3, "x0": np.linspace(0.015, 0.025, 24).tolist(), "y0": 0.01}
    settings = {"t_end": 300.0, "method": "dopri5", "tolerance": 1e-4}
    config = {"model": "effective", "body": body, "start": start, "friction": {"mu": 20.01}, "integrator": settings}
    found = sweep.trajectory(config)
    assert found.sweep.diverged.any()


def test_a_body_of_unknown_shape_is_not_drawn(write: Write) -> None:
    """A user's model has the attitude of a rigid body, and dimensions of its own."""
    other = sweep.trajectory(write(STANDARD), mu=60, t_end=60.0).rename({"a": "a1"})
    with pytest.raises(sweep.InputError, match="no a, b and c"):
        sweep.animate(other)


@pytest.mark.browser
def test_the_explorer_shows_no_body_of_unknown_shape(write: Write) -> None:
    from sweep.explorer.player import Player
    from sweep.explorer.runner import Curve

    one, player = sweep.trajectory(write(STANDARD), mu=60, t_end=60.0), Player([])
    for shown, dataset in ((True, one), (False, one.rename({"a": "a1"}))):
        player.show(Curve(dataset, np.zeros(0), 0.0), "#000000", 60.0)
        assert player.root.visible == shown


def test_series_are_missing_after_the_end_of_a_trajectory(write: Write) -> None:
    config = sweep.load_config(write(STANDARD), {"t_end": 8000.0})
    both = sweep.trajectory(config, at={"mu": 60, "n0": [0.001, 0.05]}, every=5.0, stop_early=True)
    assert both.t_stop[0] < both.t_stop[1] - 5
    for i in range(2):
        np.testing.assert_array_equal(np.isfinite(both.spin[i]), both.time <= both.t_stop[i] * (1 + 1e-12))
    assert np.isclose(both.time, both.t_stop[0]).any()


def test_trajectory_shows_the_motion(write: Write) -> None:
    one = sweep.trajectory(write(STANDARD), mu=60)
    assert all("long_name" in v.attrs for v in one.variables.values())
    assert float(one.contact_x[0]) == pytest.approx(0.01)
    assert float(one.contact_y[0]) == pytest.approx(0.01)
    # The slip's derivative, and the balance of energy and work, from the series themselves.
    # (once the slip has left its start at rest, in a hundredth of a period)
    settled = slice(50, None)
    slopes, rates = np.gradient(one.slip_2, one.time)[settled], one.slip_rate_2[settled]
    assert np.abs(slopes - rates).max() < 0.05 * np.abs(rates).max()
    balance = one.energy + one.dissipated
    assert float((balance - balance[0]).__abs__().max() / balance[0]) == pytest.approx(float(one.energy_error), rel=0.2)
    assert 0.7 < float(one.normal_force.min()) < 1 < float(one.normal_force.max()) < 1.4
    times = reversal_times(one)
    assert len(times) == int(one.reversals) == 2
    assert times[-1] == pytest.approx(float(one.t_last_reversal), abs=0.05)
