"""The comparison of datasets by `scripts/same_numbers.py` finds whatever is planted, to the last bit."""

import runpy
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from support import ROOT

VERIFIED = ("verified_counts_changed", "verified_step")
WORDS = ("spin_final:description", "spin_final:long_name", "spin_final:units")
SAME = runpy.run_path(str(ROOT / "scripts" / "same_numbers.py"))


def dataset() -> xr.Dataset:
    variables = {
        "spin_final": ("mu", [0.1, np.nan, -0.0], {"long_name": "spin at t_stop", "units": "1"}),
        "status": ("mu", np.array([1, 2, 1], np.int8), {"flag_meanings": "settled time_limit"}),
        "verified_step": ("mu", [1.0, 2.0, 3.0]),
    }
    attributes = {"config": "verify: 0.01", "created": "today", "verified_counts_changed": 1}
    return xr.Dataset(variables, {"mu": [60.0, 70.0, 80.0]}, attributes)


def other_words(found: xr.Dataset) -> xr.Dataset:
    found["spin_final"].attrs |= {"units": "m", "long_name": "spin", "description": "spin at the end"}
    return found.assign_attrs(config="", created="tomorrow", sweep_kind="grid")


def with_spins(*values: float) -> Callable[[xr.Dataset], xr.Dataset]:
    return lambda found: found.assign(spin_final=found.spin_final.copy(data=np.array(values)))


@pytest.mark.parametrize(
    ("change", "wrong", "aside"),
    [
        (lambda d: d, [], []),
        (with_spins(np.nextafter(0.1, 1), np.nan, -0.0), ["spin_final (1 of 3 values)"], []),
        (with_spins(0.1, np.nan, 0.0), ["spin_final (1 of 3 values)"], []),
        (lambda d: d.assign(status=d.status.astype("int16")), ["status (type or shape)"], []),
        (lambda d: d.assign(status=d.status.assign_attrs(flag_meanings="settled")), ["status:flag_meanings"], []),
        (lambda d: d.drop_vars("status"), ["status"], []),
        (other_words, [], ["config", "sweep_kind", *WORDS]),
        (lambda d: d.drop_vars("verified_step").drop_attrs(deep=False), [], ["config", *VERIFIED]),
    ],
)  # fmt: skip
def test_what_differs_is_named(
    change: Callable[[xr.Dataset], xr.Dataset], wrong: list[str], aside: list[str], tmp_path: Path
) -> None:
    one, other = tmp_path / "one.nc", tmp_path / "other.nc"
    dataset().to_netcdf(one)
    change(dataset()).to_netcdf(other)
    found = list(SAME["differences"](one, other))
    assert [each for each in found if not SAME["meant"](each)] == wrong
    assert [each for each in found if SAME["meant"](each)] == aside
