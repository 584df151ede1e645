"""The stiff forms of the equations, the paper's and the general ones: the same motion in other variables."""

import numpy as np
import pytest
from support import columns

from sweep.models import find
from sweep.models.ladder import slip
from sweep.models.model import Columns
from sweep.models.stiff.form import velocities
from sweep.models.stiff.modes import Rattle
from sweep.models.stiff.slip import form_of, has_form
from sweep.models.theory.rocking import frequencies, implicit

COUNT = 40
ANY = "slip+viscous+offset+skew+gravity"


PAPERS = {"a": (2, 15), "b": (1.1, 10), "c": (0.5, 1.5), "delta": (-0.5, 0.5), "mu": (0.1, 300)}


def bodies(name: str = "", **replaced: float) -> Columns:
    """Bodies for the model of this name."""
    random = np.random.default_rng(3)
    ranges = PAPERS if name == "slip" else {
        "a": (0.15, 0.25), "b": (0.025, 0.04), "c": (0.02, 0.02), "offset": (-0.002, 0.01), "mass": (1.3, 1.3),
        "Ixx": (1e-4, 3e-4), "Iyy": (1.5e-3, 1.6e-3), "Izz": (1.6e-3, 1.7e-3), "Ixy": (-2e-5, 2e-5),
        "Ixz": (-3e-5, 3e-5), "Iyz": (-1e-5, 1e-5), "gravity": (9.81, 9.81), "mu": (1, 50), "sigma": (0, 1e-3),
    }  # fmt: skip
    drawn = {name: random.uniform(*range_, COUNT) for name, range_ in ranges.items()}
    return drawn | {name: np.full(COUNT, value) for name, value in replaced.items()}


def states(name: str = "") -> np.ndarray:
    random = np.random.default_rng(4)
    spans = (0.3, 0.3, 0.3, 0.3, 0.3, 0.01, 0.01) if name == "slip" else (0.2, 0.2, 3, 3, 5, 0.1, 0.1)
    return np.array([random.uniform(-span, span, COUNT) for span in spans])


@pytest.mark.parametrize("name", ["slip", ANY, f"{ANY}+sigma", f"{ANY}+sigma+paraboloid"])
def test_they_are_the_equations_of_the_full_model(name: str) -> None:
    sides = {"a": 0.005, "b": 0.22} if name.endswith("paraboloid") else {}
    model, body, y = find(name), bodies(name, **sides), states(name)
    split = form_of(model)
    full, p = model.constants.of(body), split.model.constants.of(body)
    slopes, (_, power, R, denominator) = model.rhs(y, full)
    z = np.array(split.momentum(y, p))
    np.testing.assert_allclose(velocities(split.nonstiff, z, p), y, atol=1e-12)
    # M' along the full model's motion, by a complex step through the change of variables.
    moved = np.array(split.momentum(y + 1e-30j * np.array(slopes), p)).imag / 1e-30
    ours, geometry = split.nonstiff(*z, p)
    np.testing.assert_allclose(ours, moved[:5], atol=1e-13 * np.abs(moved).max())
    gamma = 1e-10
    v1, v2, num, den = split.newton(*z[[0, 1, 5, 6]], geometry, gamma, y[5], y[6], p)
    steep = np.abs(slopes[5:]).max()
    np.testing.assert_allclose((np.array([v1, v2]) - y[5:]) / gamma, slopes[5:], rtol=1e-4, atol=1e-5 * steep)
    np.testing.assert_allclose([num / den, den], [R, denominator], rtol=1e-12)
    np.testing.assert_allclose(split.power(R, y[5], y[6], geometry, p), power, rtol=1e-12)
    np.testing.assert_allclose(split.model.energy(z, p), model.energy(y, full), rtol=1e-12, atol=1e-13)
    if "sigma" in name:
        assert (power > split.power(R, y[5], y[6], geometry, p._replace(damping=0.0))).all()


