"""Intervals without events: what the modes of a tiny rattle give is what steps would give."""

from typing import Any

import numpy as np
import pytest
from support import adaptive, columns
from support.kernels import PAPER_FORM, finish, kernel, started

import sweep
from sweep.kernels.adams import skips
from sweep.kernels.layout import BLOCK
from sweep.kernels.status import RUNNING, SETTLED, TIME_LIMIT
from sweep.models import find
from sweep.models.ladder import slip
from sweep.models.model import Offer, stack, take
from sweep.models.stiff.modes import RATTLE, Rattle, bending
from sweep.models.theory import linear, stability

ADAMS = kernel("adams")
row = ADAMS.layout.index


def stepped(table: np.ndarray, **how: Any) -> np.ndarray:
    """The same without skips."""
    table = table.copy()
    table[:, row("quiet_energy")] = -1
    return finish(ADAMS, table, **how)


@pytest.fixture
def skipped(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Steps that each skip stood for."""
    seen: list[float] = []
    move = skips.move

    def watched(kernel: Any, part: np.ndarray, rattle: Rattle, steps: np.ndarray, scales: Any) -> None:
        seen.extend(steps)
        move(kernel, part, rattle, steps, scales)

    monkeypatch.setattr(skips, "move", watched)
    return seen


def resolved(size: float, **parameters: Any) -> tuple[Rattle, np.ndarray, Any, dict[str, np.ndarray]]:
    body = columns(x0=size, y0=size, **parameters)
    states, constants = stack(PAPER_FORM.model.start(body)), PAPER_FORM.model.constants.of(body)
    return Rattle.of(PAPER_FORM, states, constants), states, constants, body


def later(body: dict[str, np.ndarray], times: np.ndarray) -> np.ndarray:
    """States of the stiff form at `times`, by another integrator."""
    states = adaptive.motion(body, times, rtol=1e-11, atol=1e-20)[:7]
    return stack(PAPER_FORM.momentum(states, take(PAPER_FORM.model.constants.of(body), np.zeros(len(times), int))))


def test_modes_move_as_the_full_model() -> None:
    _, _, constants, body = resolved(1e-6, mu=60.0)
    times = np.array([20.0, 30.0, 100.0])  # the slip is there by then
    exact = later(body, times)
    rattle = Rattle.of(PAPER_FORM, exact, take(constants, np.zeros(3, int)))
    first = rattle.select(np.zeros(3, dtype=int))
    factors = np.exp(first.rates * (times - times[0])[:, None])
    ours = exact[list(RATTLE), :1].T + first.changes(factors, first.amplitudes)
    np.testing.assert_allclose(ours, exact[list(RATTLE)].T, rtol=1e-5, atol=1e-13)
    np.testing.assert_allclose(rattle.amplitudes, factors * first.amplitudes, rtol=1e-5)
    # And what they turn the spin by.
    turned = rattle.turned(rattle.amplitudes)
    assert abs(turned[2] - turned[0]) > 1e-12
    np.testing.assert_allclose(exact[4] - exact[4, 0], turned - turned[0], rtol=1e-4, atol=3e-15)


@pytest.mark.parametrize("c", [1.0, 1.7])
def test_the_power_of_friction_after_a_skip_is_that_of_the_full_model(c: float) -> None:
    table = started(ADAMS, 0.05, 90_000.0, mu=60.0, a=10.0 * c, b=3.0 * c, c=c, x0=1e-7, y0=1e-7)
    rattle = Rattle.of(PAPER_FORM, *ADAMS.unpack(table))
    skips.move(ADAMS, table, rattle, np.full(1, 10.0 * BLOCK), np.zeros((1, 2)))
    _, (_, power, _, _) = slip.MODEL.rhs(ADAMS.model_states(table), ADAMS.unpack(table)[1])
    np.testing.assert_allclose(table[:, row("power0")], power, rtol=1e-3)


def test_a_couple_slows_the_spin_of_a_body_that_hardly_rattles() -> None:
    """As an exponential of time, without skips at a constant spin."""
    friction = {"mu": 60, "sigma": 1e-4}
    scene = {"body": {"b": 3.0}, "friction": friction, "start": {"n0": 0.002, "x0": 1e-9, "y0": 1e-9}}
    found = sweep.run(scene, method="adams", t_end=20_000, stop_early=False)
    assert float(found.spin_final) == pytest.approx(0.002 * np.exp(-1e-4 * 20_000 / ((10**2 + 3**2) / 5)), rel=1e-9)
    assert Offer.MODES not in find("slip+viscous+sigma").offers


def test_energies_of_the_modes_add_up() -> None:
    rattle, states, constants, _ = resolved(1e-6, mu=60.0, n0=[0.05, -0.02, 0.001])
    _, whole, inertia = PAPER_FORM.model.energy(states, constants)
    energies = rattle.unit_energies * np.abs(rattle.amplitudes) ** 2
    np.testing.assert_allclose(energies.sum(axis=1), 2 * whole / inertia, rtol=0.1)
    np.testing.assert_allclose(
        rattle.rates.real.max(axis=1),
        linear.growth_rate(slip.MODEL, constants, np.array([0.05, -0.02, 0.001])),
        rtol=1e-9,
    )


def test_distances_are_those_from_the_critical_spins() -> None:
    rattle, _, _, body = resolved(1e-6, mu=200.0, n0=[0.05, -0.04])
    upper, lower = stability.critical_spins(slip.MODEL, body)
    np.testing.assert_allclose(rattle.distances(), np.abs(body["n0"] - np.array([lower, upper])).T, rtol=0.07)


def decide(sizes: Any, scales: Any = (0.0, 0.0), left: float = 1e9, spin: float = 0.015) -> skips.Skip:
    """What happens to a rattle of these sizes at a spin where the fast mode grows."""
    rattle, *_ = resolved(1e-6, mu=200.0, n0=spin)
    one = np.ones(1)
    return skips.plan(rattle, np.array([sizes]), np.array([scales]), spin * one, 0.05 * one, left * one, 1e-8)


def test_a_decayed_mode_is_rescaled_and_back() -> None:
    up = decide([1e-5, 1e-9])
    assert up.now[0]
    assert up.scales[0, 1] == 0
    rattle, *_ = resolved(1e-6, mu=200.0, n0=0.015)
    true = np.log(1e-5) + rattle.rates.real[0, 0] * up.steps[0] * 0.05
    assert 1e-5 < np.exp(true + up.scales[0, 0]) < 1e-2
    # The turn of the spin by the rescaled one stays below the tolerance.
    assert rattle.distances().min() * np.exp(2 * (true + up.scales[0, 0])) / 2 < 1.001e-8
    down = decide([1e-5, 1e-9], scales=(0.0, 20.0))
    assert down.now[0]
    assert down.scales[0, 1] == 0
    assert down.steps[0] > 1.9 * up.steps[0]
    assert down.scales[0, 0] > up.scales[0, 0]


def test_what_a_fast_reversal_stirs_up_is_not_rescaled() -> None:
    """At n = 0.05 the reversal itself leaves more of the decayed mode than there was."""
    fast = decide([1e-5, 1e-9], spin=0.05)
    assert not fast.now[0]
    assert not fast.scales.any()


@pytest.mark.parametrize(
    ("sizes", "least", "most"),
    [([1e-6, 1e-18], 0, 2000), ([1e-3, 1e-8], 0, 2000), ([0.1, 1e-5], 50, np.inf), ([1e-5, 0.1], 50, np.inf)],
    ids=["hidden by round-off", "hidden by products", "large fast mode", "large slow mode"],
)
def test_hidden_modes_and_large_rattles_are_left_to_the_steps(sizes: list[float], least: float, most: float) -> None:
    """A mode that round-off or products of the other hide must not be read off the state."""
    found = decide(sizes)
    assert not found.now[0]
    assert least < found.wait[0] <= most


def test_where_both_decay_nothing_is_rescaled() -> None:
    still = decide([1e-4, 1e-4], spin=-0.002, left=1e6)
    assert still.now[0]
    assert still.steps[0] == 1e6
    assert not still.scales.any()


def test_bending_is_the_size_of_what_steps_show() -> None:
    """The normal force of a rocking with e = 1e-8 differs from the weight by no more than c e."""
    for axis in ({"x0": 1e-3, "y0": 0.0}, {"x0": 0.0, "y0": 1e-3}):
        body = columns(n0=0.0, **axis)
        constants = slip.MODEL.constants.of(body)
        _, rattle, inertia = slip.MODEL.energy(stack(slip.MODEL.start(body)), constants)
        states = adaptive.motion(body, np.linspace(0, 6, 400), rtol=1e-9, atol=1e-15)[:7]
        force = [slip.MODEL.rhs(y, take(constants, 0))[1][2] for y in states.T]
        share = (np.abs(np.array(force) - 1) / (2 * rattle / inertia)).max()
        assert share <= 1.05 * bending(slip.MODEL, body)
    assert share > 0.1 * bending(slip.MODEL, body)


@pytest.mark.parametrize("size", [1e-30, 1e-12])
def test_tiny_starts_end_as_stepped_ones(size: float, skipped: list[float]) -> None:
    table = started(
        ADAMS, 0.05, 12_000.0, settle=True, mu=[60.0, 200.0, 60.0], n0=[0.02, 0.05, -0.015], x0=size, y0=size
    )
    ours, theirs = finish(ADAMS, table.copy()), stepped(table)
    assert sum(skipped) > 0.1 * theirs[:, row("done")].sum()
    for name in ("reversals", "status"):
        np.testing.assert_array_equal(ours[:, row(name)], theirs[:, row(name)])
    # A skip may end a little after the look at which the other settles.
    np.testing.assert_allclose(ours[:, row("done")], theirs[:, row("done")], atol=2 * BLOCK)
    # To t = 4000 to 1e-2, though the weaker mode is hidden for a while.
    np.testing.assert_allclose(ours[:, row("last_reversal")], theirs[:, row("last_reversal")], atol=0.05)
    np.testing.assert_allclose(ours[:, row("spin")], theirs[:, row("spin")], atol=1e-4)
    assert ours[:, row("violation")].max() < 2 * theirs[:, row("violation")].max() + 1e-15


def test_spin_is_kept_to_the_tolerance(skipped: list[float]) -> None:
    for tolerance in (1e-8, 1e-5):
        tolerant = kernel("adams", tolerance=tolerance)
        table = started(tolerant, 0.05, 3000.0, mu=60.0, n0=[0.01, 0.02, 0.05], x0=1e-9, y0=1e-9)
        ours, theirs = finish(tolerant, table.copy(), settle=False), stepped(table, settle=False)
        assert skipped
        np.testing.assert_allclose(ours[:, row("spin")], theirs[:, row("spin")], atol=tolerance)


def test_long_rest_and_upright_spin_take_few_steps(skipped: list[float]) -> None:
    """Decayed, at rest, or upright for ever: to t = 1e6 in one skip each."""
    table = started(ADAMS, 0.1, 1e6, settle=True, n0=[0.001, 0.0, 0.05, 0.0], x0=[0.01, 0.0, 0.0, 0.01])
    table[2, 0:7] = started(ADAMS, 0.1, 1e6, x0=0.0, y0=0.0)[0, 0:7]
    finish(ADAMS, table, settle=False)
    assert len(skipped) >= 3
    assert (table[:, row("status")] == TIME_LIMIT).all()
    np.testing.assert_array_equal(table[:, row("done")], table[:, row("goal")])
    assert np.isfinite(table[:, :7]).all()


def test_windows_continue_after_a_skip() -> None:
    table = started(ADAMS, 0.1, 1e5, n0=0.001)
    finish(ADAMS, table, settle=False)
    one = table[0]
    assert one[row("closed_window")] == pytest.approx(one[row("spin")] * one[row("period")], rel=1e-12)
    assert one[row("closed_shifted")] == pytest.approx(one[row("closed_window")], rel=1e-12)
    assert one[row("earlier_half")] == pytest.approx(one[row("closed_window")] / 2, rel=1e-12)
    assert 0 <= one[row("phase")] < one[row("period")] / 2
    assert one[row("half")] == pytest.approx(one[row("spin")] * one[row("phase")], rel=1e-9)


def test_bit_identical_for_chunks() -> None:
    table = started(ADAMS, 0.05, 9000.0, settle=True, mu=np.linspace(50, 200, 40), x0=1e-9, y0=1e-9)
    whole = finish(ADAMS, table.copy())
    assert (whole[:, row("status")] != RUNNING).all()
    assert (whole[:, row("status")] == SETTLED).any()
    for chunk in (50, 333):
        np.testing.assert_array_equal(finish(ADAMS, table.copy(), chunk_blocks=chunk), whole)
    order = np.random.default_rng(3).permutation(40)
    np.testing.assert_array_equal(finish(ADAMS, table[order]), whole[order])


@pytest.fixture
def looks(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Cells of each look."""
    cells: list[int] = []
    of = Rattle.of

    def counted(form: Any, states: np.ndarray, constants: Any) -> Rattle:
        cells.append(states.shape[1])
        return of(form, states, constants)

    monkeypatch.setattr(skips.Rattle, "of", counted)
    return cells


def test_there_are_no_checks_where_no_skip_can_help(looks: list[int]) -> None:
    """A look takes as long as two thousand steps: to t = 400 they were two thirds of the time."""
    finish(ADAMS, started(ADAMS, 0.1, 400.0, mu=[60.0, 200.0, 1000.0]), settle=False)
    assert not looks
    # Nor when there is no more time for that.
    finish(ADAMS, started(ADAMS, 0.1, 1200.0, mu=60.0), settle=False)
    assert 0 < len(looks) <= 5
    for sizes in ([1e-5, 1e-9], [1e-1, 1e-9]):
        assert decide(sizes, left=7000).wait[0] == np.inf
        assert decide(sizes, left=70_000).wait[0] < np.inf
    # One that is on its way down already needs less time.
    assert decide([1e-1, 1e-1], left=8000, spin=0.05).wait[0] == np.inf
    assert decide([1e-1, 1e-9], left=8000, spin=0.05).wait[0] < np.inf
    # What has been rescaled gets its own size back.
    assert decide([1e-1, 1e-9], scales=(0.0, 20.0), left=7000).wait[0] < np.inf
