"""Critical spins of a real body: by the eigenvalues of the general equations, and by simulation with them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sweep
from sweep.config import ConfigError

STONE = """\
units: SI
body: {a: 0.2, b: 0.03, c: 0.02, offset: 0.01, mass: 1.0, Ixx: 2.0e-4, Iyy: 1.6e-3, Izz: 1.7e-3, Ixy: -2.0e-5}
friction: {mu: [30, 100]}
start: {n0: 1, x0: 1.0e-3, y0: 1.0e-3}
integrator: {t_end: 100}
"""


def test_critical_spins_of_a_real_body(tmp_path: Path) -> None:
    file = tmp_path / "stone.yaml"
    file.write_text(STONE, encoding="utf-8")
    result = sweep.critical(file, width=1e-2)
    for side in ("plus", "minus"):
        assert (result[f"n_c1_{side}_reason"] == 0).all()
        assert np.abs(result[f"n_c2_{side}_simulated"] / result[f"n_c1_{side}_linear"])[1] > 1  # t_end decides
        assert result[f"n_c1_{side}_linear"].attrs["units"] == "radian s-1"
    assert "form_factor" not in result
    assert "n_c1_plus" not in result


def test_a_start_by_angles_has_no_spin_to_search(tmp_path: Path) -> None:
    file = tmp_path / "stone.yaml"
    file.write_text(STONE.replace("n0: 1, x0: 1.0e-3, y0: 1.0e-3", "roll: 1 deg"), encoding="utf-8")
    with pytest.raises(ConfigError, match="give x0 and y0"):
        sweep.critical(file)


def test_vectors_of_a_trajectory_are_along_the_same_axes_with_any_equations(tmp_path: Path) -> None:
    """Those of the paper's model are along the axes of inertia; the general equations know those of the surface."""
    file = tmp_path / "turned.yaml"
    body, start = "{a: 10, b: 3, delta: 0.3}", "{n0: 0.2, x0: 0.3, y0: -0.1}"
    file.write_text(f"body: {body}\nfriction: {{mu: 3}}\nstart: {start}\nintegrator: {{t_end: 20}}\n", encoding="utf-8")
    with_couple = sweep.load_config(file, {"sigma": 1e-14})
    papers, general = sweep.trajectory(file, every=0.5), sweep.trajectory(with_couple, every=0.5)
    assert float(general.contact_x[0, 0]) == pytest.approx(0.3)
    for name in ("spin", "contact_x", "contact_y", "slip_1", "slip_2"):
        assert np.abs(papers[name]).max() > 1e-3
        np.testing.assert_allclose(general[name], papers[name], rtol=0, atol=1e-8)
