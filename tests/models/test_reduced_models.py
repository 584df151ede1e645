"""The approximations of the full model: derivations, conserved quantities, limits, symmetry."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import Write, columns
from support.kernels import finish, images, kernel, spin

import sweep
from sweep.kernels.kernel import Kernel
from sweep.kernels.methods import automatic_step
from sweep.kernels.status import TIME_LIMIT
from sweep.models import MODELS
from sweep.models.ladder import averaged, effective
from sweep.models.model import stack, take
from sweep.models.theory.coefficients import coefficients, normal_coordinates
from sweep.models.theory.rocking import slower_period

small, quick = st.floats(-0.3, 0.3), st.floats(-0.5, 0.5)


def simulate(model: str, t_end: float, step: float | None = None, **parameters: Any) -> tuple[Kernel, np.ndarray]:
    """Final images of trajectories that are never taken as settled."""
    steps = automatic_step("dopri5", MODELS[model], columns(**parameters))[0] if step is None else step
    ours = kernel(model=model)
    table = finish(ours, images(ours, steps, t_end, **parameters), settle=False)
    assert set(ours.table(table)["status"]) == {TIME_LIMIT}
    return ours, table


def test_rolling_energy_drift() -> None:
    """Under 1e-9 over t = 1000 at the default step, and falling as the fifth power of the step or faster."""
    rolling, table = simulate("noslip", 1000.0)
    assert rolling.table(table)["violation"][0] / rolling.table(table)["energy_start"][0] < 1e-9
    steps = np.array([0.16, 0.113, 0.08, 0.0566])
    violation = [simulate("noslip", 1000.0, h)[1][0, rolling.layout.index("violation")] for h in steps]
    assert np.polyfit(np.log(steps), np.log(violation), 1)[0] > 4.9


def test_slip_tends_to_rolling_as_one_over_mu() -> None:
    mu = np.array([1e3, 4e3, 1.6e4])
    rolling = spin(*simulate("noslip", 100.0))[0]
    difference = np.abs(spin(*simulate("slip", 100.0, mu=mu)) - rolling)
    assert np.polyfit(np.log(mu), np.log(difference), 1)[0] == pytest.approx(-1, abs=0.02)


def test_averaged_conserves_without_friction() -> None:
    body = columns(mu=np.inf)
    k = coefficients(body)

    def invariants(y: np.ndarray) -> np.ndarray:
        A, B, n = y
        return np.array([(k.I3 * n**2 + A**2 + B**2)[0], (A ** (k.k4 / k.k1) * B)[0]])

    before = invariants(stack(averaged.start(body))[:, 0])
    change = []
    for step in (0.4, 0.2):
        _, table = simulate("averaged", 1000.0, step, mu=np.inf)
        change.append(np.abs(invariants(table[0, :3]) / before - 1))
    assert (change[1] < 1e-9).all()
    assert (change[0] / np.maximum(change[1], 1e-15) > 2**4.5).all() or (change[0] < 1e-12).all()


def test_effective_tends_to_averaged_for_small_rattle() -> None:
    """With A = sqrt(ν1² + 1) X0: the paper's sqrt(ν1² - 1) would be off by a quarter of the spin lost."""
    change = {}
    for name in ("effective", "averaged"):
        sizes = np.array([2e-3, 1e-3])
        ends = simulate(name, 20 * slower_period(columns())[0], x0=sizes, y0=sizes, mu=1e4, n0=0.002)
        change[name] = (spin(*ends) - 0.002) / sizes**2
    ratio = change["effective"] / change["averaged"]
    assert ratio == pytest.approx(1, abs=0.05)


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
    scale = 4.0
    one = simulate(name, 300.0, 0.01)
    large = {"a": 40.0, "b": 12.0, "c": 4.0, "mu": 30.0, "n0": 0.025, "x0": 0.04, "y0": 0.04}
    other = simulate(name, 600.0, 0.02, **large)
    assert spin(*other) * np.sqrt(scale) == pytest.approx(spin(*one), rel=1e-9)


@pytest.mark.parametrize("name", [*MODELS, "analytic"])
def test_mirror_image_reverses_alike(name: str, write: Write) -> None:
    text = "friction: {mu: 60}\nintegrator: {t_end: 4000}\n"
    one = sweep.run(write(text), model=name, b=[2.5, 4.0], n0=[-0.05, 0.03, 0.05])
    image = sweep.run(write(text), model=name, b=[2.5, 4.0], n0=[0.05, -0.03, -0.05], delta=-0.03, y0=-0.01)
    np.testing.assert_array_equal(one.reversals, image.reversals)
    np.testing.assert_array_equal(one.status, image.status)
    if "n_c1_plus_linear" in one:
        np.testing.assert_allclose(one.n_c1_plus_linear, -image.n_c1_minus_linear, rtol=1e-10)
    if name != "noslip":
        np.testing.assert_allclose(one.n_c1_plus, -image.n_c1_minus, rtol=1e-10)
        np.testing.assert_array_equal(one.reversals_predicted, image.reversals_predicted)


@pytest.mark.parametrize("name", ["effective", "averaged"])
def test_reduced_models_have_the_papers_critical_spins(name: str, write: Write) -> None:
    dataset = sweep.predict(write("friction: {mu: 75}\n"), model=name)
    assert float(dataset.n_c1_plus_linear) == pytest.approx(float(dataset.n_c1_plus), rel=3e-2)
    assert float(dataset.n_c1_minus_linear) == pytest.approx(float(dataset.n_c1_minus), rel=3e-2)


def test_rolling_has_no_critical_spin(write: Write) -> None:
    dataset = sweep.predict(write("model: noslip\n"))
    assert np.isnan(dataset.n_c1_plus_linear)
    assert np.isnan(dataset.n_c1_minus_linear)
    assert not {"reversals_predicted", "n_c1_plus"} & set(dataset.data_vars)


@given(small, small)
def test_normal_coordinates_carry_the_potential_energy(x: float, y: float) -> None:
    body = columns(x0=x, y0=y)
    k = coefficients(body)
    X, Y = normal_coordinates(body)
    height = 0.5 * (k.p * x**2 + 2 * k.q * x * y + k.s * y**2)
    np.testing.assert_allclose(0.5 * (k.nu1**2 * X**2 + k.nu2**2 * Y**2), height, rtol=1e-9, atol=1e-300)
