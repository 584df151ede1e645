"""The stiff method, against dopri5 at small steps, and its own parts."""

import numpy as np
import pytest
from support import columns
from support.kernels import kernel, run, spin

from sweep.kernels.adams.step import BDF, BDF_GAMMA, CORRECTOR_NODES, EXTRAPOLATE, PREDICTOR_NODES
from sweep.kernels.adams.weights import fitted_weights, plain_weights
from sweep.kernels.methods import automatic_step
from sweep.models import MODELS

ADAMS, DOPRI = kernel("adams"), kernel("dopri5")


@pytest.mark.parametrize("formula", [PREDICTOR_NODES, CORRECTOR_NODES], ids=["predictor", "corrector"])
def test_weights(formula: tuple[int, ...]) -> None:
    nodes, plain = np.array(formula), plain_weights(formula)
    # Adams-Bashforth 8 and Adams-Moulton 9, Hairer, Norsett & Wanner (1993), III.1.
    assert plain[0] == pytest.approx(434241 / 120960 if len(nodes) == 8 else 1070017 / 3628800, rel=1e-12)
    for nu in (1e-3, 0.1, 0.3, 0.45):
        w = fitted_weights(formula, np.array([nu]))[0]
        for k in range(len(nodes) - 4):
            assert w @ nodes.astype(float) ** k == pytest.approx(1 / (k + 1), rel=1e-10)
        for omega in (nu, 3 * nu):
            assert w @ np.cos(omega * nodes) == pytest.approx(np.sin(omega) / omega, rel=1e-11)
            assert w @ np.sin(omega * nodes) == pytest.approx((1 - np.cos(omega)) / omega, rel=1e-9)
    np.testing.assert_allclose(fitted_weights(formula, np.array([0.0, 1e-6])), [plain, plain], rtol=1e-9)
    many = np.linspace(0, 0.45, 37)
    one_by_one = [fitted_weights(formula, many[i : i + 1])[0] for i in range(len(many))]
    np.testing.assert_array_equal(fitted_weights(formula, many), one_by_one)


def test_bdf_and_extrapolation_are_exact_for_quartics() -> None:
    at = -np.arange(5.0)
    for k in range(5):
        assert np.dot(EXTRAPOLATE, at**k) == pytest.approx(1)
        assert np.dot(BDF, at**k) + BDF_GAMMA * k == pytest.approx(1)


def test_the_step_does_not_depend_on_friction() -> None:
    step, _ = automatic_step("adams", MODELS["slip"], columns(mu=[1e2, 1e3, 1e4, 1e5]), 1e-6)
    assert step == pytest.approx(step[0], rel=1e-3)
    # Between rolling and 1e5 as little is left as 1/μ says.
    rolling = kernel(model="noslip")
    exact = spin(rolling, run(rolling, 0.01, 100.0))
    distance = [abs(spin(ADAMS, run(ADAMS, 0.05, 100.0, mu=mu)) - exact)[0] for mu in (1e4, 1e5)]
    assert distance[0] / distance[1] == pytest.approx(10, rel=0.2)
