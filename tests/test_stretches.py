"""Stretches without events: what the modes of a tiny rattle carry on is what steps would give."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from conftest import columns
from scipy.integrate import solve_ivp
from test_adams import images

from sweep.executor import execute
from sweep.kernels import adams
from sweep.kernels.adams import AdamsKernel
from sweep.kernels.lanes import RUNNING, SETTLED, TIME_LIMIT
from sweep.models import linear, slip
from sweep.models.model import stack
from sweep.models.modes import Rattle, bending

ADAMS = AdamsKernel(("reversals", "energy_error"))
row = ADAMS.row


def finish(table: np.ndarray, *, settle: bool = True, chunk: int | None = None) -> np.ndarray:
    execute(ADAMS, table, stop_when_settled=settle, chunk_blocks=chunk)
    return table


def stepped(table: np.ndarray, **how: Any) -> np.ndarray:
    """The same without stretches."""
    table = table.copy()
    table[:, row("quiet_energy")] = -1
    return finish(table, **how)


@pytest.fixture
def carried(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Steps that each stretch stood for."""
    seen: list[float] = []
    move = AdamsKernel._move

    def watched(self: AdamsKernel, part: np.ndarray, rattle: Rattle, steps: np.ndarray) -> None:
        seen.extend(steps)
        move(self, part, rattle, steps)

    monkeypatch.setattr(AdamsKernel, "_move", watched)
    return seen


