"""The stiff method, against dopri5 at small steps, and its own parts."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import ROOT, columns
from support.kernels import kernel, run, spin

import sweep
from sweep import ConfigError
from sweep.kernels.adams.step import BDF, BDF_GAMMA, CORRECTOR_NODES, EXTRAPOLATE, PREDICTOR_NODES
from sweep.kernels.adams.weights import fitted_weights, plain_weights
from sweep.kernels.methods import automatic_step
from sweep.models import MODELS
from sweep.models.ladder import slip
from sweep.models.model import take
from sweep.models.stiff import slip as stiff_slip
from sweep.models.theory.rocking import frequencies, implicit, rocking

Write = Callable[..., Path]
ADAMS, DOPRI = kernel("adams"), kernel("dopri5")


tilt, rate, slide = st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(-0.01, 0.01)
bodies = st.fixed_dictionaries({"a": st.floats(2, 15), "b": st.floats(1.1, 10), "c": st.floats(0.5, 1.5),
                                "delta": st.floats(-0.5, 0.5), "mu": st.floats(0.1, 300)})  # fmt: skip


@given(st.tuples(tilt, tilt, rate, rate, rate, slide, slide).map(np.array), bodies)
def test_the_split_equations_are_those_of_slip(y: np.ndarray, body: dict[str, float]) -> None:
    p_slip, p = take(slip.Constants.of(columns(**body)), 0), take(stiff_slip.Constants.of(columns(**body)), 0)
    slopes, (n, _, R, _) = slip.rhs(y, p_slip)
    split = np.array(stiff_slip.momentum(y, p))
    ours, geometry = stiff_slip.slow(*split, p)
    np.testing.assert_allclose(geometry[7:10], y[2:5], atol=1e-12)
    # M' along the slip model's motion, by a complex step through the change of variables.
    moved = np.array(stiff_slip.momentum(y + 1e-30j * np.array(slopes), p)).imag / 1e-30
    scale = 1 + np.abs(moved).max() + body["mu"]
    np.testing.assert_allclose(ours, moved[:5], atol=1e-11 * scale)
    # A Newton step of vanishing weight γ moves v by γ v'; with 1e-9 the second order showed near the paradox.
    gamma = 1e-11
    v1, v2, num, den = stiff_slip.newton(*split[[0, 1, 5, 6]], geometry, p, gamma, y[5], y[6])
    np.testing.assert_allclose((np.array([v1, v2]) - y[5:]) / gamma, slopes[5:], atol=1e-5 * scale)
    assert num / den == pytest.approx(R, abs=1e-9 * scale)
    assert stiff_slip.STIFF_MODEL.energy(split, p)[0] == pytest.approx(n, abs=1e-12)
    np.testing.assert_allclose(stiff_slip.STIFF_MODEL.energy(split, p), slip.energy(y, p_slip), atol=1e-11)


@given(st.floats(-0.002, 0.002), st.floats(-0.002, 0.002), st.floats(100, 1e5), st.floats(-1, 1), st.floats(-1, 1))
def test_newton_solves_the_stiff_slip(v1: float, v2: float, mu: float, away1: float, away2: float) -> None:
    """One step leaves little of the residual of v = b + γ v_p'(v): the Jacobian is that of all stiff terms."""
    p = take(stiff_slip.Constants.of(columns(mu=mu)), 0)
    split = np.array(stiff_slip.momentum(np.array([1e-2, 2e-2, 1e-2, 2e-2, -0.05, v1, v2]), p))
    gamma = 0.05

    def slip_rate(v: np.ndarray) -> np.ndarray:
        y = stiff_slip.PAPER_FORM.velocities(np.array([*split[:5], *v]), p)
        return np.array(slip.rhs(y, p)[0][5:])

    base = np.array([v1, v2]) - gamma * slip_rate(np.array([v1, v2]))  # so that (v1, v2) is the solution
    start = np.array([v1, v2]) + 0.01 / mu * np.array([away1, away2])
    _, geometry = stiff_slip.slow(*split[:5], *start, p)
    end = stiff_slip.newton(split[0], split[1], *start, geometry, p, gamma, *base)[:2]
    assert np.abs(end - np.array([v1, v2])).max() <= 0.05 * np.abs(start - np.array([v1, v2])).max() + 1e-5 / mu


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


