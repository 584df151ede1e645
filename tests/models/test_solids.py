"""Solids: their inertia against integrals over their volume."""

from math import pi

import numpy as np
import pytest

from sweep.models.general.solids import SOLIDS

SIZES = {"length": 0.12, "width": 0.03, "height": 0.018}
HALF = SOLIDS["half_ellipsoid"]
MEASURED = {"mass": 0.03, "angle": 0.04, **SIZES}


def points(a: float, b: float, c: float, lowest: float) -> tuple[np.ndarray, np.ndarray]:
    """Nodes, z down from the ellipsoid's centre, and weights of the part below -c `lowest`: Gauss in z and radius."""
    nodes, weights = np.polynomial.legendre.leggauss(12)
    z, dz = (nodes * (1 - lowest) + 1 + lowest) / 2, weights * (1 - lowest) / 2
    r, dr = (nodes + 1) / 2, weights / 2
    phi = np.arange(12) * 2 * pi / 12
    z, r, phi = (each.ravel() for each in np.meshgrid(z, r, phi, indexing="ij"))
    rim = np.sqrt(1 - z**2)
    weight = (dz[:, None, None] * dr[:, None] * np.ones(12)).ravel() * r * rim**2
    return np.array([a * rim * r * np.cos(phi), b * rim * r * np.sin(phi), c * z]), weight / weight.sum()


@pytest.mark.parametrize("name", SOLIDS)
def test_inertia_is_that_of_the_volume(name: str) -> None:
    found, whole = SOLIDS[name].body(MEASURED), name == "ellipsoid"
    a, b, c = 0.06, 0.015, 0.009 if whole else 0.018
    place, share = points(a, b, c, -1.0 if whole else 0.0)
    centre = place @ share
    np.testing.assert_allclose([found["a"], found["b"], found["c"]], [a, b, c])
    np.testing.assert_allclose([0, 0, found["offset"]], centre, atol=1e-15)
    second = ((place - centre[:, None]) * share) @ (place - centre[:, None]).T
    cos, sin = np.cos(0.04), np.sin(0.04)
    turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
    matrix = turn @ (0.03 * (np.trace(second) * np.eye(3) - second)) @ turn.T
    expected = {"Ixx": matrix[0, 0], "Iyy": matrix[1, 1], "Izz": matrix[2, 2], "Ixy": matrix[0, 1], "mass": 0.03}
    for entry, value in expected.items():
        assert found[entry] == pytest.approx(value, rel=1e-12), entry
    assert found["Ixy"] < 0  # as by a positive delta


def test_radii_and_semi_axes_shape_the_surface_and_sizes_the_solid() -> None:
    plain = HALF.body(MEASURED)
    found = HALF.body({**MEASURED, "radius_long": 0.5, "b": 0.02, "c": 0.03})
    assert (found["a"] ** 2 / found["c"], found["b"], found["c"]) == pytest.approx((0.5, 0.02, 0.03))
    assert {name: found[name] for name in plain if name[0] == "I"} == {n: plain[n] for n in plain if n[0] == "I"}
    height = plain["c"] - plain["offset"]
    assert found["c"] - found["offset"] == pytest.approx(height)


def test_a_solid_without_sizes_is_that_of_its_surface() -> None:
    of_radii = {"mass": 0.03, "angle": 0.04, "radius_long": 0.2, "radius_short": 0.0125, "c": 0.018}
    assert HALF.body(of_radii) == pytest.approx(HALF.body(MEASURED))
