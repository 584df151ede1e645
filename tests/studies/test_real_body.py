"""Critical spins of a real body: by the eigenvalues of the general equations, and by simulation with them."""

import numpy as np
import pytest
from support import Write

import sweep
from sweep.config import ConfigError

STONE = """\
units: SI
body: {a: 0.2, b: 0.03, c: 0.02, offset: 0.01, mass: 1.0, Ixx: 2.0e-4, Iyy: 1.6e-3, Izz: 1.7e-3, Ixy: -2.0e-5}
friction: {mu: [30, 100]}
start: {n0: 1, x0: 1.0e-3, y0: 1.0e-3}
integrator: {t_end: 100}
"""


def test_critical_spins_of_a_real_body(write: Write) -> None:
    result = sweep.critical(write(STONE), bracket=1e-2)
    for side in ("plus", "minus"):
        assert (result[f"n_c1_{side}_reason"] == 0).all()
        assert np.abs(result[f"n_c2_{side}_simulated"] / result[f"n_c1_{side}_linear"])[1] > 1  # t_end decides
        assert result[f"n_c1_{side}_linear"].attrs["units"] == "radian s-1"
    assert "form_factor" not in result
    assert "n_c1_plus" not in result


def test_a_start_by_angles_has_no_spin_to_search(write: Write) -> None:
    with pytest.raises(ConfigError, match="give x0 and y0"):
        sweep.critical(write(STONE.replace("n0: 1, x0: 1.0e-3, y0: 1.0e-3", "roll: 1 deg")))


def test_vectors_of_a_trajectory_are_along_the_same_axes_with_any_equations() -> None:
    """Those of the paper's model are along the axes of inertia; the general equations know those of the surface."""
    body, scene = {"a": 10, "b": 3, "delta": 0.3}, {"start": {"n0": 0.2, "x0": 0.3, "y0": -0.1}}
    papers, general = (
        sweep.trajectory(scene | {"body": body | more, "friction": {"mu": 3}}, t_end=20, every=0.5)
        for more in ({}, {"offset": 1e-300})
    )
    assert float(general.contact_x[0, 0]) == pytest.approx(0.3)
    turned = ("heading", "roll_angle", "pitch_angle", "table_x", "table_y")
    for name in ("spin", "contact_x", "contact_y", "slip_1", "slip_2", *turned):
        assert np.abs(papers[name]).max() > 1e-3
        np.testing.assert_allclose(general[name], papers[name], rtol=0, atol=1e-8)


def test_a_small_body_reverses_as_a_large_one_does(write: Write) -> None:
    """With lengths 400 times as small, times are 20 times as short, and spins larger than 10 rad/s."""
    small = (
        "units: SI\n"
        "body: {a: 5.0e-4, b: 7.5e-5, c: 5.0e-5, offset: 2.5e-5, mass: 1.0, Ixx: 1.25e-9, Iyy: 1.0e-8,"
        " Izz: 1.0625e-8, Ixy: -1.25e-10}\n"
        "friction: {mu: 2000}\nstart: {n0: 1, x0: 2.5e-6, y0: 2.5e-6}\nintegrator: {t_end: 5}\n"
    )
    large = sweep.critical(write(STONE.replace("[30, 100]", "100")), bracket=1e-2)
    found = sweep.critical(write(small), bracket=1e-2)
    for side in ("plus", "minus"):
        there, here = (each[f"n_c2_{side}_simulated"] for each in (large, found))
        assert (found[f"n_c2_{side}_reason"] == large[f"n_c2_{side}_reason"]).all()
        np.testing.assert_allclose(here, 20 * there, rtol=0.01)
    assert np.abs(found["n_c2_minus_simulated"]).max() > 10