@given(bodies, st.floats(0, 0.1))
def test_rocking_frequency_and_corrector_matrix(body: dict[str, float], weight: float) -> None:
    """Its frequency and the matrix of the corrector against the derivatives of `slow` by complex steps."""
    p = take(stiff_slip.Constants.of(columns(**body)), 0)
    slopes = [stiff_slip.slow(*(1e-30j * np.eye(7)[i]), p)[0] for i in range(4)]
    J = np.array(slopes).T[:4].imag / 1e-30
    theirs = np.sort(np.abs(np.linalg.eigvals(J).imag))[[0, -1]]
    assert frequencies(rocking(p)) == pytest.approx(theirs, rel=1e-6, abs=1e-6)
    inverse = np.reshape(implicit(weight, rocking(p)), (4, 4))
    np.testing.assert_allclose(inverse @ (np.eye(4) - weight * J), np.eye(4), atol=1e-12)


def test_bdf_and_extrapolation_are_exact_for_quartics() -> None:
    at = -np.arange(5.0)
    for k in range(5):
        assert np.dot(EXTRAPOLATE, at**k) == pytest.approx(1)
        assert np.dot(BDF, at**k) + BDF_GAMMA * k == pytest.approx(1)


@pytest.mark.parametrize(
    ("parameters", "bound"),
    [({"mu": 60.0}, 1e-6), ({"mu": 200.0}, 1e-6), ({"mu": 1000.0}, 1e-6),
     ({"mu": 200.0, "delta": -0.03, "y0": -0.01, "n0": -0.05}, 1e-6)],
)  # fmt: skip
def test_spin_against_dopri5(parameters: dict[str, float], bound: float) -> None:
    exact = spin(DOPRI, run(DOPRI, 0.2 / parameters["mu"], 400.0, **parameters))[0]
    errors = [abs(spin(ADAMS, run(ADAMS, h, 400.0, **parameters))[0] - exact) for h in (0.125, 0.0667)]
    assert errors[0] < bound
    assert errors[1] < bound / 50


def test_the_step_does_not_depend_on_friction() -> None:
    step, _ = automatic_step("adams", MODELS["slip"], columns(mu=[1e2, 1e3, 1e4, 1e5]), 1e-6)
    assert step == pytest.approx(step[0], rel=1e-3)
    # Between rolling and 1e5 as little is left as 1/μ says.
    rolling = kernel(model="noslip")
    exact = spin(rolling, run(rolling, 0.01, 100.0))
    distance = [abs(spin(ADAMS, run(ADAMS, 0.05, 100.0, mu=mu)) - exact)[0] for mu in (1e4, 1e5)]
    assert distance[0] / distance[1] == pytest.approx(10, rel=0.2)


def test_counts_of_the_reference(tmp_path: Path) -> None:
    table = np.genfromtxt(ROOT / "data" / "reference_counts.csv", delimiter=",", names=True)
    names = ["a", "b", "delta", "mu", "n0", "x0", "y0"]
    cells = np.column_stack([table[name] for name in names])
    np.savetxt(tmp_path / "cells.csv", cells, delimiter=",", header=",".join(names), comments="", fmt="%.17g")
    (tmp_path / "c.yaml").write_text("cases: cells.csv\nintegrator: {method: adams}\n")
    ours = sweep.run(tmp_path / "c.yaml").reversals.values
    assert (ours != table["reversals"]).sum() <= len(cells) / 75


def test_only_the_slip_model_has_it(write: Write) -> None:
    text = "model: averaged\nfriction: {mu: 60}\nintegrator: {method: adams}\n"
    with pytest.raises(ConfigError, match=r"3:14: integrator\.method: cannot run the averaged model; choose dopri5"):
        sweep.load_config(write(text))
