"""The kernel against spins in extended precision, made by `scripts/reference_spins.py`."""

from __future__ import annotations

import numpy as np
import pytest
from support import kernels

from sweep.bench.reference import SPINS
from sweep.engine.executor import execute
from sweep.kernels.status import TIME_LIMIT
from sweep.models import MODELS

TABLE = np.genfromtxt(SPINS, delimiter=",", names=True, dtype=None, encoding="utf-8")
T_END = 400.0


@pytest.mark.parametrize(
    ("model", "step", "choice"),
    [
        ("slip", 0.004, {"mu": 60.0}),
        ("slip", 0.004, {"x0": 2.0}),
        ("slip", 0.0005, {"mu": 1000.0}),
        ("noslip", 0.01, {}),
        ("effective", 0.005, {}),
        ("averaged", 0.05, {}),
    ],
)
def test_spins_agree_with_the_reference(model: str, step: float, choice: dict[str, float]) -> None:
    which = (TABLE["model"] == model) & (TABLE["t"] == T_END)
    for name, value in choice.items():
        which &= TABLE[name] == value
    rows = TABLE[which]
    columns = {name: rows[name].astype(float) for name in MODELS["slip"].parameters}
    kernel = kernels.kernel(model=model)
    table = kernel.images(columns, np.full(len(rows), step), T_END)
    execute(kernel, table, stop_when_settled=False)
    assert set(kernel.table(table)["status"]) == {TIME_LIMIT}
    spins = MODELS[model].energy(*kernel.unpack(table))[0]
    assert len(rows) == {"slip": 1, "noslip": 4}.get(model, 8)
    np.testing.assert_allclose(spins, rows["spin"], rtol=0, atol=1e-10)
