"""Start-up of the stiff method, against dopri5 that resolves the layer throughout."""

import numpy as np
import pytest
from support import columns
from support.kernels import PAPER_FORM, finish, kernel, spin, started_cells, threads

import sweep
from sweep.kernels.adams import start_up
from sweep.kernels.adams.step import HISTORY
from sweep.kernels.kernel import Kernel
from sweep.kernels.layout import LANES
from sweep.kernels.methods import automatic_step
from sweep.kernels.runge_kutta import DOPRI5
from sweep.kernels.status import LIFT_OFF, RUNNING
from sweep.models import MODELS
from sweep.models.ladder import slip
from sweep.models.model import Columns, take

ADAMS, DOPRI = kernel("adams"), kernel("dopri5")

CELLS = 83 + 2 * LANES
MIXED = columns(
    mu=np.append(np.geomspace(0.5, 1e5, 83), np.full(2 * LANES, 60.0)),
    b=np.resize([1.5, 3.0, 5.0, 8.0], CELLS),
    n0=np.resize([0.05, -0.1], CELLS),
)
STEPS = np.resize([0.1, 0.05, 0.02, 0.12, 0.07], CELLS)


def begun(body: Columns, step: np.ndarray, kernel: Kernel = ADAMS, t_end: float = 400.0) -> np.ndarray:
    return started_cells(kernel, body, step, t_end)


def cell(body: Columns, i: int) -> Columns:
    return {name: values[i : i + 1] for name, values in body.items()}


def resolved(body: Columns, t_end: float, step: float) -> np.ndarray:
    """Image of one cell at `t_end`, by dopri5."""
    return finish(DOPRI, begun(body, np.array([step]), DOPRI, t_end), settle=False)[0]


@pytest.mark.parametrize("mu", [0.0, 1.0, 20.0, 60.0, 1000.0, 3e4])
@pytest.mark.parametrize(("step", "bound"), [(0.1, 1e-7), (0.02, 2e-10)])
def test_states_history_and_work_against_dopri5(mu: float, step: float, bound: float) -> None:
    body = columns(mu=mu)
    row = begun(body, np.array([step]))[0]
    p = take(ADAMS.unpack(row[None])[1], 0)
    fine, h = min(0.004, 0.3 / max(mu, 1.0)), row[ADAMS.layout.index("step")]
    for j in range(HISTORY):
        time = row[ADAMS.layout.index("begin")] - j * h
        twin = resolved(body, time, fine)
        state = np.array(PAPER_FORM.momentum(twin[:7], p))
        slot = HISTORY - 1 - j
        slopes = row[ADAMS.layout.index(f"f{slot}_0") :][:5]
        # By the exact slow slopes, at the exact slip.
        np.testing.assert_allclose(slopes, PAPER_FORM.nonstiff(*state, p)[0], atol=100 * bound)
        np.testing.assert_allclose(row[ADAMS.layout.index(f"v{slot}_0") :][:2], state[5:], atol=10 * bound)
        if j == 0:
            np.testing.assert_allclose(row[:7], state, atol=10 * bound)
            assert row[ADAMS.layout.index("spin")] == pytest.approx(spin(DOPRI, twin[None])[0], abs=bound)
            work = twin[DOPRI.layout.index("work")]
            assert row[ADAMS.layout.index("work")] == pytest.approx(work, rel=2e-3 * (step / 0.1) ** 3, abs=1e-13)
        if j < 3:
            power = slip.MODEL.rhs(twin[:7], p)[1][1]
            assert row[ADAMS.layout.index(f"power{j}")] == pytest.approx(power, rel=1e-3, abs=1e-12)


def test_start_up_leaves_no_trace_in_the_spin() -> None:
    """A floor of 1e-10 at t = 400: the last spin is the same to that with a start-up of twice the care."""
    mu = np.array([1.0, 20.0, 60.0, 100.0, 200.0, 500.0, 1e3, 1e4, 1e5])
    body, step = columns(mu=mu), np.full(9, 0.02)

    def spins() -> np.ndarray:
        return spin(ADAMS, finish(ADAMS, begun(body, step), settle=False))

    usual = spins()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(start_up, "_SHARE", start_up._SHARE / 8)
        patch.setattr(start_up, "_EXTRA_STEPS", 16)
        patch.setattr(start_up, "_LAYER_LEVELS", 30)
        careful = spins()
    assert np.abs(usual - careful).max() < 1e-10


def test_bit_identical_for_each_grouping_and_thread() -> None:
    with threads(2):
        expected = begun(MIXED, STEPS)
    _, cells = np.unique(start_up.count_levels(PAPER_FORM.slip_decay(MIXED), STEPS), return_counts=True)
    assert len(cells) > 10
    assert cells.max() > LANES
    order = np.random.default_rng(2).permutation(len(STEPS))
    shuffled = begun({name: values[order] for name, values in MIXED.items()}, STEPS[order])
    np.testing.assert_array_equal(shuffled, expected[order])
    with threads(1):
        for i in range(0, len(STEPS), 9):
            np.testing.assert_array_equal(begun(cell(MIXED, i), STEPS[i : i + 1])[0], expected[i])
    # Not compiled once for a cell and again for many.
    assert len(start_up.compiled_start_up(PAPER_FORM)._dispatcher.signatures) == 1


def test_bodies_that_lift_off_in_start_up_end_there() -> None:
    """Violent starts, steps as the tolerance asks: who ends in start-up, how and when is as in dopri5."""
    rng = np.random.default_rng(0)
    n = 120
    body = columns(
        mu=10 ** rng.uniform(0, 3, n), n0=rng.uniform(-3, 3, n), x0=rng.uniform(-5, 5, n), y0=rng.uniform(-1, 1, n)
    )
    step, _ = automatic_step("adams", MODELS["slip"], body, 1e-8)
    begin = begun(body, step, t_end=3.0)
    status, times = ADAMS.table(begin)["status"], ADAMS.times(begin, 3.0)
    ended = status != RUNNING
    assert 10 <= ended.sum() < n
    # No longer than start-up, in steps that dopri5 is stable at: else it would call any end diverged.
    stable = 0.9 * DOPRI5.real_stability / slip.MODEL.fastest_decay(body)
    until = 1.01 * begin[~ended, ADAMS.layout.index("begin")].max()
    twins = finish(DOPRI, begun(body, np.minimum(stable, step / 4), DOPRI, until), settle=False)
    reached = DOPRI.times(twins, until)
    np.testing.assert_array_equal(DOPRI.table(twins)["status"][ended], status[ended])
    np.testing.assert_array_equal(reached[ended], times[ended])
    assert (reached[~ended] > begin[~ended, ADAMS.layout.index("begin")]).all()
    assert set(status) == {RUNNING, LIFT_OFF}
    # They keep sound states, those of the start.
    states = np.stack(PAPER_FORM.model.start(body), axis=-1)
    np.testing.assert_allclose(begin[ended, :7], states[ended], rtol=1e-14, atol=1e-14)


def test_slip_at_the_start_turns_the_spin_at_once() -> None:
    """A start without spin whose slip throws it back, in less than a window: the count is that of dopri5."""
    asked = {
        "body": {"a": 8.697805634946704, "b": 2.8487425508457704}, "friction": {"mu": 60.0},
        "start": {"roll": 0.01, "slip1": 0.021629552082991402},
    }  # fmt: skip
    one, other = (sweep.run(asked, method=method, t_end=100.0, tolerance=1e-8) for method in ("adams", "dopri5"))
    assert one.reversals == other.reversals == 1
    assert one.margin_fewer == pytest.approx(float(other.margin_fewer), rel=1e-4)
