"""Analytic and linear predictions against published numbers, other derivations and limits."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import columns
from support.kernels import threads

from sweep.grid import Grid
from sweep.models import MODELS, analytic, linear, slip
from sweep.models.coefficients import coefficients, rattle_period
from sweep.prediction import predict

SLIP = MODELS["slip"]


def test_critical_spins_equal_the_papers() -> None:
    # Takano (2011), text of sec. VI B: n_c1 = 0.00179, -0.01; n_c2 = 0.00358, -0.0201 at μ = 75.
    plus, minus = analytic.critical_spins(columns(mu=75))
    assert [round(2 * plus[0], 5), round(2 * minus[0], 4)] == [0.00358, -0.0201]
    assert [round(plus[0], 5), round(minus[0], 2)] == [0.00179, -0.01]


def test_linear_critical_spins() -> None:
    # design/model.md, from an independent implementation.
    plus, minus = linear.critical_spins(SLIP, columns(mu=[75, 200]), analytic.critical_spins(columns(mu=[75, 200])))
    assert [round(plus[0], 7), round(minus[0], 7)] == [0.0019611, -0.0116503]
    assert [round(plus[1], 6), round(minus[1], 6)] == [0.000736, -0.004353]


@pytest.mark.parametrize("guess", [1e-5, 0.0018, 0.05, 5.0])
def test_linear_critical_spins_do_not_depend_on_the_guess(guess: float) -> None:
    plus, minus = linear.critical_spins(SLIP, columns(), (np.array([guess]), np.array([-guess])))
    sure, sure_minus = linear.critical_spins(SLIP, columns(), analytic.critical_spins(columns()))
    np.testing.assert_allclose([plus, minus], [sure, sure_minus], rtol=1e-9)


def test_rattle_neither_grows_nor_decays_at_a_critical_spin() -> None:
    body = columns(mu=[20, 75, 200], b=[2, 3, 8])
    for spin in linear.critical_spins(SLIP, body, analytic.critical_spins(body)):
        constants = slip.Constants.of(body)
        assert np.abs(linear.growth_rate(SLIP, constants, spin)).max() < 1e-13
        assert (linear.growth_rate(SLIP, constants, 0.99 * spin) < 0).all()
        assert (linear.growth_rate(SLIP, constants, 1.01 * spin) > 0).all()


def test_nothing_is_critical_where_nothing_couples() -> None:
    for body in (columns(delta=0.0), columns(a=5, b=5)):
        assert np.isnan(analytic.critical_spins(body)).all()
        upper, lower = linear.critical_spins(SLIP, body, analytic.critical_spins(body))
        assert (upper, lower) == (np.inf, -np.inf)
        assert analytic.reversal_count(body) == 0


def test_without_friction_no_spin_is_stable() -> None:
    body = columns(mu=0.0)
    assert np.isnan(linear.critical_spins(SLIP, body, analytic.critical_spins(body))).all()
    assert np.isnan(analytic.critical_spins(body)).all()


def test_a_nearly_round_body_is_stable_again_at_faster_spin() -> None:
    body = columns(b=8.0, mu=100.0)
    _, minus = linear.critical_spins(SLIP, body, analytic.critical_spins(body))
    near, far = linear.outer_range(SLIP, body, minus, np.array([0.2]))
    constants = slip.Constants.of(body)
    growth = [linear.growth_rate(SLIP, constants, np.array([n]))[0] for n in (near[0], far[0])]
    assert np.abs(growth).max() < 1e-13
    assert far < -0.05 < near < minus
    assert linear.growth_rate(SLIP, constants, (near + far) / 2) < 0
    beyond_reach = linear.outer_range(SLIP, body, minus, np.array([0.05]))[1]
    assert beyond_reach == -np.inf
    assert np.isnan(linear.outer_range(SLIP, columns(), np.array([0.002]), np.array([0.1]))).all()


def by_inequalities(n0: float, upper: float, lower: float) -> int:
    """n_r as (nrk0), (nrk1) say it: K(n_r - 1) < 1/h1 <= K(n_r), in exact arithmetic."""
    here, there = (upper, -lower) if n0 > 0 else (-lower, upper)
    x, rho = abs(Fraction(n0)) / (2 * Fraction(here)), Fraction(there) / Fraction(here)
    n_r, K = 0, Fraction(1)
    while x > K:
        n_r += 1
        K += rho if n_r % 2 else 1
    return n_r


def test_stability_is_the_same_on_any_number_of_threads() -> None:
    bodies = columns(mu=np.linspace(20, 200, 1201), b=np.linspace(1.2, 9.8, 1201), n0=0.3)
    found = []
    for number in (1, 2):
        with threads(number):
            stability = predict(slip.MODEL, Grid({}, {}, bodies)).stability
        assert stability
        found.append(stability.ranges)
    np.testing.assert_array_equal(found[0], found[-1])
    upper, lower = linear.critical_spins(slip.MODEL, bodies, analytic.critical_spins(bodies))
    np.testing.assert_array_equal(found[0][:2], [lower, upper])
    assert np.isfinite(found[0][2:]).any()


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


@given(mu=st.floats(5, 300), b=st.floats(1.2, 9.5), delta=st.floats(0.005, 0.1), n0=st.floats(-0.2, 0.2))
def test_mirror_image_has_mirrored_predictions(mu: float, b: float, delta: float, n0: float) -> None:
    body, image = columns(mu=mu, b=b, delta=delta, n0=n0), columns(mu=mu, b=b, delta=-delta, n0=-n0)
    plus, minus = analytic.critical_spins(body)
    np.testing.assert_allclose(analytic.critical_spins(image), (-minus, -plus), rtol=1e-12)
    assert analytic.reversal_count(body) == analytic.reversal_count(image)


@given(scale=st.floats(0.1, 10), mu=st.floats(5, 300), b=st.floats(1.2, 9.5), n0=st.floats(-0.2, 0.2))
def test_predictions_scale_with_the_body(scale: float, mu: float, b: float, n0: float) -> None:
    body = columns(mu=mu, b=b, n0=n0)
    rate = np.sqrt(scale)
    large = columns(a=10 * scale, b=b * scale, c=scale, mu=mu / rate, n0=n0 / rate)
    np.testing.assert_allclose(
        np.array(analytic.critical_spins(large)) * rate, analytic.critical_spins(body), rtol=1e-9
    )
    np.testing.assert_allclose(rattle_period(large) / rate, rattle_period(body), rtol=1e-12)
    np.testing.assert_allclose(analytic.form_factor(large), analytic.form_factor(body), rtol=1e-9)


def test_frequencies() -> None:
    # Rocking without slip and spin: inertia J about the contact, height r = c + uᵀ(A - c²)u / 2c.
    # The paper neglects c² beside A («(1 - s) y ~ y» under Eq. ng); the full model does not.
    body = columns(mu=1e9)
    A11, A12, A22, _ = (float(v[0]) for v in slip.Constants.of(body)[:4])
    A, J = np.array([[A11, A12], [A12, A22]]), np.diag([(100 + 6) / 5, (9 + 6) / 5])
    k = coefficients(body)
    paper = np.sort(np.sqrt(np.linalg.eigvals(np.linalg.inv(J) @ A)))
    np.testing.assert_allclose(np.sort([k.nu1[0], k.nu2[0]]), paper, rtol=1e-12)
    exact = np.sort(np.sqrt(np.linalg.eigvals(np.linalg.inv(J) @ (A - np.eye(2)))))
    values = np.linalg.eigvals(linear.jacobian(SLIP, slip.Constants.of(body), np.zeros(1)))[0]
    np.testing.assert_allclose(np.sort(values.imag[values.imag > 0.1]), exact, rtol=1e-6)


def test_best_shape_maximises_the_form_factor() -> None:
    b = np.linspace(1, 10, 9001)
    factor = analytic.form_factor(columns(b=b))
    assert b[factor.argmax()] == pytest.approx(analytic.best_b(10.0), abs=1e-3)
    assert round(analytic.best_b(10.0), 1) == 4.4  # the paper's «approximately 4.4»
    assert np.isnan(analytic.best_b(3.0))
