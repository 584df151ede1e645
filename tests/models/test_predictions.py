"""Analytic and linear predictions against published numbers, other derivations and limits."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import columns

import sweep
from sweep.models import MODELS
from sweep.models.general.rigid_body import slower_period
from sweep.models.ladder import analytic, slip
from sweep.models.theory import linear
from sweep.models.theory.coefficients import coefficients

SLIP = MODELS["slip"]


def test_nothing_is_critical_by_the_formulas_without_coupling_or_friction() -> None:
    for body in (columns(delta=0.0), columns(a=5, b=5), columns(mu=0.0)):
        assert np.isnan(analytic.critical_spins(body)).all()
        assert analytic.reversal_count(body) == 0


def by_inequalities(n0: float, upper: float, lower: float) -> int:
    """n_r as (nrk0), (nrk1) say it: K(n_r - 1) < 1/h1 <= K(n_r), in exact arithmetic."""
    here, there = (upper, -lower) if n0 > 0 else (-lower, upper)
    x, rho = abs(Fraction(n0)) / (2 * Fraction(here)), Fraction(there) / Fraction(here)
    n_r, K = 0, Fraction(1)
    while x > K:
        n_r += 1
        K += rho if n_r % 2 else 1
    return n_r


@given(
    mu=st.floats(5, 500), b=st.floats(1.2, 9.5), delta=st.floats(0.005, 0.1), n0=st.floats(-0.2, 0.2).filter(bool),
    mirrored=st.booleans(),
)  # fmt: skip
def test_count_is_that_of_the_inequalities(mu: float, b: float, delta: float, n0: float, mirrored: bool) -> None:
    body = columns(mu=mu, b=b, delta=-delta if mirrored else delta, n0=n0)
    upper, lower = analytic.critical_spins(body)
    assert analytic.reversal_count(body)[0] == by_inequalities(n0, upper[0], lower[0])


def test_count_on_the_edge_of_an_inequality() -> None:
    upper, lower = analytic.critical_spins(columns())
    edges = np.array([2 * upper[0], 2 * upper[0] - 2 * lower[0]])
    assert list(analytic.reversal_count(columns(n0=edges))) == [0, 1]
    assert list(analytic.reversal_count(columns(n0=np.nextafter(edges, 1)))) == [1, 2]


@given(scale=st.floats(0.1, 10), mu=st.floats(5, 300), b=st.floats(1.2, 9.5), n0=st.floats(-0.2, 0.2))
def test_predictions_scale_with_the_body(scale: float, mu: float, b: float, n0: float) -> None:
    body = columns(mu=mu, b=b, n0=n0)
    rate = np.sqrt(scale)
    large = columns(a=10 * scale, b=b * scale, c=scale, mu=mu / rate, n0=n0 / rate)
    np.testing.assert_allclose(
        np.array(analytic.critical_spins(large)) * rate, analytic.critical_spins(body), rtol=1e-9
    )
    np.testing.assert_allclose(slower_period(large) / rate, slower_period(body), rtol=1e-12)
    np.testing.assert_allclose(analytic.form_factor(large), analytic.form_factor(body), rtol=1e-9)


def test_frequencies() -> None:
    # Rocking without slip and spin: inertia J about the contact, height r = c + uᵀ(A - c²)u / 2c.
    # The paper neglects c² beside A («(1 - s) y ~ y» under Eq. ng); the full model does not.
    body = columns(mu=1e9)
    A11, A12, A22, _ = (float(v[0]) for v in slip.MODEL.constants.of(body)[:4])
    A, J = np.array([[A11, A12], [A12, A22]]), np.diag([(100 + 6) / 5, (9 + 6) / 5])
    k = coefficients(body)
    paper = np.sort(np.sqrt(np.linalg.eigvals(np.linalg.inv(J) @ A)))
    np.testing.assert_allclose(np.sort([k.nu1[0], k.nu2[0]]), paper, rtol=1e-12)
    exact = np.sort(np.sqrt(np.linalg.eigvals(np.linalg.inv(J) @ (A - np.eye(2)))))
    values = np.linalg.eigvals(linear.jacobian(SLIP, slip.MODEL.constants.of(body), np.zeros(1)))[0]
    np.testing.assert_allclose(np.sort(values.imag[values.imag > 0.1]), exact, rtol=1e-6)


def test_best_shape_maximises_the_form_factor() -> None:
    b = np.linspace(1, 10, 9001)
    factor = analytic.form_factor(columns(b=b))
    assert b[factor.argmax()] == pytest.approx(analytic.best_b(10.0), abs=1e-3)
    assert round(analytic.best_b(10.0), 1) == 4.4  # the paper's «approximately 4.4»
    assert np.isnan(analytic.best_b(3.0))


@pytest.mark.parametrize("model", ["slip", "analytic", "averaged", "slow"])
@pytest.mark.parametrize("extreme", [{"c": 1e-20, "n0": 1e-300}, {"mu": 1e-300}])
def test_extreme_numbers_are_predicted_without_a_warning(model: str, extreme: dict[str, float]) -> None:
    sweep.predict({"model": model, "friction": {"mu": 60}}, **extreme)


@pytest.mark.parametrize("model", ["slip", "analytic", "averaged", "slow"])
def test_a_body_that_is_hardly_there_is_refused(model: str) -> None:
    with pytest.raises(sweep.InputError, match="differ by a factor of more than"):
        sweep.load_config({"model": model, "friction": {"mu": 60}}, {"c": 1e-300})
