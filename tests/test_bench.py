"""The bench: its error measure, its report for every method, and that the hard cases catch planted bugs."""

import csv
import re
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.cli import invoke
from support.processes import python

from sweep.bench import hard, precision, report
from sweep.bench.precision import Effort, Measured, Point, Spread, in_turn
from sweep.bench.reference import Spins, read_spins, spin_errors, whole_steps
from sweep.kernels.methods import METHODS, allowed
from sweep.kernels.status import DIVERGED, LIFT_OFF, PARADOX
from sweep.models import MODELS
from sweep.report.direct import Ends, make_kernel, simulate
from sweep.report.rows import Section, states


def two() -> Spins:
    """Spins of two bodies at t = 25 and 50, by Taylor series in 128 bits."""
    spins = read_spins()["slip"].select(np.array([2, 8]))
    return Spins(spins.columns, spins.times[:2], spins.spins[:, :2])


@pytest.mark.campaign
@pytest.mark.parametrize("method", METHODS)
def test_error_is_the_largest_difference_from_the_reference(method: str) -> None:
    spins = two()
    step = whole_steps(spins, np.full(2, 0.02))
    kernel = make_kernel(method, MODELS["slip"], ())
    assert (spin_errors(kernel, spins, step) < 1e-8).all()
    spins.spins[1, 0] += 1e-3
    spins.spins[0, 1] -= 1e-5
    assert spin_errors(kernel, spins, step) == pytest.approx([1e-5, 1e-3], rel=1e-3)
    if np.isfinite(METHODS[method].real_stability):  # a step beyond stability fails
        assert list(spin_errors(kernel, spins, np.full(2, 0.1))) == [np.inf, np.inf]


def test_times_of_the_reference_are_multiples_of_the_step() -> None:
    spins = Spins({}, np.array([25.0, 50.0]), np.zeros((3, 2)))
    steps = whole_steps(spins, np.array([0.3, 0.25, 30.0]))
    assert 25 / steps == pytest.approx(np.round(25 / steps), rel=1e-14)
    assert (steps <= [0.3, 0.25 * (1 + 1e-9), 30.0]).all()
    assert steps[1] == 0.25


def test_works_take_turns_and_slow_ones_run_less_often() -> None:
    order: list[str] = []
    works = [partial(order.append, name) for name in "ab"]
    spreads = in_turn(works, Effort(repeats=4))
    assert order == list("abababab")
    assert len(spreads[0].values) == 4
    assert len(in_turn(works, Effort(repeats=9, patience=0.0))[0].values) == 3
    assert f"{Spread(np.array([3.0, 1.0, 2.0])):.1f}" == "2.0 (1.0 … 3.0)"


TINY = """\
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from sweep.kernels.methods import METHODS

METHODS["twin"] = replace(METHODS["dopri5"], name="twin", code=9)  # before anybody has read the registry

from sweep.bench import hard, reference, report
from sweep.bench.precision import Effort

spins = reference.read_spins()
bodies = {model: found.select(np.array([2, 3])) for model, found in spins.items()}
reference.read_spins = lambda: {m: reference.Spins(s.columns, s.times[:2], s.spins[:, :2]) for m, s in bodies.items()}
hard.cases = lambda: [hard.Case(["short"], hard.standard(), 20.0)]
assert report.bench(Path(sys.argv[1]), print, Effort(trajectories=4, repeats=1, rungs=2)) == []
"""


@pytest.mark.campaign
def test_a_tiny_run_reports_every_method(tmp_path: Path) -> None:
    """Also one that has just been added to the registry."""
    printed = python("-c", TINY, tmp_path).stdout
    with (tmp_path / "bench.csv").open(encoding="utf-8", newline="") as stream:
        lines = list(csv.DictReader(stream))
    known = {(model, method) for model in read_spins() for method in allowed(MODELS[model])}
    twins = {(model, "twin") for model, method in known if method == "dopri5"}
    assert {(line["model"], line["method"]) for line in lines} == known | twins
    for line in lines:
        low, middle, high = (float(line[key]) for key in ("ms_smallest", "ms_median", "ms_largest"))
        assert 0 < low <= middle <= high
        assert 0 < float(line["spin_error"]) < 1e-3
    assert "short [twin]" in printed
    page = (tmp_path / "bench.html").read_text(encoding="utf-8")
    assert not re.search("https?:", page)  # letters alone occur in pictures by chance
    assert [page.count(part) for part in ("<h2>", "data:image/png;base64")] == [2, 1]
    assert (tmp_path / "bench.png").read_bytes().startswith(b"\x89PNG")


