"""Cells that fail: no failure is false, true ones have their time, and the rest stays."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import CHAOTIC, ENDED, ENDS, ROOT, STANDARD, Write, adaptive, columns
from support.kernels import threads
from support.runs import Heard, interrupt, lengthen, limited, run_cells, same_numbers

import sweep
from sweep.config import load_config
from sweep.engine import failures, life
from sweep.engine.executor import execute
from sweep.engine.life import live
from sweep.engine.lives import Approach, Lives, Next, Second
from sweep.engine.plan import plan
from sweep.kernels.method import FIXED, REPEAT
from sweep.kernels.status import DIVERGED, LIFT_OFF, PARADOX, RUNNING, SETTLED, TIME_LIMIT, TOPPLED

THIN = {"a": 50.0, "b": 1.01, "c": 1.0, "delta": 0.5, "mu": 200.0, "n0": 0.05}
"""A body whose normal force rises to hundreds for a moment; with too long a step it seems to be a paradox."""

STIFF = STANDARD | {"mu": 1e5, "n0": 1.0}

MISSES = {"b": 2.8, "mu": 100.0, "n0": 0.02}
"""The step of adams is twice too long for it."""

MIXED = (*ENDS.values(), CHAOTIC, MISSES, THIN, {}, {"n0": 0.02}, ENDS[TOPPLED] | {"n0": -1.0})
"""Cells that fail truly, fail falsely, are chaotic, miss their tolerance, or need no repeat."""


@pytest.mark.parametrize(
    "method", ["auto", *(pytest.param(each, marks=pytest.mark.campaign) for each in ("adams", "dopri5"))]
)
def test_true_failures_have_their_time_and_spin(method: str) -> None:
    times, spins = zip(*ENDED.values(), strict=True)
    found = run_cells(ENDS.values(), method=method, t_end=50.0)
    assert found.status.values.tolist() == list(ENDS)
    np.testing.assert_allclose(found.t_stop, times, rtol=0, atol=1e-6)
    off = np.abs(found.spin_final - np.array(spins))
    assert (off < 1e-6).all()
    assert (off < 10 * found.spin_error + 3e-9).all()  # SciPy's own error


@pytest.mark.parametrize(
    ("body", "method", "t_end", "by", "off"),
    [
        (THIN, "adams", 2.5, "DOP853", 1e-5),
        (THIN, "dopri5", 2.5, "DOP853", 1e-5),
        (STIFF, "adams", 14.5, "Radau", 1e-7),
    ],
)
def test_a_run_continues_after_a_false_paradox(
    body: dict[str, float], method: str, t_end: float, by: str, off: float
) -> None:
    found = run_cells([body], method=method, t_end=t_end)
    assert (int(found.status[0]), float(found.t_stop[0])) == (TIME_LIMIT, t_end)
    assert float(found.spin_final[0]) == pytest.approx(adaptive.spin(columns(**body), t_end, by), abs=off)
    assert float(found.energy_error[0]) < 1e-4


VIOLENT = {"b": 3.0, "mu": 200.0, "n0": 3.0, "x0": 5.0, "y0": 0.01}
"""A body that leaves the plane at once, while its friction needs 1e8 steps of dopri5 to t = 400."""


@pytest.mark.parametrize("method", ["adams", "dopri5"])
def test_a_failure_is_confirmed_however_long_the_whole_run_would_be(method: str) -> None:
    found = run_cells([VIOLENT], method=method, t_end=400.0)
    assert (int(found.status[0]), float(found.t_stop[0])) == (LIFT_OFF, 0.0)


TAPPED = {
    "a": 46.4355082663, "b": 8.57307724425, "c": 1.08290125747, "delta": 0.3725470249, "mu": 110.750595187,
    "n0": 0.187206258044, "x0": -3.10084024695, "y0": 0.824883672181,
}  # fmt: skip
"""The first step of adams meets a false paradox at t = 1.43."""


def test_a_false_failure_is_passed_however_long_the_whole_run_would_be(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only the steps that a run has taken count: the default t_end is seldom reached."""
    monkeypatch.setattr(life, "MOST_STEPS", 8e3)  # fewer than twice those to t_end, more than to the failure
    found = run_cells([TAPPED], method="adams", t_end=40.0, tolerance=1e-8)
    assert (int(found.status[0]), int(found.step_rule[0])) == (TIME_LIMIT, REPEAT)
    off = abs(float(found.spin_final[0]) - adaptive.spin(columns(**TAPPED), 40.0, "DOP853"))
    assert off < 10 * float(found.spin_error[0]) < 1e-3  # nor is it repeated because of its error