@pytest.mark.parametrize("name", ["slip", f"{ANY}+sigma"])
def test_newton_leaves_little_of_the_residual(name: str) -> None:
    model, body, y = find(name), bodies(name, mu=500), states(name)
    y[5:] *= 0.01
    split = form_of(model)
    full, p = model.constants.of(body), split.model.constants.of(body)
    z, gamma, v = np.array(split.momentum(y, p)), 0.01, y[5:]

    def rate(v: np.ndarray) -> np.ndarray:
        return np.array(model.rhs(velocities(split.nonstiff, np.array([*z[:5], *v]), p), full)[0][5:])

    base, start = v - gamma * rate(v), v + 1e-6 * np.random.default_rng(5).uniform(-1, 1, v.shape)
    _, geometry = split.nonstiff(*z[:5], *start, p)
    end = np.array(split.newton(z[0], z[1], *start, geometry, gamma, *base, p)[:2])
    assert np.abs(end - v).max() < 0.03 * np.abs(start - v).max()


@pytest.mark.parametrize("name", ["slip", ANY])
def test_rocking_and_the_matrix_of_the_corrector_against_derivatives(name: str) -> None:
    """At zero angular momentum about the vertical."""
    body = bodies(name) | ({} if name == "slip" else {"Ixz": np.zeros(COUNT), "Iyz": np.zeros(COUNT)})
    split = form_of(find(name))
    p = split.model.constants.of(body)
    slopes = [split.nonstiff(*(1e-30j * np.eye(7)[i][:, None] * np.ones(COUNT)), p)[0][:4] for i in range(4)]
    J = np.moveaxis(np.array(slopes).imag / 1e-30, 2, 0).swapaxes(1, 2)
    weight = 0.004
    inverse = np.moveaxis(np.array(np.broadcast_arrays(*implicit(weight, split.rocking(p)))).reshape(4, 4, COUNT), 2, 0)
    np.testing.assert_allclose(inverse @ (np.eye(4) - weight * J), np.eye(4) + 0 * J, atol=1e-12)
    both = np.sort(np.abs(np.linalg.eigvals(J).imag))[:, [0, -1]]
    np.testing.assert_allclose(np.transpose(frequencies(split.rocking(p))), both, rtol=1e-6, atol=1e-6)


def test_the_ripple_is_that_of_the_full_model() -> None:
    """To first order in the rattle, which is all that it is good for."""
    for body in (bodies(Ixz=0.0, Iyz=0.0), bodies()):
        model, y = find(ANY), states()
        split = form_of(model)
        y[[0, 1, 2, 3, 5, 6]] *= 1e-6
        full, p = model.constants.of(body), split.model.constants.of(body)
        coefficients = model.ripple.of(body)
        z = np.array(split.momentum(y, p))
        ours, theirs = split.model.ripple.value(z, p, coefficients), model.ripple.value(y, full, coefficients)
        assert np.abs(ours - theirs).max() < 1e-3 * np.abs(theirs).max()


@pytest.mark.parametrize(
    "name", ["slip+coulomb", "slip+none", "slip+viscous+rolling", "slip+viscous+sigma+rolling", "noslip+solid"]
)
def test_models_that_have_no_split_form(name: str) -> None:
    assert not has_form(find(name))


def test_no_function_takes_the_states_of_another_model() -> None:
    """Momentum and spin are alike in size, so a right-hand side of the wrong variables would pass unseen."""
    body, stiff = columns(), form_of(slip.MODEL).model
    with pytest.raises(NotImplementedError):
        stiff.rhs(stiff.start(body), stiff.constants.of(body))
    with pytest.raises(NotImplementedError):
        stiff.upright(np.ones(1))
    assert stiff.path is None


def test_fast_spin_has_a_mode_of_negative_energy() -> None:
    """Friction makes that one grow, at the cost of the spin, and the body rises; no skip may use it."""
    body = columns(a=[1.05, 1.05], b=1.04, mu=5000.0)
    form = form_of(slip.MODEL)
    p = form.model.constants.of(body)
    found = Rattle.of(form, np.insert(np.zeros((6, 2)), 4, -p.J33 * [0.05, 5.0], axis=0), p)
    np.testing.assert_array_equal(found.sound, [True, False])
    assert (found.rates[0].real < 0).all()
    assert found.rates[1].real.max() > 0
