"""The reversal time of Garcia and Hubbard: against eigenvalues, an integration of the three-variable equations, a
limit, symmetries, and the cases in which there is none."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support import cells, columns, wide_bodies
from support.physics import KANE_LEVINSON

import sweep
from sweep.models import find
from sweep.models.general import rigid_body
from sweep.models.general.reversal_time import energies, first_reversal, growth
from sweep.models.theory import linear

ANGLES = {"roll": 0.01, "pitch": -0.02, "omega1": 0.3, "omega2": -0.1, "omega3": -1.0}
NO_SLIP = np.zeros(1), np.zeros(1)
FIRST = ["reversals", {"reversal_times": 1}]


def bodies() -> dict[str, tuple[str, dict[str, np.ndarray]]]:
    offset = wide_bodies(20)
    return {
        "paper": ("noslip", columns(b=[2.0, 3.0, 5.0, 8.5], delta=[0.03, -0.1, 0.3, 0.2])),
        "wide": ("noslip+solid+offset", offset | {"offset": 0.4 * offset["c"]}),
        "real": ("noslip+solid+offset+gravity", cells(**KANE_LEVINSON)),
    }


@pytest.mark.parametrize("name", bodies())
def test_the_modes_grow_as_the_eigenvalues_say(name: str) -> None:
    which, body = bodies()[name]
    model, spin = find(which), 1e-5 * find(which).spin_unit(body)
    values = linear.jacobian(model, model.constants.of(body), spin)
    found = np.stack(growth(body), axis=-1)
    for J, n, sigma in zip(values, spin, found, strict=True):
        rates = np.linalg.eigvals(J)
        rates = rates[np.argsort(rates.imag)][-2:]
        np.testing.assert_allclose(rates.real, sigma * n, rtol=1e-6)


def test_the_energies_of_the_modes_make_up_that_of_the_rattle() -> None:
    body = cells(**KANE_LEVINSON, **{name: 1e-4 * value for name, value in ANGLES.items()})
    model = find("noslip+solid+offset+gravity")
    _, rattle, _ = model.energy(model.start(body), model.constants.of(body))
    assert sum(energies(body))[0] == pytest.approx(rattle[0], rel=1e-4)


def test_a_mode_by_itself_keeps_the_other_at_rest() -> None:
    """The modes are eigenvectors of the Jacobian at rest, found without the formulas."""
    body = cells(**KANE_LEVINSON)
    model = find("noslip+solid+offset+gravity")
    rates, modes = np.linalg.eig(linear.jacobian(model, model.constants.of(body), np.zeros(1))[0])
    for mode, place in zip(np.argsort(rates.imag)[-2:], (0, 1), strict=True):
        own = 1e-6 * (modes[:, mode] / modes[:, mode][0]).real
        (u1, u2), (w1, w2) = (rigid_body.turned(*own[i : i + 2], -rigid_body.axes(body)[0]) for i in (0, 2))
        found = energies(body | cells(roll=-u2, pitch=u1, omega1=w1, omega2=w2, omega3=0.0))
        assert found[1 - place][0] < 1e-9 * found[place][0]


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("n_c", [0.0, 0.008])
def test_the_time_is_that_of_the_three_variable_equations(side: int, n_c: float) -> None:
    """Integrated by SciPy, with the energy of the mode that decays left out."""
    body = columns(n0=0.05 * side)
    J = rigid_body.inertia(body)[2][0]
    sigma, E = next(
        (s[0], e[0]) for s, e in zip(growth(body), energies(body), strict=True) if s[0] * side > 0
    )  # fmt: skip

    def slopes(_: float, y: np.ndarray) -> list[float]:
        n, log_energy = y
        return [-2 * sigma * np.exp(log_energy) / J, 2 * sigma * (n - side * n_c)]

    def vanishes(_: float, y: np.ndarray) -> float:
        return float(y[0])

    vanishes.terminal = True  # type: ignore[attr-defined]
    solution = solve_ivp(slopes, (0, 1e5), [0.05 * side, np.log(E)], "DOP853", rtol=1e-12, atol=1e-14, events=vanishes)
    (found,) = first_reversal(body, (np.array([n_c]), np.array([-n_c])))
    assert found == pytest.approx(solution.t[-1], rel=1e-9)


def test_the_mirror_image_reverses_at_the_same_time() -> None:
    for delta, n0 in ((0.03, 0.05), (0.3, -0.2)):
        one, other = (first_reversal(columns(delta=s * delta, n0=s * n0, y0=s * 0.02), NO_SLIP)[0] for s in (1, -1))
        assert one == pytest.approx(other, rel=1e-13)


@pytest.mark.parametrize(
    ("model", "given", "predicted"),
    [
        ("noslip", {}, True),
        ("noslip", {"delta": 0.0}, False),  # nothing couples spin and rattle
        ("noslip", {"b": 10.0}, False),
        ("noslip", {"n0": 0.0}, False),
        ("noslip", {"x0": 0.0, "y0": 0.0}, False),  # no rattle grows
        ("noslip", {"sigma": 1e-4}, False),  # the formula does not cover it
        ("noslip", {"offset": 0.3}, True),
        ("slip", {"mu": 100.0}, True),
        ("slip", {"mu": 100.0, "n0": 0.002}, False),  # friction stops the reversal
        ("slip", {"mu": 0.0}, False),
    ],
)
def test_a_time_is_predicted_where_the_formula_gives_one(model: str, given: dict[str, float], predicted: bool) -> None:
    found = sweep.predict({"model": model, "measure": FIRST}, **given)
    assert np.isnan(found.t_first_reversal_predicted) != predicted


def test_the_prediction_comes_with_the_measured_times() -> None:
    for measure, predicted in ((["reversals", "reversal_times"], True), (["reversals"], False)):
        found = sweep.predict({"model": "noslip", "measure": measure})
        assert ("t_first_reversal_predicted" in found) == predicted


def test_much_friction_is_as_no_slip() -> None:
    """The time tends to the one without slip as 1/μ."""

    def time(**given: Any) -> np.ndarray:
        return sweep.predict({"measure": FIRST} | given).t_first_reversal_predicted.values

    late = time(friction={"mu": [1e3, 1e4, 1e5]}) - time(model="noslip")
    np.testing.assert_allclose(late[:-1] / late[1:], 10, rtol=0.05)


def test_the_simulated_time_tends_to_the_predicted_one() -> None:
    """With a rattle in proportion to the spin, their ratio tends to one as the square of the spin."""

    def ratio(n0: float) -> float:
        scene = {"model": "noslip", "start": {"n0": n0, "x0": 0.2 * abs(n0), "y0": 0.2 * abs(n0)}}
        found = sweep.run(scene, t_end=12 / abs(n0))
        assert found.reversals == 1  # the last one is the first
        return float(found.t_last_reversal / sweep.predict(scene, measure=FIRST).t_first_reversal_predicted)

    for side in (1, -1):
        off = np.array([ratio(side * n0) - 1 for n0 in (0.04, 0.02, 0.01)])
        assert off[-1] < 0.003
        np.testing.assert_allclose(np.log2(off[:-1] / off[1:]), 2, atol=0.3)


def test_a_body_that_cannot_stand_has_no_time_and_gives_no_warning() -> None:
    cases = {"c": [1.1, 1.3], "b": [1.2, 1.2]}
    found = sweep.predict({"friction": {"mu": 20}, "start": {"n0": 0.02}, "cases": cases, "measure": FIRST})
    assert np.isnan(found.t_first_reversal_predicted[1])