def resolved(size: float, **parameters: Any) -> tuple[Rattle, np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    body = columns(x0=size, y0=size, **parameters)
    states, constants = stack(slip.start(body)), stack(slip.constants(body))
    return Rattle.of(slip.MODEL, states, constants), states, constants, body


def test_modes_move_as_the_full_model() -> None:
    rattle, states, constants, _ = resolved(1e-6, mu=60.0)
    np.testing.assert_allclose(rattle.at(np.zeros(1)), states, atol=1e-22)
    times = np.array([3.0, 30.0, 100.0])
    exact = solve_ivp(
        lambda _, y: slip.rhs(y, constants[:, 0])[0], (0, 100), states[:, 0], "DOP853", times,
        rtol=1e-10, atol=1e-20,
    ).y  # fmt: skip
    ours = np.stack([rattle.at(np.array([t]))[:, 0] for t in times], axis=1)
    np.testing.assert_allclose(ours, exact, rtol=1e-5, atol=1e-13)


def test_energies_of_the_modes_add_up() -> None:
    rattle, states, constants, _ = resolved(1e-6, mu=60.0, n0=[0.05, -0.02, 0.001])
    _, whole, inertia = slip.energy(rattle.at(np.full(3, 40.0)), constants)
    later = Rattle.of(slip.MODEL, rattle.at(np.full(3, 40.0)), constants)
    np.testing.assert_allclose(later.energies.sum(axis=0), 2 * whole / inertia, rtol=0.1)
    np.testing.assert_allclose(later.energies, rattle.energies * np.exp(40 * rattle.growth), rtol=1e-9)
    np.testing.assert_allclose(
        rattle.growth.max(axis=0) / 2, linear.growth_rate(slip.MODEL, constants, -states[4]), rtol=1e-9
    )


def test_a_hidden_mode_is_waited_for() -> None:
    """A mode that round-off or products of the other hide must not be read off the state."""
    rattle, _, _, body = resolved(1e-8, n0=0.02)
    bend, distance, spin = bending(body), np.array([0.015]), np.array([0.02])
    assert rattle.validity(bend, distance, spin, 1e-8)[0] == 0
    growing = np.argmax(rattle.growth[:, 0])
    for energy, ratio in ((1e-28, 1e-24), (1e-12, 1e-12)):
        rattle.energies[:, 0] = energy
        rattle.energies[growing] = energy * ratio
        begin, end = rattle.validity(bend, distance, spin, 1e-8)
        assert 0 < begin < end


def test_a_large_rattle_is_left_to_the_steps() -> None:
    rattle, _, _, body = resolved(1e-2, n0=0.05)
    begin, end = rattle.validity(bending(body), np.array([0.05]), np.array([0.05]), 1e-8)
    assert begin > 0 or end == 0


def test_bending_is_the_size_of_what_steps_show() -> None:
    """The normal force of a rocking with e = 1e-8 differs from the weight by no more than c e."""
    for axis in ({"x0": 1e-3, "y0": 0.0}, {"x0": 0.0, "y0": 1e-3}):
        body = columns(n0=0.0, **axis)
        states, constants = stack(slip.start(body)), stack(slip.constants(body))
        _, rattle, inertia = slip.energy(states, constants)
        run = solve_ivp(lambda _, y: slip.rhs(y, constants[:, 0])[0], (0, 6), states[:, 0], rtol=1e-9, atol=1e-15)  # noqa: B023
        force = [slip.rhs(y, constants[:, 0])[1][2] for y in run.y.T]
        share = (np.abs(np.array(force) - 1) / (2 * rattle / inertia)).max()
        assert share <= 1.05 * bending(body)
    assert share > 0.1 * bending(body)


@pytest.mark.parametrize("size", [1e-30, 1e-12])
def test_tiny_starts_end_as_stepped_ones(size: float, carried: list[float]) -> None:
    table = images(
        ADAMS, 0.05, 12_000.0, settle=True, mu=[60.0, 200.0, 60.0], n0=[0.02, 0.05, -0.015], x0=size, y0=size
    )
    ours, theirs = finish(table.copy()), stepped(table)
    assert sum(carried) > 0.1 * theirs[:, row("done")].sum()
    for name in ("reversals", "status", "done"):
        np.testing.assert_array_equal(ours[:, row(name)], theirs[:, row(name)])
    # To t = 4000 to 1e-2, though the weaker mode is hidden for a while.
    np.testing.assert_allclose(ours[:, row("last_reversal")], theirs[:, row("last_reversal")], atol=0.05)
    np.testing.assert_allclose(ours[:, row("spin")], theirs[:, row("spin")], atol=1e-6)
    assert ours[:, row("violation")].max() < 2 * theirs[:, row("violation")].max() + 1e-15


def test_spin_is_kept_to_the_tolerance(carried: list[float]) -> None:
    for tolerance in (1e-8, 1e-5):
        kernel = AdamsKernel(("reversals",), tolerance)
        table = images(kernel, 0.05, 3000.0, mu=60.0, n0=[0.01, 0.02, 0.05], x0=1e-9, y0=1e-9)
        ours, theirs = table.copy(), table.copy()
        theirs[:, kernel.row("quiet_energy")] = -1
        for images_ in (ours, theirs):
            execute(kernel, images_, stop_when_settled=False)
        assert carried
        np.testing.assert_allclose(ours[:, kernel.row("spin")], theirs[:, kernel.row("spin")], atol=tolerance)


def test_a_weekend_of_nothing_takes_no_time(carried: list[float]) -> None:
    """Decayed, at rest, or upright for ever: to t = 1e6 in one stretch each."""
    table = images(ADAMS, 0.1, 1e6, settle=True, n0=[0.001, 0.0, 0.05, 0.0], x0=[0.01, 0.0, 0.0, 0.01])
    table[2, 0:7] = images(ADAMS, 0.1, 1e6, x0=0.0, y0=0.0)[0, 0:7]
    finish(table, settle=False)
    assert len(carried) >= 3
    assert (table[:, row("status")] == TIME_LIMIT).all()
    np.testing.assert_array_equal(table[:, row("done")], table[:, row("goal")])
    assert np.isfinite(table[:, :7]).all()


def test_windows_go_on_behind_a_stretch() -> None:
    table = images(ADAMS, 0.1, 1e5, n0=0.001)
    finish(table, settle=False)
    one = table[0]
    assert one[row("closed_window")] == pytest.approx(one[row("spin")] * one[row("period")], rel=1e-12)
    assert 0 <= one[row("phase")] < one[row("period")]
    assert one[row("window")] == pytest.approx(one[row("spin")] * one[row("phase")], rel=1e-9)


def test_bit_identical_for_chunks() -> None:
    table = images(ADAMS, 0.05, 9000.0, settle=True, mu=np.linspace(50, 200, 40), x0=1e-9, y0=1e-9)
    whole = finish(table.copy())
    assert (whole[:, row("status")] != RUNNING).all()
    assert (whole[:, row("status")] == SETTLED).any()
    for chunk in (50, 333):
        np.testing.assert_array_equal(finish(table.copy(), chunk=chunk), whole)
    order = np.random.default_rng(3).permutation(40)
    np.testing.assert_array_equal(finish(table[order]), whole[order])


def test_the_wait_is_bounded() -> None:
    """A stretch that is not worthwhile is not tried again at every look."""
    tried = 0
    of = Rattle.of

    def count(*given: Any) -> Rattle:
        nonlocal tried
        tried += 1
        return of(*given)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(adams.Rattle, "of", count)
        finish(images(ADAMS, 0.05, 9000.0, settle=True, mu=200.0))
    assert tried <= 20
