"""The largest Lyapunov exponent: against published and known ones, and against the variational equations by SciPy."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support import Write, columns
from support.kernels import finish, images_of, kernel

import sweep
from sweep.jit import inline
from sweep.kernels.differentiate import make_extended
from sweep.kernels.kernel import Kernel
from sweep.kernels.layout import BLOCK
from sweep.kernels.measures import chosen
from sweep.kernels.measures.lyapunov import BINS
from sweep.kernels.runge_kutta import RungeKutta
from sweep.kernels.tableau import DOPRI5
from sweep.models.ladder import noslip
from sweep.models.model import SPIN, Model, stack, take
from sweep.models.origin import Origin


class Constants(NamedTuple):
    rho: Any

    @classmethod
    def of(cls, given: Any) -> Constants:
        return cls(given["mu"])


@inline
def lorenz(y: Any, p: Any) -> Any:
    """Its exponents for σ = 10, ρ = 28, β = 8/3 are published."""
    x, y_, z = y
    slopes = 10.0 * (y_ - x), x * (p.rho - z) - y_, x * y_ - (8.0 / 3.0) * z
    return slopes, (x, 0.0, 1.0, 1.0)


@inline
def no_energy(y: Any, p: Any) -> Any:  # noqa: ARG001
    return y[0], 0.0 * y[0], 1.0


LORENZ = Model(
    name="lorenz",
    summary="Lorenz (1963)",
    parameters=("mu",),
    offers=frozenset({SPIN}),
    states=("x", "y", "z"),
    spin_state=0,
    constants=Constants,
    start=lambda given: (1.0 + given["n0"], 1.0 + 0 * given["n0"], 20.0 + 0 * given["n0"]),
    slower_period=lambda given: np.ones_like(given["a"]),
    upright=lambda spin: (spin, 0.0, 0.0),
    rhs=lorenz,
    energy=no_energy,
    origin=Origin.of_file("lorenz", __file__, Path(__file__).read_text(encoding="utf-8")),
)


@cache
def _lorenz() -> Kernel:
    return Kernel(RungeKutta(LORENZ, DOPRI5), chosen(["lyapunov"]))


def exponents(made: Any, body: dict[str, np.ndarray], step: float, t_end: float) -> dict[str, np.ndarray]:
    table = finish(made, images_of(made, body, step, t_end), settle=False)
    return dict(made.measurements[0].read(made.table(table), None))


def test_the_lorenz_attractor_has_its_published_exponent() -> None:
    """0.9056 (Sprott, Chaos and Time-Series Analysis, Oxford 2003, and many others), from eight starts."""
    found = exponents(_lorenz(), columns(mu=28.0, n0=np.arange(8) / 10), 0.01, 2000.0)
    off = found["lyapunov"] - 0.9056
    assert np.abs(off.mean()) < 0.004
    # The scatter of the eight is about what the errors say.
    assert 0.2 < np.sqrt((off**2).mean() / (found["lyapunov_error"] ** 2).mean()) < 2


def test_a_stable_focus_of_the_lorenz_system_has_the_rate_of_its_eigenvalue() -> None:
    rho = np.array([15.0, 20.0])
    found = exponents(_lorenz(), columns(mu=rho), 0.01, 400.0)["lyapunov"]
    for value, each in zip(found, rho, strict=True):
        x = np.sqrt(8 / 3 * (each - 1))
        J = np.array([[-10, 10, 0], [1, -1, -x], [x, x, -8 / 3]])
        assert value == pytest.approx(np.linalg.eigvals(J).real.max(), abs=2e-3)


@pytest.mark.campaign
def test_the_exponent_is_that_of_the_variational_equations() -> None:
    """Over the very same stretch, from the same direction, on regular and on chaotic motion."""
    body = columns(a=3.0, b=2.0, delta=[0.03, 0.3, 0.5], n0=[0.5, 0.5, 0.3])
    made, tangent = kernel("dopri5", "noslip", ["lyapunov"]), make_extended(noslip.MODEL)

    def slopes(_: float, z: np.ndarray, p: Any) -> np.ndarray:
        found = np.array(tangent(tuple(z[:10]), p)[0])
        rate = z[5:10] @ found[5:] / (z[5:10] @ z[5:10])
        return np.array([*found[:5], *(found[5:] - rate * z[5:10]), rate])

    table = made.table(finish(made, images_of(made, body, 0.0075, 200.0), settle=False))
    found = made.measurements[0].read(table, None)["lyapunov"]
    for i in range(3):
        full, length = int(table["full_bins"][i]), table["bin_width"][i] * BLOCK * table["step"][i]
        times = np.array([full - full // 2, full]) * length
        start = np.concatenate([stack(noslip.MODEL.start(body))[:, i], np.full(5, 5**-0.5), [0.0]])
        constants = take(noslip.MODEL.constants.of(body), i)
        solution = solve_ivp(slopes, (0, times[1]), start, "DOP853", times, args=(constants,), rtol=1e-11, atol=1e-13)
        assert full >= BINS // 2
        assert found[i] == pytest.approx(np.diff(solution.y[-1])[0] / np.diff(times)[0], abs=1e-8)


@pytest.mark.campaign
def test_integrable_motion_has_none_within_the_bound_of_its_length(write: Write) -> None:
    """Without friction the averaged equations have two integrals of three variables: neighbours part like the time.

    Then the later half of a trajectory of the length T gives ln 2 / (T/2), beside what the distance oscillates by.
    """
    text = "model: averaged\nfriction: {mu: 1.0e+11}\nstart: {n0: [0.05, 0.1], x0: 0.3, y0: 0.3}\nmeasure: [lyapunov]\n"
    for t_end in (4000.0, 32000.0):
        found = sweep.run(write(text), t_end=t_end, stop_early=False)
        assert (np.abs(found.lyapunov) < (np.log(2) + np.log(20)) / (t_end / 2)).all()


@pytest.mark.campaign
def test_a_mode_that_has_decayed_is_not_filled_in_by_round_off() -> None:
    """Half the difference of two trajectories 1e-8 apart is noise then: its growth gave 0.009 here."""
    found = exponents(kernel("dopri5", "noslip", ["lyapunov"]), columns(n0=0.0325, delta=0.288), 0.009, 4000.0)
    assert abs(found["lyapunov"][0]) < 0.002


def test_a_cycle_as_long_as_a_bin_is_not_taken_for_chaos() -> None:
    """All bins are alike then, and their scatter alone made this regular motion positive by six standard errors."""
    body, step = columns(n0=0.025617, delta=0.319641), 0.007565
    found = exponents(kernel("dopri5", "noslip", ["lyapunov"]), body, step, 10000.0)
    assert abs(found["lyapunov"][0]) < 3 * found["lyapunov_error"][0] < 0.002


def test_a_short_trajectory_has_no_exponent() -> None:
    found = exponents(_lorenz(), columns(mu=28.0), 0.01, 7 * BLOCK * 0.01)
    assert np.isnan(found["lyapunov"]).all()


def test_it_does_not_depend_on_how_a_run_is_divided() -> None:
    made = _lorenz()
    whole, pieces = (images_of(made, columns(mu=[28.0, 15.0]), 0.01, 300.0) for _ in range(2))
    finish(made, whole, settle=False)
    cells = np.arange(2)
    for _ in range(300):
        made.advance(pieces, cells[made.table(pieces)["status"] == 0], 1)
    np.testing.assert_array_equal(whole, pieces)


@pytest.mark.parametrize("method", ["auto", None])
def test_auto_is_dopri5_with_it(method: str | None, write: Write) -> None:
    given = {"measure": ["lyapunov"], "integrator": {} if method is None else {"method": method}}
    assert sweep.load_config(write("friction: {mu: 60}\n"), given).integrator.method == "dopri5"
