"""The characteristic polynomial of a rattle, its roots, and the stable ranges that follow, against its Jacobian."""

from dataclasses import replace

import numpy as np
import pytest
from support import columns, wide_bodies
from support.physics import KANE_LEVINSON

from sweep.models import MODELS, find
from sweep.models.model import Model, stack
from sweep.models.theory import linear, stability
from sweep.models.theory.polynomials import Polynomial, X, real_roots, values_and_slopes

SLIP = MODELS["slip"]


def bodies(name: str) -> tuple[Model, dict[str, np.ndarray]]:
    wide = wide_bodies(1000)
    given = {
        "slip": {},
        "slip+viscous+offset": {"offset": 0.4 * wide["c"]},
        "slip+coulomb": {"mu": 0.3 + 0 * wide["c"], "speed": 0.01 + 0 * wide["c"]},
        "slip+viscous+offset+gravity": {n: v + 0 * wide["c"] for n, v in KANE_LEVINSON.items()},
    }
    return find(name), wide | given[name]


NAMES = ("slip", "slip+viscous+offset", "slip+coulomb", "slip+viscous+offset+gravity")


def spins(model: Model, body: dict[str, np.ndarray]) -> list[np.ndarray]:
    return [share * model.spin_unit(body) for share in (0.0, 0.05, -0.3, 2.0)]


@pytest.mark.parametrize("name", NAMES)
def test_the_polynomial_is_the_determinant(name: str) -> None:
    model, body = bodies(name)
    constants, random = model.constants.of(body), np.random.default_rng(2)
    for spin in spins(model, body):
        rate = model.spin_unit(body) * (random.normal(size=1000) + 1j * random.normal(size=1000))
        matrix = rate[:, None, None] * np.eye(6) - linear.jacobian(model, constants, spin)
        determinant = constants.J11 * constants.J22 * np.linalg.det(matrix)
        coefficients = stack(model.characteristic(spin, constants))
        np.testing.assert_allclose((coefficients * rate ** np.arange(7)[:, None]).sum(axis=0), determinant, rtol=1e-10)


@pytest.mark.parametrize("name", NAMES)
def test_the_rates_are_the_eigenvalues(name: str) -> None:
    model, body = bodies(name)
    constants = model.constants.of(body)
    for spin in spins(model, body):
        found = np.sort_complex(linear.rates(model, constants, spin))
        expected = np.sort_complex(np.linalg.eigvals(linear.jacobian(model, constants, spin)))
        largest = np.abs(expected).max(axis=1, keepdims=True)
        # Two equal eigenvalues of a matrix are off by the root of its rounding.
        np.testing.assert_allclose(found / largest, expected / largest, atol=1e-7)
        assert np.quantile(np.abs(found - expected) / largest, 0.99) < 1e-12


@pytest.mark.parametrize("name", NAMES)
def test_the_ranges_are_those_of_the_matrices(name: str) -> None:
    """These have fewer digits at fast spins, and where two modes hardly differ (`sweep.models.theory.stability`)."""
    model, body = bodies(name)
    found = np.stack(stability.stable_ranges(model, body))
    expected = np.stack(stability.stable_ranges(replace(model, characteristic=None), body))
    np.testing.assert_allclose(found, expected, rtol=1e-2)
    slow = np.isfinite(expected) & (np.abs(expected) < 0.05 * model.spin_unit(body))
    assert slow.sum() > 500
    np.testing.assert_allclose(found[slow], expected[slow], rtol=5e-8)
    assert np.quantile(np.abs(found[slow] / expected[slow] - 1), 0.98) < 1e-10


@pytest.mark.parametrize("share", [1e-2, 1e-4, 1e-6])
def test_bodies_whose_modes_hardly_differ_have_the_same_slow_ranges(share: float) -> None:
    """Nearly round bodies, also very flat ones: there the resultant loses up to all of its digits."""
    wide, flat = wide_bodies(200), np.geomspace(10.0, 3000.0, 200)
    for body in (wide | {"b": wide["a"] * (1 - share)}, columns(a=flat, b=flat * (1 - share))):
        found, expected = (
            np.stack(stability.stable_ranges(model, body)[:2]) for model in (SLIP, replace(SLIP, characteristic=None))
        )
        slow = np.abs(expected) < 0.05
        assert slow.sum() > 100
        np.testing.assert_allclose(found[slow], expected[slow], rtol=5e-9)


def test_no_bodies_have_no_rates() -> None:
    none = {name: values[:0] for name, values in wide_bodies(1).items()}
    assert linear.rates(SLIP, SLIP.constants.of(none), none["n0"]).shape == (0, 6)
    assert np.shape(stability.stable_ranges(SLIP, none)) == (7, 0)


def test_polynomials_add_and_multiply_like_their_values() -> None:
    two = Polynomial(np.array([[1.0, 2.0], [0.5, 0.0]]))
    made = (3.0 - X * X) * (two + X) - np.array([2.0, 7.0]) * X * (-X + 1.0)
    for x in (0.0, 0.3, -2.0):
        value, slope = values_and_slopes(made.coefficients, np.full(2, x))
        of_two, of_slope = np.array([1.0 + 0.5 * x, 2.0]), np.array([0.5, 0.0])
        np.testing.assert_allclose(value, (3 - x**2) * (of_two + x) - np.array([2.0, 7.0]) * x * (1 - x))
        expected = (3 - x**2) * (of_slope + 1) - 2 * x * (of_two + x) - np.array([2.0, 7.0]) * (1 - 2 * x)
        np.testing.assert_allclose(slope, expected)


def test_all_real_roots_are_found() -> None:
    """Of polynomials that are made of their roots: far apart, close together, beyond the limit, and complex."""
    random, cells = np.random.default_rng(4), 300
    real = np.exp(random.uniform(np.log(1e-5), np.log(5.0), (4, cells))) * random.choice([1.0, 1.0, -1.0], (4, cells))
    real[1, ::3] = real[0, ::3] * 1.001
    complex_ = random.uniform(-1, 2, (3, cells)), random.uniform(0.01, 1, (3, cells))
    product = np.ones((1, cells))
    for factor in [*([-r, np.ones(cells)] for r in real),
                   *([x**2 + y**2, -2 * x, np.ones(cells)] for x, y in zip(*complex_, strict=True))]:  # fmt: skip
        product = sum(np.pad(product * c, ((k, len(factor) - 1 - k), (0, 0))) for k, c in enumerate(factor))  # type: ignore[assignment]
    limit = random.uniform(0.5, 2.0, cells)
    which, found = real_roots(product, limit)
    for cell in range(cells):
        wanted = real[:, cell]
        expected = np.sort(wanted[(wanted > 0) & (wanted < limit[cell])])
        np.testing.assert_allclose(np.sort(found[which == cell]), expected, rtol=1e-7)


def test_a_polynomial_without_such_roots_has_none() -> None:
    for coefficients in ([1.0, 0.0, 1.0], [1.0, -2.0, 1.0], [0.0, 0.0], [1.0, -0.1], [5.0, 0.0]):
        _, found = real_roots(np.array(coefficients)[:, None], np.ones(1))
        assert not len(found)