def test_no_repeat_takes_too_many_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """A failure that is confirmed on the way of a long run is still one; a false one stays unresolved."""
    expected = run_cells(ENDS.values(), method="dopri5", t_end=50.0)
    monkeypatch.setattr(life, "MOST_STEPS", 1.0)
    found = run_cells(ENDS.values(), method="dopri5", t_end=5000.0)
    assert found.status.values.tolist() == list(ENDS)
    np.testing.assert_allclose(found.t_stop, expected.t_stop, rtol=0, atol=1e-6)
    lengthen(monkeypatch, 50)
    false = run_cells([THIN], method="dopri5", t_end=100.0)
    assert int(false.status[0]) == DIVERGED
    assert float(false.t_stop[0]) < 100.0


def test_their_first_runs_alone_are_paradoxes() -> None:
    cells = {name: [THIN[name], (STANDARD | STIFF)[name]] for name in THIN}
    scene = {"name": "once", "cases": cells, "start": {"x0": 0.01, "y0": 0.01}}
    (part,) = plan(load_config(scene, {"method": "adams", "t_end": 14.5})).parts
    rows = part.start()
    execute(part.kernel, rows)
    assert part.kernel.table(rows)["status"].tolist() == [PARADOX, PARADOX]


def test_one_run_is_not_believed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever a run has met, the next one has to meet the same."""
    claims = iter([PARADOX, LIFT_OFF, TOPPLED] * 3)

    def claim(model: Any, states: Any, constants: Any, stretch: Any) -> Any:  # noqa: ARG001
        return np.full(len(stretch), next(claims)), stretch / 2, *np.zeros((2, len(stretch)))

    monkeypatch.setattr(failures, "approach", claim)
    lengthen(monkeypatch, 50)
    found = run_cells([THIN], method="dopri5", t_end=1.0)
    assert int(found.status[0]) == TIME_LIMIT
    assert len(list(claims)) < 8  # more than one was made


def test_a_failure_is_approached_beyond_where_the_cell_settled_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """The slow equations may estimate a reversal of such a cell, so it goes on, and may fail then."""
    cell = {"name": "late", "cases": {n: [v] for n, v in STANDARD.items()}, "integrator": {"method": "dopri5"}}
    (part,), begun = plan(sweep.load_config(cell)).parts, []

    def approach(model: Any, states: np.ndarray, constants: Any, stretch: np.ndarray) -> Any:  # noqa: ARG001
        begun.append(states[:, 0])
        return np.full(1, PARADOX), stretch, *np.zeros((2, 1))

    lives = Lives(part)
    kernel, rows = part.kernel, lives.rows
    table = kernel.table(rows)
    execute(kernel, rows)
    assert table["status"] == SETTLED
    end = table["done"] + 1000
    reached = []
    for goal in (end - 8, end):
        table["status"], table["settles"], table["goal"] = RUNNING, False, goal
        execute(kernel, rows)
        reached.append(kernel.model_states(rows)[:, 0].copy())
    table["status"] = PARADOX
    monkeypatch.setattr(failures, "approach", approach)
    live([lives])
    np.testing.assert_array_equal(begun[0], reached[0])


def test_a_fixed_step_stays() -> None:
    found = run_cells([MISSES, THIN, ENDS[TOPPLED]], method="adams", step=0.2, t_end=100.0)
    np.testing.assert_allclose(found.step, 0.2, rtol=2e-3)
    assert set(found.step_rule.values.tolist()) == {FIXED}
    assert found.status.values.tolist() == [TIME_LIMIT, DIVERGED, TOPPLED]
    assert float(found.t_stop[2]) == pytest.approx(1.9815107, abs=1e-3)  # as near as its step allows


def test_a_true_failure_at_a_fixed_step() -> None:
    found = run_cells(ENDS.values(), method="dopri5", step=5e-5, t_end=50.0)
    automatic = run_cells(ENDS.values(), method="dopri5", t_end=50.0)
    assert found.status.values.tolist() == list(ENDS)
    np.testing.assert_allclose(found.t_stop, automatic.t_stop, rtol=0, atol=1e-6)
    np.testing.assert_allclose(found.step, 5e-5, rtol=1e-4)


@pytest.mark.parametrize(
    ("body", "step"), [({"b": 2.8, "mu": 100.0, "n0": 0.02}, 0.4), ({"b": 2.0, "mu": 100.0, "n0": 0.1}, 0.2)]
)
def test_no_energy_error_above_a_hundredth_without_a_failure(body: dict[str, float], step: float) -> None:
    found = run_cells([body], method="adams", step=step, t_end=400.0)
    assert float(found.energy_error[0]) > 0.01
    assert (int(found.status[0]), float(found.t_stop[0])) == (DIVERGED, 400.0)


@pytest.mark.parametrize(("size", "method"), [(1, "auto"), (3, "adams")])
def test_tiles_and_threads_do_not_touch_the_numbers(size: int, method: str) -> None:
    settings = {"method": method, "t_end": 5.0, "tolerance": 1e-9}
    whole = run_cells(MIXED, **settings)
    assert {TIME_LIMIT, *ENDS} <= set(whole.status.values.tolist())
    assert REPEAT in whole.step_rule
    with limited(tile=size, batch=2 * size):
        with threads(1):
            same_numbers(run_cells(MIXED, **settings), whole)
        found = run_cells(MIXED[::-1], **settings).isel(case=slice(None, None, -1))
    same_numbers(found.assign_coords(case=whole.case), whole)


@pytest.mark.usefixtures("short_chunks")
def test_an_interrupt_while_cells_are_repeated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    settings = {"method": "adams", "t_end": 5.0}
    whole, heard, out, plain = run_cells(MIXED, **settings), Heard(), tmp_path / "out", Lives.enter
    for wanted in (Approach, Second):

        def enter(lives: Lives, which: np.ndarray, to: Next, wanted: type[Any] = wanted) -> None:
            plain(lives, which, to)
            if isinstance(to, wanted) and len(which):
                heard.act = interrupt

        monkeypatch.setattr(Lives, "enter", enter)
        with pytest.raises(KeyboardInterrupt):
            run_cells(MIXED, out, progress=heard, **settings)
        monkeypatch.setattr(Lives, "enter", plain)
        heard.act = lambda: None
        assert [path.name for path in out.iterdir()] == ["cells.checkpoint"]
    same_numbers(run_cells(MIXED, out, progress=heard, **settings), whole)
    # A failure is reported only when it is certain, and no progress is taken back.
    failed, done = ([getattr(progress, name) for progress in heard.seen] for name in ("failed", "done"))
    assert done[-1] == len(MIXED)
    assert max(failed) == failed[-1] == int(np.isin(whole.status, list(ENDS)).sum())


def test_a_trajectory_is_that_of_the_run(write: Write) -> None:
    for body in (ENDS[PARADOX], THIN):
        found = run_cells([body], method="dopri5", t_end=3.0)
        series = sweep.trajectory(sweep.load_config(write("integrator: {t_end: 3, method: dopri5}\n"), STANDARD | body))
        for name in ("status", "t_stop", "step", "step_rule", "spin_final", "energy_error"):
            np.testing.assert_array_equal(series[name], found[name].squeeze("case"))
        last = int(np.isfinite(series.spin).sum()) - 1
        # The last sample is the last whole step; the spin at the end is that of the failure.
        assert float(series.spin[last]) == pytest.approx(float(found.spin_final[0]), abs=1e-3)
        assert float(series.time[last]) == pytest.approx(float(found.t_stop[0]), abs=2 * float(found.step[0]))


@pytest.mark.parametrize("method", ["adams", pytest.param("dopri5", marks=pytest.mark.release)])
def test_300_wide_cells_end_as_they_truly_do(method: str) -> None:
    rows = np.genfromtxt(ROOT / "data" / "reference_wide.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    bodies = [{name: row[name] for name in STANDARD} for row in rows]
    # Failures are decided before errors are estimated, which takes dopri5 minutes at strong friction.
    found = run_cells(bodies, method=method, t_end=400.0, stop_early=False, estimate_errors=method == "adams")
    ends = {"time_limit": TIME_LIMIT, "toppled": TOPPLED}
    np.testing.assert_array_equal(found.status, [ends[end] for end in rows["end"]])
    np.testing.assert_allclose(found.t_stop, rows["t_end"], rtol=0, atol=2e-6)
    assert float(found.energy_error.max()) < 0.01


@pytest.mark.parametrize("method", ["adams", "dopri5"])
def test_a_failure_does_not_depend_on_the_time_limit(method: str) -> None:
    """n0 = 5: heyoka.py's Taylor series lifts off at 1.423326."""
    scene = {"friction": {"mu": 100}, "integrator": {"method": method}}
    long, short = (sweep.run(scene, n0=[4.0, 5.0, 8.0, 12.0], **asked) for asked in ({}, {"t_end": 1000.0}))
    assert long.sweep.lift_off.all()
    assert float(long.t_stop.sel(n0=5)) == pytest.approx(1.423326, abs=1e-6)
    for name in ("status", "t_stop", "spin_final", "step"):
        np.testing.assert_array_equal(long[name], short[name])


def test_states_that_overflow_are_read_without_a_warning() -> None:
    """As a fixed step far beyond the limit of stability leaves them."""
    (part,) = plan(load_config({"name": "unstable", "model": "effective", "friction": {"mu": 60.0}})).parts
    rows = part.start()
    rows[:, : len(part.kernel.model.states)] = 1e305
    assert part.kernel.spins(rows).shape == part.take(np.arange(len(rows)), rows).inertia.shape == (1,)
