"""Regimes of motion by their thresholds, and the first reversal beside its prediction; nothing is simulated."""

from typing import Any

import numpy as np
import pytest
import xarray as xr
from support.figures import entries

import sweep
from sweep.kernels.status import LIFT_OFF, SETTLED, TIME_LIMIT
from sweep.plots.marks import legend
from sweep.plots.quantities import field
from sweep.plots.regimes import REGIMES

CELLS = {
    "settles": (SETTLED, 7, 0.5, 0.1),
    "few_reversals": (TIME_LIMIT, 3, np.nan, 0.1),
    "reverses_regularly": (TIME_LIMIT, 30, 0.009, 0.001),
    "wanders": (TIME_LIMIT, 30, 0.011, 0.0031),
    "undecided": (TIME_LIMIT, 30, 0.011, 0.0029),
}
"""Status, reversals, variation of the cycles, and exponent."""


def dataset(cells: list[tuple[Any, ...]]) -> xr.Dataset:
    names = ("status", "reversals", "cycle_variation", "lyapunov")
    columns = {name: ("n0", np.array(values)) for name, values in zip(names, zip(*cells, strict=True), strict=True)}
    dataset = xr.Dataset(columns, {"n0": np.arange(len(cells)) / 10})
    return dataset.assign(lyapunov_error=("n0", np.full(len(cells), 1e-3)), status=dataset["status"].astype("int8"))


@pytest.mark.parametrize("regime", CELLS)
def test_a_regime_is_told_by_its_thresholds(regime: str) -> None:
    assert REGIMES[field(dataset([CELLS[regime]]), "regime").item()] == regime


def test_a_body_that_lifts_off_has_none() -> None:
    found = dataset([*CELLS.values(), (LIFT_OFF, 0, np.nan, np.nan)])
    assert "failed: 1 lifted off" in legend(found, "regime")["failed"]
    assert any("lifted off" in each for each in entries(sweep.plot(found, "regime")))
