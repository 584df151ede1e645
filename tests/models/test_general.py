"""Any body and any law of friction, against equations derived another way, and against limits that are known.

And starts and bounds of the full model of the paper's body.
"""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import STANDARD, columns, newton, wide_bodies
from support import cells as all_cells
from support.newton import FRICTION
from support.physics import KANE_LEVINSON

from sweep.models import find, variants
from sweep.models.general import rigid_body
from sweep.models.general.bounds import strongest_grip
from sweep.models.general.common import Variant
from sweep.models.general.couples import COUPLES as KINDS
from sweep.models.general.laws import LAWS
from sweep.models.general.surfaces import ELLIPSOID, PARABOLOID, Surface
from sweep.models.ladder import noslip, slip
from sweep.models.model import Model, Offer, stack, take
from sweep.models.theory import linear, stability
from sweep.models.theory.rocking import frequencies

SKEW = KANE_LEVINSON | {"mass": 0.7, "Ixz": 3e-5, "Iyz": -1e-5}
COUPLES = {"sigma": 1e-4, "mu_rolling": 0.1, "radius": 0.004, "speed_rolling": 0.5}
COUPLES |= {"mu_spinning": 0.2, "radius_spinning": 0.003, "speed_spinning": 2.0}
BOWL = SKEW | {"a": 0.012, "b": 0.35, "surface": "paraboloid"}
"""A paraboloid: radii of curvature 0.83 and 0.029 at the lowest point."""


def cells(**parameters: Any) -> dict[str, np.ndarray]:
    return all_cells(**{name: value for name, value in parameters.items() if name != "surface"})


def one(name: str, parameters: dict[str, Any]) -> tuple[Any, Any]:
    """A model and its constants for one body, as scalars."""
    model = any_body(name)
    return model, take(model.constants.of(cells(**parameters)), 0)


def any_body(name: str) -> Model:
    """The model of this name, of a body that may have all that there is; `slip` and `noslip` are of the paper's."""
    base, *more = name.split("+paraboloid")
    return find(f"{base}+offset+skew+gravity" + ("+paraboloid" if more else "") if "+" in name else name)


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
def test_the_equations_and_the_energy_are_those_of_newton_and_euler(
    body: dict[str, Any], law: str | None, couples: str
) -> None:
    """With all that they need: friction alone changes the energy, in any units, and a mirror image moves as such."""
    parameters = body | FRICTION
    for couple in filter(None, couples.split("+")):
        parameters = parameters | {name: COUPLES[name] for name in KINDS[couple].parameters}
    name = f"slip+{law}{couples}" if law else f"noslip+solid{couples}"
    for number in range(30):
        agree(f"{name}+paraboloid" if body is BOWL else name, parameters, law, number)


@pytest.mark.parametrize(("name", "law"), [("slip", "viscous"), ("noslip", None)])
def test_frequencies_of_the_papers_body_are_those_of_the_equations(name: str, law: str | None) -> None:
    bodies = wide_bodies(100)
    for i in range(100):
        agree(name, {each: values[i] for each, values in bodies.items()}, law, i)


def agree(name: str, parameters: dict[str, Any], law: str | None, number: int) -> None:
    """A model and Newton's equations, in random states."""
    model, constants = one(name, parameters)
    y, m = states(number, len(model.states)), parameters.get("mass", 1.0)
    slopes, (spin, power, force, _) = model.rhs(tuple(y), constants)
    expected, N, lost = newton.derivative(y, parameters, law)
    np.testing.assert_allclose(slopes, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())
    assert force == pytest.approx(N / m, rel=1e-12)
    assert power == pytest.approx(lost / m, rel=1e-12)
    assert spin == pytest.approx(y[2:5] @ [y[0], y[1], -np.sqrt(1 - y[0] ** 2 - y[1] ** 2)], rel=1e-12)
    # The derivative of the energy along the motion, by a complex step.
    spin, rattle, inertia = model.energy(tuple(y + 1e-30j * np.array(slopes)), constants)
    total = rattle + 0.5 * inertia * spin**2
    assert total.real == pytest.approx(newton.energy(y, parameters, law), rel=1e-12)
    assert total.imag / 1e-30 == pytest.approx(-power, rel=1e-11, abs=1e-11 * total.real * np.abs(slopes).max())


@pytest.mark.parametrize(
    ("name", "body"), [("noslip", STANDARD), ("noslip+solid", KANE_LEVINSON), ("noslip+solid", SKEW)]
)
def test_frequencies_are_those_of_the_equations(name: str, body: dict[str, float]) -> None:
    model, columns = any_body(name), cells(**body)
    values = linear.jacobian(model, model.constants.of(columns), np.zeros(1))[0]
    expected = np.unique(np.abs(np.linalg.eigvals(values).imag).round(9))[-2:]
    np.testing.assert_allclose(np.ravel(frequencies(rigid_body.rocking(columns))), expected, rtol=1e-8)
    assert model.slower_period(columns)[0] == pytest.approx(2 * np.pi / expected[0], rel=1e-8)


