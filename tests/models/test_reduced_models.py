"""The approximations of the full model: derivations, balances, symmetry.

What they conserve, and their limits, are rows of `sweep.reproduce.theory`, which `tests/test_reproduce.py` tests.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import Write, columns
from support.kernels import kernel, run, spin

import sweep
from sweep.kernels.status import TIME_LIMIT
from sweep.models import MODELS
from sweep.models.ladder import averaged, effective
from sweep.models.model import take
from sweep.models.theory.coefficients import coefficients, normal_coordinates

small, quick = st.floats(-0.3, 0.3), st.floats(-0.5, 0.5)


@given(
    st.tuples(small, small, quick, quick, st.floats(-0.05, 0.05)).map(np.array),
    st.floats(3, 15), st.floats(1.2, 0.9 * 3), st.floats(-0.2, 0.2), st.floats(5, 500),
)  # fmt: skip
def test_effective_is_the_papers_equations_in_x_and_y(
    y: np.ndarray, a: float, b: float, delta: float, mu: float
) -> None:
    """(J1doty2), (J2dotx2) and (I3dotn2), solved for the second derivatives, against (eqx)-(eqn)."""
    body = columns(a=a, b=b, delta=delta, mu=mu)
    k = coefficients(body)
    p, q, s, J1, J2, I3 = (float(v[0]) for v in (k.p, k.q, k.s, k.J1, k.J2, k.I3))
    T = np.array([[np.cos(k.theta[0]), np.sin(k.theta[0])], [-np.sin(k.theta[0]), np.cos(k.theta[0])]])
    into = T @ np.diag(np.sqrt([J2, J1])) @ np.array([[p, q], [q, s]])
    (x, yy), (dx, dy), n = np.linalg.solve(into, y[:2]), np.linalg.solve(into, y[2:4]), y[4]
    mass = np.array([[J2 * p, J2 * q], [J1 * q, J1 * s]])
    ddx, ddy = np.linalg.solve(mass, [n * dy - x - dx / (J2 * mu), -n * dx - yy - dy / (J1 * mu)])
    dn = -(
        q * (x * ddx - yy * ddy) + s * x * ddy - p * ddx * yy + n * (x * dx + yy * dy)
        + q * (yy**2 - x**2) + (p - s) * x * yy + x * dy / (mu * J1) - yy * dx / (mu * J2)
    ) / I3  # fmt: skip
    slopes, _ = effective.rhs(tuple(y), take(effective.Constants.of(body), 0))
    expected = np.array([*y[2:4], *(into @ [ddx, ddy]), dn])
    np.testing.assert_allclose(slopes, expected, rtol=1e-8, atol=1e-9 * (1 + np.abs(expected).max()))


@given(st.tuples(small, small, quick).map(np.array), st.floats(0.1, 5))
def test_averaged_energy_balance(y: np.ndarray, c: float) -> None:
    p = take(averaged.Constants.of(columns(c=c)), 0)
    slopes, (_, dissipation, _, _) = averaged.rhs(y, p)
    n, rattle, inertia = averaged.energy(y + 1e-30j * np.array(slopes), p)
    assert (rattle + 0.5 * inertia * n**2).imag / 1e-30 == pytest.approx(-dissipation, abs=1e-12)


@pytest.mark.parametrize("name", MODELS)
def test_a_larger_body_moves_alike_in_its_own_time(name: str) -> None:
    made = kernel(model=name)
    large = {"a": 40.0, "b": 12.0, "c": 4.0, "mu": 30.0, "n0": 0.025, "x0": 0.04, "y0": 0.04}
    one, other = run(made, 0.01, 300.0), run(made, 0.02, 600.0, **large)
    assert made.table(one)["status"] == made.table(other)["status"] == TIME_LIMIT
    assert spin(made, other) * np.sqrt(4) == pytest.approx(spin(made, one), rel=1e-9)


@pytest.mark.parametrize("name", [*MODELS, "analytic"])
def test_mirror_image_reverses_alike(name: str, write: Write) -> None:
    text = "friction: {mu: 60}\nintegrator: {t_end: 4000}\n"
    one = sweep.run(write(text), model=name, b=[2.5, 4.0], n0=[-0.05, 0.03, 0.05])
    image = sweep.run(write(text), model=name, b=[2.5, 4.0], n0=[0.05, -0.03, -0.05], delta=-0.03, y0=-0.01)
    np.testing.assert_array_equal(one.reversals, image.reversals)
    np.testing.assert_array_equal(one.status, image.status)
    if "n_c1_linear" in one:
        np.testing.assert_allclose(one.n_c1_linear, -image.n_c1_linear.sel(sign=[-1, 1]), rtol=1e-10)
    if name != "noslip":
        np.testing.assert_allclose(one.n_c1, -image.n_c1.sel(sign=[-1, 1]), rtol=1e-10)
        np.testing.assert_array_equal(one.reversals_predicted, image.reversals_predicted)


@given(small, small)
def test_normal_coordinates_carry_the_potential_energy(x: float, y: float) -> None:
    body = columns(x0=x, y0=y)
    k = coefficients(body)
    X, Y = normal_coordinates(body)
    height = 0.5 * (k.p * x**2 + 2 * k.q * x * y + k.s * y**2)
    np.testing.assert_allclose(0.5 * (k.nu1**2 * X**2 + k.nu2**2 * Y**2), height, rtol=1e-9, atol=1e-300)
