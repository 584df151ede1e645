"""The method of each cell by its cost, and a run that checks itself."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from support import SMALL, Write, columns
from support.cli import invoke
from support.runs import in_sittings, same_numbers

import sweep
from sweep.engine.checks import verify
from sweep.engine.executor import Work, execute
from sweep.engine.plan import plan
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


def test_a_model_without_a_stiff_form_has_one_method(write: Write) -> None:
    averaged = sweep.load_config(write("model: averaged\nfriction: {mu: 60}\nintegrator: {method: auto}\n"))
    assert [part.method for part in plan(averaged).parts] == ["dopri5"]


def test_verified_cells_are_run_again(write: Write) -> None:
    result = sweep.run(write(SMALL + "verify: 0.4\n"))
    assert result.sizes["verified"] == 5  # of twelve
    cells = result["verified_cell"].values
    assert (np.diff(cells) > 0).all()
    yardstick = sweep.run(write(), method="dopri5")["step"].values.ravel()[cells] / 2
    np.testing.assert_allclose(result["verified_step"], yardstick, rtol=1e-3)  # it divides t_stop evenly
    same = result["verified_reversals"].values == result["reversals"].values.ravel()[cells]
    assert result.attrs["verified_counts_changed"] == (~same).sum() == 0
    worst = np.abs(result["verified_spin_final"].values - result["spin_final"].values.ravel()[cells]).max()
    assert result.attrs["verified_largest_spin_difference"] == worst
    assert 0 < worst < 1e-6
    plain = sweep.run(write())
    xr.testing.assert_equal(result[list(plain.data_vars)], plain)


def test_runs_with_the_default_method_verify_themselves(write: Write) -> None:
    many = "friction: {mu: {start: 50, stop: 60, num: 500}}\n"
    assert sweep.load_config(write(many)).verify == 0.002
    for other in ("verify: 0\n", "refine: 2\n", "integrator: {method: adams}\n", "model: noslip\n"):
        assert (
            sweep.load_config(write("friction: {mu: 60}\nbody: {b: {start: 2, stop: 3, num: 500}}\n" + other)).verify
            == 0
        )
    assert sweep.load_config(write()).verify == 0  # twelve cells


def test_verification_sees_a_step_too_long(write: Write) -> None:
    file = write(SMALL + "verify: 1\n")
    rough = sweep.run(file, method="adams", tolerance=0.01)
    fine = sweep.run(file, method="adams")
    assert rough.attrs["verified_largest_spin_difference"] > 1e-5 > fine.attrs["verified_largest_spin_difference"]
    coarse = sweep.run(file, step=0.02)
    assert coarse.attrs["verified_largest_spin_difference"] > 1e-11
    np.testing.assert_allclose(coarse["verified_step"], coarse["step"].values.ravel() / 2, rtol=1e-3)


def test_a_changed_count_is_counted(write: Write) -> None:
    job = plan(sweep.load_config(write(SMALL + "verify: 1\n")))
    (part,) = job.parts
    execute(part.kernel, part.images, stop_when_settled=True)
    part.kernel.table(part.images)["reversals"][3] += 1
    found = verify(job.config, np.arange(12), job.results(), Work())
    assert list(np.flatnonzero(found["verified_count_changed"])) == [3]


def test_the_command_prints_the_verification(write: Write, tmp_path: Path) -> None:
    result = invoke("run", write(), "--set", "verify=0.1", "--output", tmp_path / "out")
    assert result.exit_code == 0
    assert "verified: 2 cells run again with finer steps: 0 counts changed, the largest difference in" in result.stdout
