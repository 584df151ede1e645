"""The comparison of datasets by `scripts/same_numbers.py` finds whatever is planted, to the last bit."""

import runpy
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from support import ROOT

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


def last_bit(found: xr.Dataset) -> None:
    found["spin_final"][0] = np.nextafter(0.1, 1)


def sign_of_zero(found: xr.Dataset) -> None:
    found["spin_final"][2] = 0.0


def other_type(found: xr.Dataset) -> None:
    found["status"] = found["status"].astype(np.int16)


def other_words(found: xr.Dataset) -> None:
    found["spin_final"].attrs |= {"units": "m", "long_name": "spin", "description": "spin at the end"}
    found.attrs |= {"config": "", "created": "tomorrow", "sweep_kind": "grid"}


def other_flags(found: xr.Dataset) -> None:
    found["status"].attrs["flag_meanings"] = "time_limit settled"


def ended(found: xr.Dataset) -> None:
    del found["verified_step"], found.attrs["verified_counts_changed"]


def lost(found: xr.Dataset) -> None:
    del found["status"]


@pytest.mark.parametrize(
    ("change", "wrong", "aside"),
    [
        (lambda _: None, [], []),
        (last_bit, ["spin_final (1 of 3 values)"], []),
        (sign_of_zero, ["spin_final (1 of 3 values)"], []),
        (other_type, ["status (type or shape)"], []),
        (other_flags, ["status:flag_meanings"], []),
        (lost, ["status"], []),
        (other_words, [], ["config", "sweep_kind", *WORDS]),
        (ended, [], ["verified_counts_changed", "verified_step"]),
    ],
)  # fmt: skip
def test_what_differs_is_named(
    change: Callable[[xr.Dataset], None], wrong: list[str], aside: list[str], tmp_path: Path
) -> None:
    one, other = tmp_path / "one.nc", tmp_path / "other.nc"
    changed = dataset()
    change(changed)
    dataset().to_netcdf(one)
    changed.to_netcdf(other)
    found = list(SAME["differences"](one, other))
    assert ([each for each in found if not SAME["meant"](each)], [each for each in found if SAME["meant"](each)]) == (
        wrong, aside,
    )  # fmt: skip