def test_the_ripple_free_spin_of_a_real_body_hardly_ripples() -> None:
    """A small rolling rattle at n = 0 leaves only terms of higher order."""
    model, constants = one("noslip+solid", KANE_LEVINSON)
    u, omega = np.array([3e-4, -2e-4]), np.array([4e-3, 1e-3])
    y = np.array([*u, *omega, u @ omega])
    times = np.linspace(0, 3 * rigid_body.slower_period(cells(**KANE_LEVINSON))[0], 400)
    course = newton.follow(y, KANE_LEVINSON, None, times)
    spin = model.energy(course, constants)[0]
    steady_spin = spin - model.ripple.value(course, constants, [k[0] for k in model.ripple.of(cells(**KANE_LEVINSON))])
    trend = [values - np.polyval(np.polyfit(times, values, 3), times) for values in (spin, steady_spin)]
    assert np.std(trend[1]) < 0.05 * np.std(trend[0])


@pytest.mark.parametrize("law", [law.name for law in LAWS.values() if law.parameters and not law.coupled])
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


def fastest(model: Model, body: dict[str, np.ndarray], rows: list[int], draw: Callable[[], np.ndarray]) -> float:
    """The rate at which some of the states decay in random states that the energy at the start allows, at most."""

    def total(y: Any, constants: Any) -> Any:
        spin, rattle, inertia = model.energy(y, constants)
        return rattle + 0.5 * inertia * spin**2

    most = total(model.start(body), model.constants.of(body))[0]
    constants, largest = take(model.constants.of(body), 0), 0.0
    for _ in range(4000):
        y = draw()
        if total(tuple(y), constants) > most:
            continue
        rates = np.zeros((len(rows), len(rows)))
        for i, row in enumerate(rows):
            slopes, _ = model.rhs(tuple(y + 1e-30j * (np.arange(len(y)) == row)), constants)
            rates[:, i] = [slopes[each].imag / 1e-30 for each in rows]
        largest = max(largest, -np.linalg.eigvals(rates).real.min())
    return largest


@pytest.mark.parametrize("surface", [ELLIPSOID, PARABOLOID])
def test_the_slip_decays_no_faster_than_the_bound(surface: Surface) -> None:
    bowl = {"a": 0.005, "b": 0.222} if surface is PARABOLOID else {}
    body = cells(**(KANE_LEVINSON | bowl | FRICTION), n0=4.0, x0=0.0, y0=0.0)
    model = any_body("slip+viscous+paraboloid" if surface is PARABOLOID else "slip+viscous")
    grip, random = strongest_grip(Variant(None, surface=surface), body)[0], np.random.default_rng(3)

    def draw() -> np.ndarray:
        return random.normal(size=7) * [0.1, 0.1, 4, 4, 4, 0, 0] * random.uniform()

    assert 0.4 * grip < fastest(model, body, [5, 6], draw) / FRICTION["mu"] <= 1.02 * grip


def test_the_spin_decays_no_faster_than_the_bound() -> None:
    """About zero spin, where spinning friction is steepest."""
    spinning = {"mu_spinning": 0.2, "radius_spinning": 0.003, "speed_spinning": 0.01}
    body = cells(**KANE_LEVINSON, **spinning, n0=3.0, x0=0.0, y0=0.0)
    model, random = any_body("noslip+solid+spinning"), np.random.default_rng(7)

    def draw() -> np.ndarray:
        u, w = random.normal(size=2) * 0.1, random.normal(size=2) * 3
        return np.array([*u, *w, u @ w / np.sqrt(1 - u @ u)])

    bound = model.fastest_decay(body)[0]
    assert 0.4 * bound < fastest(model, body, [2, 3, 4], draw) <= 1.02 * bound


def test_a_small_rattle_knows_only_the_curvatures() -> None:
    """An ellipsoid and a paraboloid with the same radii of curvature and the same height of the centre of mass."""
    curved = KANE_LEVINSON | {"offset": np.array([0.0, 0.01]), "Ixy": -3e-5}
    bowl = curved | {"a": 0.02**2 / (2 * 0.2**2), "b": 0.02**2 / (2 * 0.03**2)}
    for name in ("slip+viscous+sigma", "noslip+solid+sigma"):
        theirs = []
        for each, body in ((name, curved), (f"{name}+paraboloid", bowl)):
            model, columns = any_body(each), cells(**body, mu=30.0, sigma=1e-4)
            near = {"n0": np.full(2, 1.0), "x0": np.full(2, 1e-7), "y0": np.full(2, -1e-7)}
            theirs.append(
                [
                    linear.jacobian(model, model.constants.of(columns), np.array([3.0, -2.0])),
                    model.slower_period(columns),
                    np.stack(stability.stable_ranges(model, columns)),
                    np.array(model.ripple.of(columns)),
                    np.array(model.start(columns | near)),
                ]
            )
        for one_, other in zip(*theirs, strict=True):
            np.testing.assert_allclose(one_, other, rtol=1e-8, atol=1e-8 * np.nanmax(np.abs(one_[np.isfinite(one_)])))


