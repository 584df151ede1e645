"""Any body and any law of friction, against equations derived another way, and against limits that are known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support import STANDARD, columns, newton

from sweep.models import find
from sweep.models.general import rigid_body
from sweep.models.general import ripple as general_ripple
from sweep.models.general.bounds import strongest_grip
from sweep.models.general.couples import COUPLES as KINDS
from sweep.models.general.laws import LAWS, tanh_ratio
from sweep.models.general.surfaces import ELLIPSOID, PARABOLOID, Surface
from sweep.models.general.variants import variant
from sweep.models.ladder import noslip, slip
from sweep.models.model import LINEAR, take
from sweep.models.theory import linear, rocking, stability

BODY = {"a": 0.2, "b": 0.03, "c": 0.02, "offset": 0.01, "mass": 0.7, "gravity": 9.81}
KANE_LEVINSON = BODY | {"mass": 1.0, "Ixx": 2e-4, "Iyy": 1.6e-3, "Izz": 1.7e-3, "Ixy": -2e-5}
SKEW = KANE_LEVINSON | {"mass": 0.7, "Ixz": 3e-5, "Iyz": -1e-5}
FRICTION = {"radius_contact": 0.004, "mu": 0.4, "mu_static": 0.7, "mu_viscous": 0.3, "speed": 0.05, "speed_stick": 0.02}
COUPLES = {"sigma": 1e-4, "mu_rolling": 0.1, "radius": 0.004, "speed_rolling": 0.5}
COUPLES |= {"mu_spinning": 0.2, "radius_spinning": 0.003, "speed_spinning": 2.0}
BOWL = SKEW | {"a": 0.012, "b": 0.35, "surface": "paraboloid"}
"""A paraboloid: radii of curvature 0.83 and 0.029 at the lowest point."""
ANGLES = {"roll": np.pi / 360, "pitch": np.pi / 360, "omega1": 0.0, "omega2": 0.0, "omega3": -5.0}


def cells(**parameters: Any) -> dict[str, np.ndarray]:
    parameters = {name: value for name, value in parameters.items() if name != "surface"}
    arrays = np.broadcast_arrays(*(np.atleast_1d(np.asarray(value, float)) for value in parameters.values()))
    return {name: array.copy() for name, array in zip(parameters, arrays, strict=True)}


def one(name: str, parameters: dict[str, Any]) -> tuple[Any, Any]:
    """A model and its constants for one body, as scalars."""
    model = find(name)
    return model, take(model.constants.of(cells(**parameters)), 0)


def states(number: int, count: int) -> np.ndarray:
    """Random states, far from upright."""
    random = np.random.default_rng(number)
    tilt, omega = random.uniform(-0.45, 0.45, 2), random.uniform(-6, 6, 3)
    return np.array([*tilt, *omega, *random.uniform(-0.1, 0.1, 2)])[:count]


@pytest.mark.parametrize(
    "couples", ["", "+sigma", "+rolling", "+spinning", "+sigma+rolling", "+sigma+rolling+spinning"]
)
@pytest.mark.parametrize("law", [*LAWS, None])
@pytest.mark.parametrize("body", [SKEW, BOWL], ids=["ellipsoid", "paraboloid"])
def test_the_equations_are_those_of_newton_and_euler(body: dict[str, Any], law: str | None, couples: str) -> None:
    parameters = body | FRICTION
    for couple in filter(None, couples.split("+")):
        parameters = parameters | {name: COUPLES[name] for name in KINDS[couple].parameters}
    name = f"slip+{law}{couples}" if law else f"noslip+solid{couples}"
    model, constants = one(f"{name}+paraboloid" if body is BOWL else name, parameters)
    for number in range(30):
        y = states(number, len(model.states))
        slopes, (spin, power, force, _) = model.rhs(tuple(y), constants)
        expected, N, lost = newton.derivative(y, parameters, law)
        np.testing.assert_allclose(slopes, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())
        assert force == pytest.approx(N / parameters["mass"], rel=1e-12)
        assert power == pytest.approx(lost / parameters["mass"], rel=1e-12)
        assert spin == pytest.approx(y[2:5] @ [y[0], y[1], -np.sqrt(1 - y[0] ** 2 - y[1] ** 2)], rel=1e-12)


@pytest.mark.parametrize(
    "name",
    [
        *(f"slip+{law}+sigma+rolling" for law in LAWS),
        "noslip+solid",
        "noslip+solid+rolling",
        "slip+viscous+spinning",
        "noslip+solid+sigma+spinning",
        "slip+coulomb-tanh+sigma+paraboloid",
        "noslip+solid+paraboloid",
    ],
)
def test_only_friction_changes_the_energy(name: str) -> None:
    model, constants = one(name, (BOWL if "paraboloid" in name else SKEW) | FRICTION | COUPLES)
    for number in range(20):
        y = states(number, len(model.states))
        slopes, (_, power, _, _) = model.rhs(tuple(y), constants)
        spin, rattle, inertia = model.energy(tuple(y + 1e-30j * np.array(slopes)), constants)
        change = (rattle + 0.5 * inertia * spin**2).imag / 1e-30
        scale = np.abs(rattle) + np.abs(spin) ** 2 * inertia
        assert change == pytest.approx(-power, rel=1e-11, abs=1e-11 * scale * np.abs(slopes).max())


@pytest.mark.parametrize(("name", "body"), [("slip+viscous", SKEW), ("slip+viscous+paraboloid", BOWL)])
def test_the_energy_is_that_of_a_rigid_body(name: str, body: dict[str, Any]) -> None:
    model, constants = one(name, body | FRICTION)
    for number in range(20):
        y = states(number, 7)
        u = np.array([y[0], y[1], -np.sqrt(1 - y[0] ** 2 - y[1] ** 2)])
        x_p, v = newton.contact(u, body), np.array([y[5], y[6], -(y[5] * u[0] + y[6] * u[1]) / u[2]])
        v_g, rest = v + np.cross(x_p, y[2:5]), SKEW["c"] - SKEW["offset"]
        expected = y[2:5] @ newton.inertia(SKEW) @ y[2:5] / 2 / SKEW["mass"] + v_g @ v_g / 2
        expected += SKEW["gravity"] * (-x_p @ u - rest)
        spin, rattle, inertia = model.energy(tuple(y), constants)
        assert rattle + 0.5 * inertia * spin**2 == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("name", ["slip", "noslip"])
def test_the_papers_body_is_a_special_case(name: str) -> None:
    parameters = STANDARD | {"b": 4.0, "delta": 0.3}
    paper, general = one(name, parameters), one(f"{name}+{'viscous' if name == 'slip' else 'solid'}", parameters)
    cos, sin = np.cos(0.3), np.sin(0.3)
    turn = np.array([[cos, -sin], [sin, cos]])

    def turned(y: np.ndarray) -> np.ndarray:
        return np.array([*turn @ y[:2], *turn @ y[2:4], y[4], *(turn @ y[5:] if len(y) > 5 else ())])

    start = [np.array(model.start(columns(**parameters)))[:, 0] for model, _ in (paper, general)]
    np.testing.assert_allclose(turned(start[0]), start[1], rtol=1e-14, atol=1e-17)
    for number in range(20):
        y = 0.1 * states(number, len(paper[0].states))
        (slopes, seen), (others, also) = (
            model.rhs(tuple(z), constants) for (model, constants), z in ((paper, y), (general, turned(y)))
        )
        np.testing.assert_allclose(turned(np.array(slopes)), others, rtol=1e-11, atol=1e-13)
        np.testing.assert_allclose(seen[:3], also[:3], rtol=1e-11, atol=1e-13)


def test_the_papers_ripple_period_and_bounds_are_a_special_case() -> None:
    body = columns(b=[2.0, 3.0, 5.0, 8.5], delta=[0.03, -0.1, 0.3, 0.2])
    np.testing.assert_allclose(rigid_body.slower_period(body), rocking.slower_period(body), rtol=1e-12)
    general = find("slip+viscous")
    for i in range(4):
        y = 1e-3 * states(i, 7)
        cos, sin = np.cos(body["delta"][i]), np.sin(body["delta"][i])
        turn = np.array([[cos, -sin], [sin, cos]])
        z = np.array([*turn @ y[:2], *turn @ y[2:4], y[4], *turn @ y[5:]])
        expected, found = (
            model.ripple.value(tuple(at), take(model.constants.of(body), i), [k[i] for k in model.ripple.of(body)])
            for model, at in ((slip.MODEL, y), (general, z))
        )
        assert found == pytest.approx(expected, rel=1e-10)
    ratio = general.fastest_decay(body) / slip.MODEL.fastest_decay(body)
    assert (ratio > 0.95).all()
    assert (ratio < 1.3).all()


@pytest.mark.parametrize("body", [KANE_LEVINSON, SKEW])
def test_frequencies_are_those_of_the_equations(body: dict[str, float]) -> None:
    model, _ = one("noslip+solid", body)
    values = linear.jacobian(model, model.constants.of(cells(**body)), np.zeros(1))[0]
    expected = np.unique(np.abs(np.linalg.eigvals(values).imag).round(9))
    np.testing.assert_allclose(np.ravel(rigid_body.frequencies(cells(**body))), expected[-2:], rtol=1e-8)


def test_the_ripple_free_spin_of_a_real_body_hardly_ripples() -> None:
    """Of a small rolling rattle at n = 0 only terms of higher order are left."""
    model, constants = one("noslip+solid", KANE_LEVINSON)
    u, omega = np.array([3e-4, -2e-4]), np.array([4e-3, 1e-3])
    y = np.array([*u, *omega, u @ omega])
    times = np.linspace(0, 3 * rigid_body.slower_period(cells(**KANE_LEVINSON))[0], 400)
    course = newton.follow(y, KANE_LEVINSON, None, times)
    spin = model.energy(course, constants)[0]
    steady_spin = spin - model.ripple.value(
        course, constants, [k[0] for k in general_ripple.form(cells(**KANE_LEVINSON))]
    )
    trend = [values - np.polyval(np.polyfit(times, values, 3), times) for values in (spin, steady_spin)]
    assert np.std(trend[1]) < 0.05 * np.std(trend[0])


@pytest.mark.parametrize("law", [law for law in LAWS if law not in ("none", "contensou")])
def test_the_bound_on_a_laws_resistance_holds_and_is_near(law: str) -> None:
    p, x = FRICTION | KANE_LEVINSON, np.linspace(0, 0.3, 30001)
    force = np.array([newton.LAWS[law](each, p) for each in x])
    steepest = np.diff(force).max() / x[1]
    (bound,) = LAWS[law].strongest(cells(**p))
    assert steepest <= bound * (1 + 1e-9)
    assert steepest >= 0.7 * bound


def test_contensou_over_a_circle() -> None:
    """Dry friction of every point of the contact, integrated over the pressure of Hertz."""
    radius, p = 0.004, {"mu": 0.4, "radius_contact": 0.004, "speed": 1e-9}
    nodes, weights = np.polynomial.legendre.leggauss(400)
    r, angle = radius * np.sin(np.pi / 4 * (nodes + 1)), np.linspace(0, 2 * np.pi, 401)[:-1] + 1e-3
    share = 3 / (2 * np.pi * radius**2) * np.sqrt(1 - (r / radius) ** 2) * r * weights
    share = share * radius * np.cos(np.pi / 4 * (nodes + 1)) * np.pi / 4
    x, y, share = r[:, None] * np.cos(angle), r[:, None] * np.sin(angle), share[:, None] * 2 * np.pi / 400
    assert share.sum() * 400 == pytest.approx(1, rel=1e-9)

    def exact(v: float, n: float) -> tuple[float, float]:
        along, across = v - n * y, n * x
        speed = np.hypot(along, across)
        return (share * along / speed).sum(), (share * (x * across - y * along) / speed).sum() / radius

    def ours(v: float, n: float) -> tuple[float, float]:
        k, m = LAWS["contensou"].coupled(v**2, n**2, SimpleNamespace(**p))
        return k * v / 0.4, m * n / 0.4 / radius

    farthest = np.zeros(2)
    for d in (1e-5, 1e-3, 0.1, 0.3, 0.6, 0.9, 1.0, 1.05, 1.1, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 6.0, 10.0, 1e3):
        found, expected = np.array(ours(d * 2.0 * radius, 2.0)), np.array(exact(d * 2.0 * radius, 2.0))
        off = np.abs(found - expected)
        assert off.max() < (5e-6 if d <= 1 else 1.3e-4)
        farthest = np.maximum(farthest, off)
        if d in (1e-5, 1e3):
            np.testing.assert_allclose(found, expected, rtol=1e-5)  # as the sum over the circle
    assert farthest.min() > 5e-5, "as its description says"


def test_contensou_is_smooth_and_bounded() -> None:
    """Value and slope where the two expressions meet, and the bounds by which steps are chosen."""
    law, p = LAWS["contensou"], {"mu": 0.4, "radius_contact": 0.004, "speed": 1e-3}
    for scale in (1 - 1e-9, 1 + 1e-9):
        along = [law.coupled(0.0, (1e-3 / 0.004 / d) ** 2, SimpleNamespace(**p)) for d in (scale, scale + 1e-6)]
        slopes = (np.array(along[1]) - np.array(along[0])) / 1e-6
        # k = μ F / s and m = μ ε² M d / s at v = 0, with C = 3π/8
        expected = 0.4 / 1e-3 * np.array([3 * np.pi / 32, 0.004**2 * (9 * np.pi / 128 - 3 * np.pi / 32)])
        np.testing.assert_allclose(slopes, expected, rtol=1e-3)
    slips, spins = np.geomspace(1e-7, 1, 400)[:, None], np.geomspace(1e-4, 1e4, 400)
    k, m = law.coupled(slips**2, spins**2, SimpleNamespace(**p))
    columns = cells(**p, a=1.0)
    for steepest, bound in (
        ((np.diff(k * slips, axis=0) / np.diff(slips, axis=0)).max(), law.strongest(columns)),
        ((np.diff(m * spins, axis=1) / np.diff(spins)).max(), law.strongest_couple(columns)),
    ):
        assert 0.7 * bound <= steepest <= bound * (1 + 1e-9)


def test_tanh_to_round_off() -> None:
    x = np.concatenate([[0.0], np.geomspace(1e-9, 700, 4001)])
    with np.errstate(invalid="ignore"):
        expected = np.where(x > 0, np.tanh(x) / x, 1.0)
    np.testing.assert_allclose(tanh_ratio(x**2), expected, rtol=4e-15)


@pytest.mark.parametrize("surface", [ELLIPSOID, PARABOLOID])
def test_the_slip_decays_no_faster_than_the_bound(surface: Surface) -> None:
    """On random states that the energy at the start allows."""
    bowl = {"a": 0.005, "b": 0.222} if surface is PARABOLOID else {}
    body = cells(**(KANE_LEVINSON | bowl | FRICTION), n0=4.0, x0=0.0, y0=0.0)
    model = find("slip+viscous+paraboloid" if surface is PARABOLOID else "slip+viscous")
    grip = strongest_grip(body, surface)[0]
    spin, rattle, inertia = model.energy(model.start(body), model.constants.of(body))
    energy = (rattle + 0.5 * inertia * spin**2)[0]
    constants, largest, random = take(model.constants.of(body), 0), 0.0, np.random.default_rng(3)
    for _ in range(4000):
        y = random.normal(size=7) * [0.1, 0.1, 4, 4, 4, 0, 0]
        y *= random.uniform()
        spin, rattle, inertia = model.energy(tuple(y), constants)
        if rattle + 0.5 * inertia * spin**2 > energy:
            continue
        rates = np.zeros((2, 2))
        for i in (0, 1):
            at = y.astype(complex)
            at[5 + i] = 1e-30j
            rates[:, i] = [each.imag / 1e-30 for each in model.rhs(tuple(at), constants)[0][5:]]
        largest = max(largest, -np.linalg.eigvals(rates).real.min() / FRICTION["mu"])
    assert 0.4 * grip < largest <= 1.02 * grip


def test_the_spin_decays_no_faster_than_the_bound() -> None:
    """About zero spin, where spinning friction is steepest, at random attitudes that the energy at the start allows."""
    spinning = {"mu_spinning": 0.2, "radius_spinning": 0.003, "speed_spinning": 0.01}
    body = cells(**KANE_LEVINSON, **spinning, n0=3.0, x0=0.0, y0=0.0)
    model = find("noslip+solid+spinning")
    bound, constants, random = model.fastest_decay(body)[0], take(model.constants.of(body), 0), np.random.default_rng(7)
    spin, rattle, inertia = model.energy(model.start(body), model.constants.of(body))
    energy, largest = (rattle + 0.5 * inertia * spin**2)[0], 0.0
    for _ in range(3000):
        u1, u2 = random.normal(size=2) * 0.1
        w1, w2 = random.normal(size=2) * 3
        y = np.array([u1, u2, w1, w2, (u1 * w1 + u2 * w2) / np.sqrt(1 - u1**2 - u2**2)])
        spin, rattle, inertia = model.energy(tuple(y), constants)
        if rattle + 0.5 * inertia * spin**2 > energy:
            continue
        rates = np.zeros((3, 3))
        for i in range(3):
            at = y.astype(complex)
            at[2 + i] += 1e-30j
            rates[:, i] = [each.imag / 1e-30 for each in model.rhs(tuple(at), constants)[0][2:]]
        largest = max(largest, -np.linalg.eigvals(rates).real.min())
    assert 0.4 * bound < largest <= 1.02 * bound


def test_no_point_of_a_paraboloid_is_below_the_contact_point() -> None:
    _, constants = one("noslip+solid+paraboloid", BOWL)
    x, y = np.meshgrid(np.linspace(-2, 2, 401), np.linspace(-0.2, 0.2, 401))
    z = 0.02 * (1 - 0.012 * (x / 0.02) ** 2 - 0.35 * (y / 0.02) ** 2) - 0.01
    for number in range(10):
        u1, u2, *omega = states(number, 5)
        u3 = -np.sqrt(1 - u1**2 - u2**2)
        _, point, _, _ = PARABOLOID.contact(u1, u2, *omega, constants)
        lowest = np.array(point) @ [u1, u2, u3]
        heights = x * u1 + y * u2 + z * u3
        assert lowest <= heights.min()
        assert heights.min() < lowest + 1e-3
        (rest,) = rigid_body.height(cells(**BOWL))
        assert PARABOLOID.elevation(u1, u2, u3, constants)[0] == pytest.approx(-lowest - rest, rel=1e-12)


def test_a_small_rattle_knows_only_the_curvatures() -> None:
    """An ellipsoid and a paraboloid with the same radii of curvature and the same height of the centre of mass."""
    curved = KANE_LEVINSON | {"offset": np.array([0.0, 0.01]), "Ixy": -3e-5}
    bowl = curved | {"a": 0.02**2 / (2 * 0.2**2), "b": 0.02**2 / (2 * 0.03**2)}
    for name in ("slip+viscous+sigma", "noslip+solid+sigma"):
        theirs = []
        for each, body in ((name, curved), (f"{name}+paraboloid", bowl)):
            model, columns = find(each), cells(**body, mu=30.0, sigma=1e-4)
            near = {"n0": np.full(2, 1.0), "x0": np.full(2, 1e-7), "y0": np.full(2, -1e-7)}
            theirs.append(
                [
                    linear.jacobian(model, model.constants.of(columns), np.array([3.0, -2.0])),
                    model.slower_period(columns),
                    stability.stable_ranges(model, columns),
                    np.array(model.ripple.of(columns)),
                    np.array(model.start(columns | near)),
                ]
            )
        for one_, other in zip(*theirs, strict=True):
            np.testing.assert_allclose(one_, other, rtol=1e-8, atol=1e-8 * np.nanmax(np.abs(one_[np.isfinite(one_)])))


def crossings(sigma: float, omega3: float) -> np.ndarray:
    """Times in 20 s at which the spin of Kane and Levinson's body vanishes."""
    parameters = KANE_LEVINSON | ANGLES | {"sigma": sigma, "omega3": omega3}
    model, constants = one("noslip+solid+sigma", parameters)

    def spin(_: float, y: np.ndarray) -> float:
        return float(model.energy(tuple(y), constants)[0])

    start = np.array(model.start(cells(**parameters)))[:, 0]
    solution = solve_ivp(
        lambda t, y: np.array(model.rhs(tuple(y), constants)[0]),  # noqa: ARG005
        (0, 15), start, "DOP853", rtol=1e-10, atol=1e-13, events=spin,
    )  # fmt: skip
    return np.asarray(solution.t_events[0])


