"""Single trajectories."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner

import sweep
from sweep import ConfigError
from sweep.cli import main
from sweep.plots.trajectories import reversal_times

Write = Callable[..., Path]
STANDARD = "name: standard\nfriction: {mu: [60, 75]}\nintegrator: {t_end: 1500}\n"


def test_sampling_does_not_touch_the_steps(write: Write) -> None:
    swept = sweep.run(write(STANDARD), method="dopri5")
    followed = sweep.trajectory(write(STANDARD), mu=[60, 75], every=3.0)
    np.testing.assert_array_equal(followed.spin_final, swept.spin_final)
    np.testing.assert_array_equal(followed.energy_error, swept.energy_error)
    for i in range(2):
        last = followed.isel(trajectory=i).dropna("sample")
        assert float(last.spin[-1]) == float(swept.spin_final[i])
        assert float(last.time[-1]) == pytest.approx(float(swept.t_stop[i]), rel=1e-15)
        assert float(last.time[0]) == 0


def test_trajectory_shows_the_motion(write: Write) -> None:
    one = sweep.trajectory(write(STANDARD), mu=60).isel(trajectory=0)
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


@pytest.mark.parametrize(
    "model", ["averaged", *(pytest.param(name, marks=pytest.mark.campaign) for name in ("noslip", "effective"))]
)
def test_trajectories_of_every_model(model: str, write: Write) -> None:
    config = sweep.load_config(write(STANDARD), {"model": model, "mu": 60.0, "t_end": 50.0})
    series = sweep.trajectory(config)
    assert float(series.spin[0, 0]) == pytest.approx(0.05)
    assert np.isfinite(series.spin).all()


@pytest.mark.parametrize(
    ("at", "said"),
    [
        ({"mu": -1}, "mu: -1 is out of bounds; allowed"),
        ({"nu": 1}, "no parameter"),
        ({"x0": 20}, "off the ellipsoid"),
        ({"n0": np.nan}, "nan"),
    ],
)
def test_impossible_cells_are_refused(at: dict[str, float], said: str, write: Write) -> None:
    with pytest.raises(ConfigError, match=said):
        sweep.trajectory(write(STANDARD), **at)


def test_trajectory_command(write: Write, tmp_path: Path) -> None:
    command = [
        "trajectory",
        write(STANDARD),
        "--at",
        "mu=60",
        "--at",
        "mu=75",
        "--at",
        "n0=0.02",
        "--output",
        tmp_path / "o",
    ]
    result = CliRunner().invoke(main, [*map(str, command), "--set", "t_end=30"], catch_exceptions=False)
    assert result.exit_code == 0
    stored = xr.load_dataset(tmp_path / "o" / "standard_trajectory.nc")
    assert stored.sizes["trajectory"] == 2
    np.testing.assert_array_equal(stored.mu, [60, 75])
    np.testing.assert_array_equal(stored.n0, [0.02, 0.02])
    assert all({"long_name", "units"} <= set(v.attrs) for v in stored.variables.values())
    assert (tmp_path / "o" / "standard_trajectory.png").read_bytes().startswith(b"\x89PNG")
    wrong = CliRunner().invoke(main, ["trajectory", str(write(STANDARD)), "--at", "mu"])
    assert (wrong.exit_code, "NAME=NUMBER" in wrong.stderr) == (2, True)


def test_first_reversal_is_measured_on_request(write: Write) -> None:
    dataset = sweep.run(write(STANDARD), measure=["reversals", "first_reversal"])
    one = sweep.trajectory(write(STANDARD), mu=60).isel(trajectory=0)
    assert float(dataset.t_first_reversal[0]) == pytest.approx(reversal_times(one)[0], abs=0.05)
    with pytest.raises(ConfigError, match="allowed: reversals beside it"):
        sweep.load_config(write(STANDARD), {"measure": ["first_reversal"]})
