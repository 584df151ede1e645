"""Critical spins and stable ranges of a model, against growth rates, other codes and the limits."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import columns, wide_bodies
from support.adaptive import motion
from support.kernels import threads

import sweep
from sweep.grid import Grid
from sweep.kernels.status import SETTLED
from sweep.models import MODELS
from sweep.models.ladder import slip
from sweep.models.model import stack, take
from sweep.models.theory import linear, modes, stability
from sweep.prediction import predict

SLIP = MODELS["slip"]


def growth(model: str, body: dict[str, np.ndarray], spin: Any) -> np.ndarray:
    constants = MODELS[model].constants.of(body)
    matrices = linear.jacobian(MODELS[model], constants, np.broadcast_to(spin, body["a"].shape))
    return np.asarray(np.linalg.eigvals(matrices).real.max(axis=-1))


@pytest.mark.parametrize("name", ["slip", "effective", "averaged"])
def test_no_range_of_spin_is_missed(name: str) -> None:
    """Whether the rattle grows, sampled finely in the spin, changes at the ends of the ranges and nowhere else."""
    body = wide_bodies(40)
    spins = np.geomspace(1e-6, 10, 800)
    ranges = np.stack(stability.stable_ranges(MODELS[name], body))
    for sign, (end, near, far) in ((1, ranges[[1, 4, 5]]), (-1, -ranges[[0, 3, 2]])):
        for spin in spins:
            inner, outer, beyond = spin < end, (spin > near) & (spin < far), spin > np.where(np.isnan(far), 11, far)
            close = np.abs(stack((end, near, far)) / spin - 1).min(axis=0, initial=1, where=~np.isnan([end, near, far]))
            known = ~beyond & (close > 1e-4)
            np.testing.assert_array_equal((growth(name, body, sign * spin) < 0)[known], (inner | outer)[known])


def test_a_nearly_round_body_is_stable_again_at_faster_spin() -> None:
    body = columns(b=8.0, mu=100.0)
    lower, _, far, near, *_ = stability.stable_ranges(SLIP, body)
    assert np.abs(growth("slip", body, near)) < 1e-13
    assert np.abs(growth("slip", body, far)) < 1e-13
    assert far < -0.05 < near < lower
    assert growth("slip", body, (near + far) / 2) < 0
    assert np.isnan(stability.stable_ranges(SLIP, columns())[2:6]).all()


def test_uncoupled_amplitudes_decay_at_every_spin() -> None:
    """In the averaged equations nothing else can make them grow; in the full ones friction does, at a fast spin."""
    for body in (columns(delta=0.0), columns(a=5, b=5)):
        assert stability.critical_spins(MODELS["averaged"], body) == (np.inf, -np.inf)
        upper, lower = stability.critical_spins(SLIP, body)
        assert upper == pytest.approx(-lower, rel=1e-9)
        assert growth("slip", body, 0.99 * upper) < 0 < growth("slip", body, 1.01 * upper)


def test_an_uncoupled_body_settles_only_at_a_stable_spin(write: Callable[..., Path]) -> None:
    """Taken to be stable at any spin, it had settled at the spin of its start."""
    run = sweep.run(write("body: {delta: 0}\nfriction: {mu: 20}\nstart: {n0: [0.06, 0.12]}\n"))
    assert set(run.status.values) == {SETTLED}
    assert run.spin_final[0] == pytest.approx(0.06, rel=1e-3)
    assert 0.05 < run.spin_final[1] < 0.07 < run.n_c1_linear.sel(sign=1)
    assert run.t_stop[1] > 1000


def test_without_friction_no_spin_is_stable() -> None:
    assert np.isnan(stability.stable_ranges(SLIP, columns(mu=0.0))).all()
    assert np.isnan(stability.stable_ranges(MODELS["noslip"], columns())).all()


def test_each_body_by_itself() -> None:
    """The bits of a body depend neither on threads nor on the bodies beside it."""
    bodies = columns(mu=np.linspace(20, 200, 1201), b=np.linspace(1.2, 9.8, 1201), n0=0.3)
    found = []
    for number in (1, 2):
        with threads(number):
            found.append(predict(slip.MODEL, Grid({}, {}, bodies)).ranges)
    np.testing.assert_array_equal(found[0], found[1])
    some = {name: values[::7] for name, values in bodies.items()}
    np.testing.assert_array_equal(np.stack(found[0])[:, ::7], stability.stable_ranges(slip.MODEL, some))
    assert np.isfinite(found[0][2:]).any()


@pytest.mark.parametrize(("mu", "n0", "y0"), [(0.3, -0.02, 0.002), (2.0, -0.03, -0.002), (5.0, -0.01, 0.002)])
def test_the_spin_that_stays_is_where_an_adaptive_integrator_ends(mu: float, n0: float, y0: float) -> None:
    """Also with little friction, where the slip modes are no faster than the rocking."""
    values = {"a": 3.0, "b": 2.0, "c": 1.0, "delta": 0.2, "mu": mu, "n0": n0, "x0": 0.003, "y0": y0}
    body = {name: np.array([value]) for name, value in values.items()}
    constants = slip.MODEL.constants.of(body)
    end = motion(body, [0, 300], rtol=1e-12, atol=1e-16)[:7, -1]
    changed = slip.MODEL.rhs(tuple(end), take(constants, 0))[1][0] - n0
    found = modes.resting_spin(slip.MODEL, constants, stack(slip.MODEL.start(body))) - n0
    assert found == pytest.approx([changed], rel=1e-4)


def test_no_spin_stays_where_the_rattle_grows() -> None:
    body = columns(n0=0.05)
    states = stack(slip.MODEL.start(body))
    assert np.isnan(modes.resting_spin(slip.MODEL, slip.MODEL.constants.of(body), states)).all()
