"""`tolerance: auto`: a cell is integrated as exactly as its count needs, and no more."""

import numpy as np
import pytest
import xarray as xr

import sweep
from sweep.kernels.method import COARSEST, REPEAT, TOLERANCE

NEAR = [(132.0, 3.2, 12), (168.0, 4.6, 17), (180.0, 3.8, 18), (196.0, 4.0, 19), (196.0, 5.0, 21)]
"""μ, b and counts at n0 = 0.1, at tolerances of 1e-8 and 1e-10: of cells whose coarse runs cannot tell."""

FAR = [(60.0, 3.0, 5), (100.0, 2.0, 3)]


def run(cells: list[tuple[float, float, int]], **settings: object) -> xr.Dataset:
    mu, b, _ = zip(*cells, strict=True)
    return sweep.run({"cases": {"mu": list(mu), "b": list(b)}, "start": {"n0": 0.1}}, **settings)


def test_a_cell_is_repeated_until_its_count_is_certain() -> None:
    found = run(NEAR)
    assert found.certain.values.tolist() == [1] * len(NEAR)
    assert found.reversals.values.tolist() == [count for _, _, count in NEAR]
    assert (found.step_rule.values == REPEAT).all()


def test_a_count_that_is_clear_is_not_run_again() -> None:
    found, fine = run(FAR), run(FAR, tolerance=1e-8)
    assert found.certain.values.tolist() == fine.certain.values.tolist() == [1] * len(FAR)
    assert found.reversals.equals(fine.reversals)
    assert (found.step.values > 2 * fine.step.values).all()
    assert (np.abs(found.spin_final - fine.spin_final)[found.t_stop == fine.t_stop] < 100 * COARSEST).all()


@pytest.mark.parametrize(
    "settings",
    [
        {"stop_early": False, "t_end": 400},
        {"estimate_errors": False},
        {"measure": ["reversals", "margin", {"reversal_times": 2}]},
        {"measure": ["reversals"]},
    ],
)
def test_without_certain_counts_auto_is_a_tolerance_of_1e_8(settings: dict) -> None:
    scene = {"friction": {"mu": 60.0}}
    assert sweep.load_config(scene).tolerance == COARSEST
    assert sweep.load_config(scene, settings).tolerance == TOLERANCE == 1e-8


def test_a_run_to_the_end_of_the_time_takes_the_tolerance_of_its_configuration() -> None:
    found, fine = (run(FAR, stop_early=False, t_end=400, **given) for given in ({}, {"tolerance": 1e-8}))
    assert found.equals(fine)


def test_the_dataset_says_what_the_tolerance_was() -> None:
    assert f"{COARSEST:g}" in run(FAR[:1]).attrs["integrator"]