def measured(method: str, error: float, cost: float) -> Measured:
    return Measured(Point("slip", method, "μ = 60", 0.1, error, 1, print), Spread(np.array([cost])))


def test_methods_are_compared_at_equal_error() -> None:
    settings = [("dopri5", 1e-9, 4.0), ("adams", 1e-5, 0.5), ("adams", 1e-7, 1.0), ("adams", 1e-8, 2.0)]
    found = [measured(*setting) for setting in settings]
    _, lines = precision.at_equal_error(found)
    row = dict(zip(*lines, strict=True))
    assert row.pop("slip") == "μ = 60"
    ours = ("dopri5, ms per trajectory", "adams, ms per trajectory", "adams: times faster")
    assert [row.pop(name) for name in ours] == ["4", "1", "4"]
    assert {*row.values()} <= {"—"}  # methods without a measurement
    # 4 ms for 400 / 0.1 steps
    assert found[0].nanoseconds == pytest.approx(1000)


@pytest.mark.parametrize(("holds", "code"), [(True, 0), (False, 1)])
def test_the_exit_code_shows_whether_the_hard_cases_hold(
    holds: bool, code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(report, "hard_cases", lambda: Section("Some", [states("<one>", "adams", "a", "b", holds)]))
    monkeypatch.setattr(precision, "measure", lambda _: [measured("adams", 1e-7, 1.0)])
    result = invoke("bench", "--output", tmp_path)
    assert result.exit_code == code
    assert f"failed hard cases: {'none' if holds else 1}" in result.stdout
    assert "&lt;one&gt;" in (tmp_path / "bench.html").read_text(encoding="utf-8")


PLANTED: dict[str | int, tuple[float, float]] = {
    "status": (0, DIVERGED), "v1": (0, np.nan), "reversals": (1, 1), "violation": (0, 1),
    4: (1, 0.01), "failed_at": (0.9, 0),
}  # fmt: skip
"""Indices of quantities, 4 the spin's, with the factor and the summand by which a bug changes them at the end."""


def noticed(case: hard.Case) -> set[str | int]:
    """The rows on which the verdict depends: the spin, or the time of a failure, and the energy if it is judged."""
    failing = case.end in (LIFT_OFF, PARADOX)
    return set(PLANTED) - {4 if failing else "failed_at"} - ({"violation"} if np.isinf(case.energy) else set())


@pytest.mark.campaign
def test_hard_cases_hold_and_a_planted_bug_fails_each(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hard, "LONG", 2e5)
    runs: dict[tuple[bool, str], Ends] = {}
    planted: list[str | int] = []

    def spoilt(columns: dict[str, np.ndarray], t_end: float, **options: Any) -> Ends:
        """The run, or what is remembered of it, with the bugs that are planted unless it is that at shorter steps."""
        key = ("step" in options, options["method"])
        if key not in runs:
            runs[key] = simulate(columns, t_end, **options)
        ends = replace(runs[key], rows=runs[key].rows.copy())
        for name in () if "step" in options else planted:
            factor, summand = PLANTED[name]
            row = name if isinstance(name, int) else ends.kernel.layout.index(name)
            ends.rows[:, row] = factor * ends.rows[:, row] + summand
        return ends

    monkeypatch.setattr(hard, "simulate", spoilt)
    for case in hard.cases():
        assert all(row.holds for row in hard.rows(case)), case.names
        for name in noticed(case):
            planted[:] = [name]
            assert not any(row.holds for row in hard.rows(case)), (name, case.names)
        runs.clear()
        planted.clear()
