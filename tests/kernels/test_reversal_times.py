"""The times of the first K reversals, from the kernel to the file."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from support import Write

import sweep

TEXT = """\
name: times
body: {b: 3.0}
friction: {mu: [60, 75, 100]}
start: {n0: 0.05}
integrator: {t_end: 3000, method: dopri5}
measure: [reversals, {reversal_times: 3}]
"""

# Checked against an independent integrator (design notes); a reversal lies within a window of 3.65.
EXPECTED = {60: [168.7, 720.1, 2379.9], 75: [167.3, 639.1, 1590.4], 100: [165.8, 577.7, 1217.5]}


@pytest.fixture(scope="module")
def config(kept: Write) -> Path:
    return kept(TEXT, "times.yaml")


@pytest.fixture(scope="module")
def found(config: Path) -> xr.Dataset:
    return sweep.run(config, config.parent)


@pytest.mark.parametrize("mu", EXPECTED)
def test_times_are_those_of_an_independent_integrator(found: xr.Dataset, mu: int) -> None:
    np.testing.assert_allclose(found.reversal_times.sel(mu=mu), EXPECTED[mu], atol=1.0)


@pytest.mark.campaign
def test_adams_finds_the_same_times(found: xr.Dataset, config: Path) -> None:
    np.testing.assert_allclose(sweep.run(config, method="adams").reversal_times, found.reversal_times, rtol=1e-5)


def test_later_reversals_are_counted_but_not_kept(found: xr.Dataset) -> None:
    assert found.reversals.sel(mu=100) == 4
    assert found.t_last_reversal.sel(mu=100) > found.reversal_times.sel(mu=100).max()
    last = found.reversal_times.sel(mu=[60, 75]).isel(reversal=-1)
    np.testing.assert_array_equal(last, found.t_last_reversal.sel(mu=[60, 75]))


def test_reversals_that_have_not_happened_have_no_time(write: Write) -> None:
    early = sweep.run(write(TEXT), t_end=700)
    np.testing.assert_array_equal(np.isfinite(early.reversal_times).sum("reversal"), early.reversals)
    assert int(early.reversals.min()) == 1


def test_the_dataset_has_a_dimension_for_them(found: xr.Dataset, config: Path) -> None:
    times = found.reversal_times
    assert times.dims == ("mu", "reversal")
    assert list(times.reversal) == [1, 2, 3]
    assert times.attrs == {"long_name": "time of each spin reversal", "units": "sqrt(c/g)"}
    xr.testing.assert_identical(times, xr.load_dataset(config.with_suffix(".nc")).reversal_times)


def test_the_setting_survives_in_the_configuration_of_the_dataset(found: xr.Dataset, write: Write) -> None:
    again = sweep.load_config(write(found.attrs["config"]))
    assert again.measure == ("reversals", "reversal_times=3")
    assert (
        sweep.load_config(write(TEXT), {"measure": ["reversals", "reversal_times"]}).measure[1] == "reversal_times=10"
    )
