"""The compiled search for stable ranges against the eigenvalues."""

from __future__ import annotations

import numpy as np
import pytest
from support import columns, wide_bodies

from sweep.kernels import stability as compiled
from sweep.models import MODELS
from sweep.models.model import Columns
from sweep.models.theory import stability

SLIP = MODELS["slip"]

PAPER = columns(b=np.repeat(np.linspace(1.2, 9.8, 44), 10), mu=np.tile(np.linspace(20, 200, 10), 44))
WIDE = wide_bodies(600)


@pytest.mark.parametrize(("bodies", "decided"), [(PAPER, 0.99), (WIDE, 0.3)])
def test_the_same_ranges_as_by_the_eigenvalues(bodies: Columns, decided: float) -> None:
    ranges, covered = compiled.nearest_ranges(SLIP, bodies)
    expected = stability.stable_ranges(SLIP, bodies)
    np.testing.assert_allclose(ranges[:2], expected[:2], rtol=1e-8)
    within = np.abs(expected) < covered
    ends = (slice(2, 6), slice(None))
    np.testing.assert_allclose(ranges[ends][within[ends]], expected[ends][within[ends]], rtol=1e-8)
    # No range beyond zero that the eigenvalues do not know.
    beyond = np.abs(ranges[3:5]) < covered
    np.testing.assert_array_equal(beyond, np.abs(expected[3:5]) < covered)
    assert np.isfinite(covered).mean() >= decided
    assert beyond[:, np.isfinite(covered)].any()


def test_each_body_by_itself() -> None:
    some = {name: values[::7] for name, values in PAPER.items()}
    for whole, part in zip(compiled.nearest_ranges(SLIP, PAPER), compiled.nearest_ranges(SLIP, some), strict=True):
        np.testing.assert_array_equal(whole[..., ::7], part)


@pytest.mark.parametrize(("gap", "answer"), [(1e-4, -1), (-1e-7, -1), (0.2, 3)])
def test_two_changes_between_two_points_are_a_doubt(gap: float, answer: int) -> None:
    """c0 = (t - 0.4)² + gap nearly vanishes, or does so twice, between two points; the last function is 7 - 10 t."""
    powers = np.zeros((compiled._NODES, 4))
    powers[:3, 0] = 0.16 + gap, -0.8, 1.0
    powers[0, [1, 3]] = 1.0
    powers[:3, 2] = powers[:3, 0] + (8.0, -10.0, 0.0)
    found = np.empty(3)
    assert compiled._changes(powers, 0.0, 1.0, found) == answer
    if answer > 0:
        assert found[0] == pytest.approx(0.7, abs=1e-12)


def test_bodies_without_critical_spins_in_the_paper() -> None:
    bodies = columns(b=[3.0, 10.0, 3.0], delta=[0.03, 0.03, 0.0], mu=[0.0, 60.0, 60.0])
    ranges, _ = compiled.nearest_ranges(SLIP, bodies)
    np.testing.assert_allclose(ranges[:2], stability.stable_ranges(SLIP, bodies)[:2], rtol=1e-8)
