"""The Runge-Kutta kernel against adaptive integration, and itself at other steps, threads, chunks and orders."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from support import adaptive, columns
from support.kernels import PAPER_FORM, finish, kernel, run, spin, started
from support.ripple import form as numerical_form

from sweep.kernels import methods
from sweep.kernels.layout import BLOCK
from sweep.kernels.method import ACCURACY, STABILITY
from sweep.kernels.runge_kutta import DOPRI5
from sweep.kernels.status import DIVERGED, TIME_LIMIT
from sweep.models import MODELS
from sweep.models.ladder import slip
from sweep.models.model import take

DOPRI = kernel("dopri5")
STATES = len(slip.MODEL.states)


def of(table: np.ndarray, name: str) -> np.ndarray:
    return DOPRI.table(table)[name]


def test_order_five() -> None:
    steps = np.array([0.03, 0.025, 0.02, 0.016])
    reference = spin(DOPRI, run(DOPRI, 0.004, 400.0))[0]
    errors = [abs(spin(DOPRI, run(DOPRI, h, 400.0))[0] - reference) for h in steps]
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert order == pytest.approx(5, abs=0.25)


def test_measuring_does_not_alter_the_motion() -> None:
    bare = kernel("dopri5", measure=())
    plain = run(bare, 0.02, 200.0)
    np.testing.assert_array_equal(plain[0, :STATES], run(DOPRI, 0.02, 200.0)[0, :STATES])
    assert not {"work", "half", "ripple.K11"} & set(bare.layout.names)


def test_windows_are_averages_of_the_ripple_free_spin() -> None:
    """Count, time and mean against the same definition applied to a finely sampled trajectory."""
    t_end, body = 800.0, columns(mu=75.0)
    table = started(DOPRI, 0.01, t_end, mu=75.0)
    tau, times = of(table, "period")[0], np.arange(0, t_end, 0.05)
    y = adaptive.motion(body, times, rtol=1e-9, atol=1e-13)[:STATES]
    p = PAPER_FORM.model.constants.of(body)
    u1, u2, M1, M2, *_ = PAPER_FORM.momentum(y, take(p, 0))
    (K11, K12), (K21, K22) = numerical_form(body)
    spin, *_ = slip.MODEL.energy(y, take(p, 0))
    steady = spin - (K11 * u1 * M1 + K12 * u1 * M2 + K21 * u2 * M1 + K22 * u2 * M2)
    ends = np.arange(0, times[-1], tau)
    means = np.diff(CubicSpline(times, steady).antiderivative()(ends)) / tau
    changes = np.flatnonzero(means[1:] * means[:-1] < 0)
    finish(DOPRI, table)
    assert of(table, "reversals")[0] == of(table, "reversals_shifted")[0] == len(changes) == 2
    i = changes[-1]
    crossing = ends[i] + tau / 2 + tau * means[i] / (means[i] - means[i + 1])
    assert of(table, "last_reversal")[0] == pytest.approx(crossing, abs=1e-3)
    assert of(table, "closed_window")[0] / tau == pytest.approx(means[-1], abs=1e-6)


def test_beats_are_no_reversals() -> None:
    """Both modes are large: the mean of n itself over a window changes sign 57 times."""
    adams = kernel("adams")
    table = run(adams, 0.02, 30_000.0, settle=True, b=5.0, mu=160.0, n0=0.1)
    assert table[0, adams.layout.index("reversals")] == table[0, adams.layout.index("reversals_shifted")] == 17


def test_energy_error_is_the_largest_violation() -> None:
    """Against the balance in the same steps with the work integrated by SciPy's quadrature weights."""
    table = started(DOPRI, 0.02, BLOCK * 0.02 * 20)
    worst, before = 0.0, of(table, "energy_start")[0]
    blocks = 0
    while of(table, "status")[0] == 0:
        DOPRI.advance(table, np.array([0]), 1)
        n, rattle, inertia = slip.MODEL.energy(*DOPRI.unpack(table))
        worst = max(worst, abs(rattle + 0.5 * inertia * n**2 + of(table, "work") - before)[0])
        blocks += 1
    assert blocks == 20
    assert of(table, "violation")[0] == pytest.approx(worst, rel=1e-6)
    assert 0 < worst < 1e-7 * before


@pytest.mark.parametrize("excess", [1.17, 1.5, 3.0])
@pytest.mark.parametrize("parameters", [{"mu": 200.0}, {"mu": 1000.0}, {"b": 1.5}, {"a": 3.0, "b": 2.0, "delta": 0.1}])
def test_a_step_beyond_stability_is_diverged(parameters: dict[str, float], excess: float) -> None:
    limit = DOPRI5.real_stability / slip.MODEL.fastest_decay(columns(**parameters))
    assert of(run(DOPRI, excess * limit, 400.0, **parameters), "status")[0] == DIVERGED


def test_not_a_number_is_diverged() -> None:
    table = started(DOPRI, 0.02, 10.0)
    table[0, 2] = np.nan
    assert of(finish(DOPRI, table), "status")[0] == DIVERGED


def test_a_settled_rattle_ends_as_exact_zeros() -> None:
    """Without it, the rattle would decay through denormal numbers and slow the kernel down."""
    table = started(DOPRI, 0.02, 30_000.0, settle=True, n0=0.001, x0=1e-58, y0=1e-58)
    assert table[0, [0, 1]].all()
    finish(DOPRI, table, settle=False)
    assert of(table, "status")[0] == TIME_LIMIT
    np.testing.assert_array_equal(table[0, [0, 1, 2, 3, 5, 6]], 0)
    assert spin(DOPRI, table)[0] == pytest.approx(0.001, rel=1e-12)


def test_automatic_step_says_which_limit_decided() -> None:
    body = columns(mu=[1.0, 20.0, 200.0])
    step, rule = methods.automatic_step("dopri5", MODELS["slip"], body)
    assert list(rule) == [ACCURACY, ACCURACY, STABILITY]
    assert step[2] * slip.MODEL.fastest_decay(body)[2] == pytest.approx(0.9 * DOPRI5.real_stability)