def test_to_which_variants_the_linear_theory_applies() -> None:
    for name in ("slip+viscous+sigma", "slip+coulomb", "noslip+solid+sigma"):
        assert Offer.LINEAR in find(name).offers
    for name in ("slip+viscous+rolling", "slip+viscous+spinning", "slip+contensou", "noslip+solid"):
        assert Offer.LINEAR not in find(name).offers
    assert Offer.LINEAR not in noslip.MODEL.offers


def test_a_faint_rattle_slips_slowly() -> None:
    """Of all rattles of that energy none slips faster than the speed up to which the law counts as linear."""
    body = KANE_LEVINSON | {"mu": 0.5, "speed": 0.01}
    model, constants = one("slip+coulomb", body)
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
    for model in (any_body("slip+viscous"), any_body("noslip+solid+sigma")):
        straight, skew = (
            stability.stable_ranges(model, cells(**body, mu=20, sigma=1e-4)) for body in (KANE_LEVINSON, SKEW)
        )
        assert np.isfinite(straight[:2]).all()
        assert np.isnan(skew).all()


def test_every_law_is_viscous_to_the_linear_theory() -> None:
    spin = np.array([1.0])
    expected = {"viscous": 0.4, "coulomb": 0.4 / 0.05, "stribeck": 0.7 / 0.02 + 0.3}  # fmt: skip
    for law, mu in expected.items():
        (model, _), (viscous, _) = (
            one(f"slip+{law}", KANE_LEVINSON | FRICTION),
            one("slip+viscous", KANE_LEVINSON | {"mu": mu}),
        )
        found = linear.jacobian(model, model.constants.of(cells(**KANE_LEVINSON, **FRICTION)), spin)
        alike = linear.jacobian(viscous, viscous.constants.of(cells(**KANE_LEVINSON, mu=mu)), spin)
        np.testing.assert_allclose(found, alike, rtol=1e-12, atol=1e-9)


def test_no_variant_takes_a_body_that_it_does_not_describe() -> None:
    for name, constant in (("slip+viscous+gravity", "offset"), ("slip+viscous+offset", "g")):
        with pytest.raises(ValueError, match=f"^{constant}: this scene has no such body"):
            find(name).constants.of(cells(**KANE_LEVINSON, mu=1.0))


def test_unknown_variants() -> None:
    for name in ("slip+magic", "noslip+viscous", "averaged+viscous", "slip+viscous+magic"):
        with pytest.raises(KeyError):
            variants.variant(name)


@given(
    st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-1, 1), st.floats(-0.5, 0.5)
)  # fmt: skip
def test_start_puts_the_contact_where_asked(x0: float, y0: float, n0: float, delta: float) -> None:
    u1, u2, w1, w2, w3, v1, v2 = (float(s[0]) for s in slip.MODEL.start(columns(x0=x0, y0=y0, n0=n0, delta=delta)))
    u = np.array([u1, u2, -np.sqrt(1 - u1**2 - u2**2)])
    np.testing.assert_allclose(newton.contact(u, {"a": 10, "b": 3, "c": 1, "delta": delta})[:2], [x0, y0], atol=1e-14)
    np.testing.assert_allclose([w1, w2, w3], n0 * u, atol=1e-15)
    assert (v1, v2) == (0, 0)


@pytest.mark.parametrize("start", [{}, {"n0": 0.2}, {"x0": 5.0, "y0": 1.5}, {"b": 9.9}, {"b": 1.01}, {"a": 1.0}])
def test_fastest_decay_bounds_the_slip_at_the_start(start: dict[str, float]) -> None:
    body = columns(**start)
    y, p = stack(slip.MODEL.start(body)).astype(complex), slip.MODEL.constants.of(body)
    block = np.empty((2, 2))
    for j in range(2):
        shifted = y.copy()
        shifted[5 + j] += 1e-30j
        slopes, _ = slip.MODEL.rhs(shifted, p)
        block[:, j] = [slopes[5].imag[0] / 1e-30, slopes[6].imag[0] / 1e-30]
    rate = -np.linalg.eigvals(block).real.min()
    assert rate * 0.98 <= slip.MODEL.fastest_decay(body)[0] <= 12 * rate


def test_without_friction_nothing_is_stiff() -> None:
    assert slip.MODEL.fastest_decay(columns(mu=0.0)) == 0
