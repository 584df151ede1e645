"""The ripple-free spin against a numerical derivation, and on rattles that ripple."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from support import columns
from support.ripple import form as numerical_form
from support.ripple import rolling

from sweep.models import MODELS
from sweep.models.model import Model, take

bodies = st.fixed_dictionaries(
    {"a": st.floats(5, 50), "b": st.floats(1.5, 4.5), "c": st.floats(0.5, 1.2), "delta": st.floats(-0.5, 0.5)}
)


@given(bodies)
def test_form_agrees_with_a_numerical_derivation(body: dict[str, float]) -> None:
    ours = np.reshape(MODELS["noslip"].ripple.of(columns(**body))[:4], (2, 2))
    theirs = numerical_form(columns(**body))
    np.testing.assert_allclose(ours, theirs, atol=1e-3 * np.abs(theirs).max())


def scatter(model: Model, start: np.ndarray, body: dict[str, np.ndarray]) -> tuple[float, float]:
    """How far n and n* scatter about parabolas in time."""
    constants = take(model.constants.of(body), 0)
    times = np.linspace(0, 60, 4001)
    y = solve_ivp(lambda _, y: model.rhs(tuple(y), constants)[0], (0, 60), start, "DOP853", times,
                  rtol=1e-12, atol=1e-22).y  # fmt: skip
    spin = model.rhs(tuple(y), constants)[1][0] * np.ones(len(times))
    steady = spin - model.ripple.value(tuple(y), constants, [k[0] for k in model.ripple.of(body)])
    left, right = (float(np.std(n - np.polynomial.Polynomial.fit(times, n, 2)(times))) for n in (spin, steady))
    return left, right


@pytest.mark.parametrize("c", [1.0, 1.7])
@pytest.mark.parametrize(("name", "left"), [("noslip", 1e-5), ("slip", 0.02), ("effective", 1e-5)])
def test_no_ripple_is_left(name: str, left: float, c: float) -> None:
    """For a small rattle at n = 0.  Friction, here μ = 200, leaves a hundredth."""
    body = columns(b=5.0, c=c, mu=1e9 if name == "effective" else 200.0)
    start = rolling(1e-4 * np.array([0.7, 0.9, 7.0, 4.0]), body)
    if name == "effective":
        start = np.array([7e-5, 9e-5, 3e-5, 2e-5, 0.0])
    if name == "slip":
        start = np.array([*start, 0.0, 0.0])
    spin, steady = scatter(MODELS[name], start, body)
    assert 0 < steady < left * spin


def test_a_body_round_about_one_axis_has_a_form() -> None:
    assert np.isfinite(MODELS["noslip"].ripple.of(columns(b=[1.0, 10.0], delta=0.0))).all()
