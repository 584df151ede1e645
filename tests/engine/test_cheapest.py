"""The method of each cell by its cost."""

from pathlib import Path

import numpy as np
import pytest
from support import Write, columns
from support.runs import in_sittings, same_numbers

import sweep
from sweep.kernels import methods
from sweep.models import MODELS

MIXED = """\
friction: {mu: [1.0, 60, 1000]}
start: {n0: [0.02, 0.3]}
integrator: {method: auto, t_end: 60}
"""


def test_the_cheapest_method_depends_on_friction_and_time() -> None:
    slip = MODELS["slip"]
    by_mu, *_ = methods.cheapest(slip, columns(mu=[1.0, 60.0, 1e3, 1e5]), 1e-6, 400.0)
    assert list(by_mu[1:]) == ["adams"] * 3
    assert methods.cheapest(slip, columns(), 1e-6, 1.0)[0] == "dopri5"
    only, *_ = methods.cheapest(MODELS["averaged"], columns(), 1e-6, 400.0)
    assert only == "dopri5"


def test_auto_runs_each_cell_with_its_cheapest_method(write: Write) -> None:
    mixed = sweep.run(write(MIXED))
    names = np.array(list(methods.METHODS))[mixed["method"].values]
    assert set(names.ravel()) == set(methods.METHODS)
    assert mixed["method"].attrs["flag_meanings"] == " ".join(methods.METHODS)
    for method in methods.METHODS:
        alone = sweep.run(write(MIXED), method=method)
        assert "method" not in alone
        for name in ("spin_final", "reversals", "status", "step", "energy_error", "t_stop"):
            np.testing.assert_array_equal(mixed[name].values[names == method], alone[name].values[names == method])


@pytest.mark.usefixtures("short_chunks")
def test_auto_resumes_from_a_checkpoint(write: Write, tmp_path: Path) -> None:
    file = write(MIXED.replace("60}\n", "120}\n") + "name: mixed\n")
    found, interruptions, _ = in_sittings(3, file, tmp_path / "out")
    assert interruptions >= 2
    same_numbers(found, sweep.run(file))