@pytest.mark.parametrize(("sigma", "omega3", "time"), [(0, -5, 2.855), (1e-4, -5, 2.556), (0, 5, 11.53)])
def test_kane_and_levinson_1982(sigma: float, omega3: float, time: float) -> None:
    """The spin, which ripples, has changed its sign for good at the published time."""
    found = crossings(sigma, omega3)
    assert len(found) % 2 == 1
    assert found[-1] == pytest.approx(time, abs=0.005)


def test_with_damping_kane_and_levinsons_body_does_not_reverse_the_other_way() -> None:
    assert not len(crossings(1e-4, 5))


def test_natural_units_and_si_are_the_same() -> None:
    m, L, g = (KANE_LEVINSON[name] for name in ("mass", "c", "gravity"))
    T = np.sqrt(L / g)
    natural = {name: value / L for name, value in KANE_LEVINSON.items() if name in ("a", "b", "c", "offset")}
    natural |= {name: value / (m * L**2) for name, value in KANE_LEVINSON.items() if name.startswith("I")}
    natural |= {"mu": 0.4, "speed": 0.05 * T / L, "sigma": 1e-4 * T / (m * L**2)}
    (one_, p), (other, q) = (
        one("slip+coulomb-tanh+sigma", given) for given in (KANE_LEVINSON | FRICTION | COUPLES, natural)
    )
    units = np.array([1, 1, 1 / T, 1 / T, 1 / T, L / T, L / T])
    for number in range(10):
        y = states(number, 7)
        slopes, _ = one_.rhs(tuple(y), p)
        others, _ = other.rhs(tuple(y / units), q)
        np.testing.assert_allclose(np.array(slopes) * T / units, others, rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("surface", ["", "+paraboloid"])
@pytest.mark.parametrize("law", ["viscous", "coulomb-sqrt", "coulomb-tanh", "coulomb-cubic", "stribeck"])
def test_the_mirror_image_does_the_mirror_image(law: str, surface: str) -> None:
    """y → -y: u and v are vectors, ω is a pseudovector."""
    vector, turning = np.array([1, -1]), np.array([-1, 1, -1])
    image = np.array([*vector, *turning, *vector])
    body = (BOWL if surface else SKEW) | FRICTION | COUPLES
    (model, p), (_, q) = (
        one(f"slip+{law}+sigma+rolling+spinning{surface}", each) for each in (body, body | {"Ixy": 2e-5, "Iyz": 1e-5})
    )
    for number in range(10):
        y = states(number, 7)
        np.testing.assert_allclose(
            image * model.rhs(tuple(y), p)[0], model.rhs(tuple(image * y), q)[0], rtol=1e-12, atol=1e-12
        )


def ends(name: str, parameters: dict[str, Any], time: float) -> np.ndarray:
    model, constants = one(name, parameters)
    start = np.array(model.start(cells(**parameters)))[:, 0]
    solution = solve_ivp(
        lambda t, y: np.array(model.rhs(tuple(y), constants)[0]),  # noqa: ARG005
        (0, time), start, "LSODA" if "slip+v" in name else "DOP853", rtol=1e-11, atol=1e-13,
    )  # fmt: skip
    return np.asarray(solution.y[:, -1])


def test_strong_friction_is_rolling() -> None:
    """The difference falls as 1/μ."""
    start = KANE_LEVINSON | ANGLES | {"slip1": 0.0, "slip2": 0.0}
    rolling, mu = ends("noslip+solid", start, 0.5), np.array([1e3, 3e3, 1e4])
    off = [np.abs(ends("slip+viscous", start | {"mu": each}, 0.5)[:5] - rolling).max() for each in mu]
    order, _ = np.polyfit(np.log(mu), np.log(off), 1)
    assert order == pytest.approx(-1, abs=0.02)


def test_while_a_body_slides_tanh_becomes_dry_friction() -> None:
    """tanh(v/s) is 1 but for 2 exp(-2 v/s), so the motion differs by no more as long as the slip v is large."""
    start = KANE_LEVINSON | ANGLES | {"mu": 0.3, "slip1": 0.5, "slip2": 0.0, "omega3": -2.0}
    dry = ends("slip+coulomb-tanh", start | {"speed": 1e-3}, 0.02)
    v = np.hypot(*dry[5:])
    assert v > 0.35
    for speed in (0.2, 0.1, 0.05):
        off = np.abs(ends("slip+coulomb-tanh", start | {"speed": speed}, 0.02) - dry).max()
        assert 0.01 * np.exp(-2 * v / speed) < off < 20 * np.exp(-2 * v / speed)


def test_narrower_regularisations_meet_dry_friction() -> None:
    """A start with slip, which dry friction keeps to its direction at first: its force is μ N at once."""
    u, v = np.array([0.0, 0.0, -1.0]), 0.1
    y = (u[0], u[1], 0.0, 0.0, 0.0, v, 0.0)
    body = KANE_LEVINSON | {"mu": 0.3}
    dry = newton.derivative(np.array(y), body | {"speed": 1e-30}, "coulomb-tanh")[0]
    for law, power in (("coulomb-tanh", np.inf), ("coulomb-cubic", np.inf), ("coulomb-sqrt", 2)):
        off = []
        for speed in (1e-2, 1e-3):
            model, constants = one(f"slip+{law}", body | {"speed": speed})
            off.append(np.abs(np.array(model.rhs(y, constants)[0]) - dry).max())
        assert off[1] < (1e-12 if power == np.inf else 1.1 * 10**-power * off[0])


def test_to_which_variants_the_linear_theory_applies() -> None:
    for name in ("slip+viscous+sigma", "slip+coulomb-tanh", "noslip+solid+sigma"):
        assert LINEAR in find(name).offers
    for name in ("slip+viscous+rolling", "slip+viscous+spinning", "slip+contensou", "noslip+solid"):
        assert LINEAR not in find(name).offers
    assert LINEAR not in noslip.MODEL.offers


def test_a_faint_rattle_slips_slowly() -> None:
    """Of all rattles of that energy none slips faster than the speed up to which the law counts as linear."""
    body = KANE_LEVINSON | {"mu": 0.5, "speed": 0.01}
    model, constants = one("slip+coulomb-sqrt", body)
    random, fastest = np.random.default_rng(5), 0.0
    for _ in range(3000):
        y = random.normal(size=7) * [1e-4, 1e-4, 1e-2, 1e-2, 0, 1e-3, 1e-3]
        u = np.array([y[0], y[1], -1.0])
        spin = random.uniform(-20, 20)
        y[4] = (spin - y[:2] @ (y[2:4] + spin * y[:2])) / -1.0
        y[2:4] += spin * u[:2]
        rattle = model.energy(tuple(y), constants)[1]
        fastest = max(fastest, np.hypot(y[5], y[6]) * np.sqrt(constants.faint / rattle))
    assert 0.03 * 0.1 * body["speed"] < fastest <= 0.1 * body["speed"]


def test_a_body_that_cannot_spin_upright_has_no_critical_spins() -> None:
    for model in (find("slip+viscous"), find("noslip+solid+sigma")):
        straight, skew = (
            stability.stable_ranges(model, cells(**body, mu=20, sigma=1e-4)) for body in (KANE_LEVINSON, SKEW)
        )
        assert np.isfinite(straight[:2]).all()
        assert np.isnan(skew).all()


def test_every_law_is_viscous_to_the_linear_theory() -> None:
    spin = np.array([1.0])
    expected = {"viscous": 0.4, "coulomb-sqrt": 0.4 / 0.05, "coulomb-tanh": 0.4 / 0.05, "coulomb-cubic": 1.2 / 0.05,
                "stribeck": 0.7 / 0.02 + 0.3}  # fmt: skip
    for law, mu in expected.items():
        (model, _), (viscous, _) = (
            one(f"slip+{law}", KANE_LEVINSON | FRICTION),
            one("slip+viscous", KANE_LEVINSON | {"mu": mu}),
        )
        found = linear.jacobian(model, model.constants.of(cells(**KANE_LEVINSON, **FRICTION)), spin)
        alike = linear.jacobian(viscous, viscous.constants.of(cells(**KANE_LEVINSON, mu=mu)), spin)
        np.testing.assert_allclose(found, alike, rtol=1e-12, atol=1e-9)


def test_unknown_variants() -> None:
    for name in ("slip+magic", "noslip+viscous", "averaged+viscous", "slip+viscous+magic"):
        with pytest.raises(KeyError):
            variant(name)
