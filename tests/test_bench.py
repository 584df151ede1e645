"""The bench: its error measure, what it writes, and that each hard case catches a planted bug."""

from __future__ import annotations

import csv
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from sweep.bench import hard, precision, reference, report
from sweep.bench.reference import read_counts, read_spins, spin_errors, whole_steps
from sweep.bench.stopwatch import stopwatch
from sweep.bench.timing import Effort, Part, Spread, Work, in_turn
from sweep.bench.whole import PLACES, whole
from sweep.cli import main
from sweep.kernels import methods
from sweep.kernels.status import DIVERGED, LIFT_OFF, TIME_LIMIT
from sweep.models import MODELS
from sweep.report.direct import Ends, make_kernel, simulate, standard
from sweep.report.rows import Row, Section, states

TIMES = (25.0, 50.0)
TINY = Effort(
    trajectories=4, repeats=1, tolerances=(1e-5, 1e-6, 1e-7, 1e-8), rungs=2, sizes=(16,), ends=(50,), frictions=(10,),
    whole_sizes=(16,), settled_sizes=(4,), reference_frictions=1,
)  # fmt: skip
BODIES = [{"mu": 60.0}, {"mu": 60.0, "b": 5.0, "c": 0.7}]


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """References of two bodies for each model and of four cells, in place of the package's."""
    folder = tmp_path_factory.mktemp("data")
    with (folder / "spins.csv").open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(["model", "a", "b", "c", "delta", "mu", "n0", "x0", "y0", "t", "spin"])
        for model in MODELS:
            for body in BODIES:
                columns = standard(**body)
                start = [columns[n][0] for n in ("a", "b", "c", "delta")]
                mu = columns["mu"][0] if "mu" in MODELS[model].parameters else ""
                for t in TIMES:
                    spin = simulate(columns, t, model=model, step=0.005)["spin_final"].item()
                    writer.writerow([model, *start, mu, *(columns[n][0] for n in ("n0", "x0", "y0")), t, repr(spin)])
    cells = standard(mu=[40.0, 60.0, 75.0, 100.0])
    counts = simulate(cells, 30_000.0, settle=True)["reversals"]
    lines = ["a,b,delta,mu,n0,x0,y0,reversals,firm"]
    for i, count in enumerate(counts):
        lines.append(f"10,3,0.03,{cells['mu'][i]},0.05,0.01,0.01,{count:g},{int(i != 3)}")
    (folder / "counts.csv").write_text("\n".join(lines), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reference, "SPINS", folder / "spins.csv")
        patch.setattr(reference, "COUNTS", folder / "counts.csv")
        yield folder


@pytest.mark.campaign
@pytest.mark.usefixtures("data")
@pytest.mark.parametrize("method", ["dopri5", "adams"])
def test_error_is_the_largest_difference_from_the_reference(method: str) -> None:
    spins = read_spins()["slip"]
    step = whole_steps(spins, np.full(2, 0.02))
    kernel = make_kernel(method, MODELS["slip"], ("reversals", "energy_error"))
    error, violation = spin_errors(kernel, spins, step)
    assert (error < 1e-8).all()
    assert (violation < 1e-5).all()
    assert (violation > 0).all()
    spins.spins[1, 0] += 1e-3
    spins.spins[0, 1] -= 1e-5
    assert spin_errors(kernel, spins, step)[0] == pytest.approx([1e-5, 1e-3], rel=1e-3)


@pytest.mark.campaign
@pytest.mark.usefixtures("data")
def test_error_of_a_failed_trajectory_is_infinite() -> None:
    spins = read_spins()["slip"]
    kernel = make_kernel("dopri5", MODELS["slip"], ("reversals", "energy_error"))
    assert list(spin_errors(kernel, spins, np.full(2, 0.1))[0]) == [np.inf, np.inf]


@pytest.mark.usefixtures("data")
def test_references_are_read_by_model_and_body() -> None:
    spins = read_spins()
    assert set(spins) == set(MODELS)
    assert list(spins["slip"].times) == list(TIMES)
    assert [spins["slip"].name(i) for i in (0, 1)] == ["μ = 60", "b = 5, c = 0.7, μ = 60"]
    assert [spins["noslip"].name(i) for i in (0, 1)] == ["standard", "b = 5, c = 0.7"]
    assert spins["noslip"].spins.shape == (2, 2)
    counts = read_counts()
    assert list(counts.firm) == [True, True, True, False]
    assert list(counts.columns["mu"]) == [40, 60, 75, 100]


def test_times_of_the_reference_are_multiples_of_the_step() -> None:
    spins = reference.Spins({}, np.array([25.0, 50.0]), np.zeros((3, 2)))
    steps = whole_steps(spins, np.array([0.3, 0.25, 30.0]))
    assert 25 / steps == pytest.approx(np.round(25 / steps), rel=1e-14)
    assert (steps <= [0.3, 0.25 * (1 + 1e-9), 30.0]).all()
    assert steps[1] == 0.25


def test_works_take_turns_and_slow_ones_run_less_often() -> None:
    order: list[str] = []
    works = {name: (lambda name=name: order.append(name)) for name in "ab"}
    spreads = in_turn(works, Effort(repeats=4))
    assert order == list("abababab")
    assert len(spreads["a"].values) == 4
    assert len(in_turn(works, Effort(repeats=9, patience=0.0))["a"].values) == 3
    assert f"{Spread((3.0, 1.0, 2.0)):.1f}" == "2.0 (1.0 … 3.0)"


@pytest.mark.campaign
@pytest.mark.usefixtures("data")
def test_a_tiny_run_writes_all_files_and_sections(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hard, "CASES", (hard.equilibrium,))
    said: list[str] = []
    assert report.bench(tmp_path, said.append, TINY) == []

    with (tmp_path / "bench.csv").open(encoding="utf-8", newline="") as stream:
        lines = list(csv.DictReader(stream))
    assert {line["section"] for line in lines} == {"precision", "tolerance", "counts", "peak", "cost", "whole"}
    pairs = {(line["model"], line["method"]) for line in lines if line["section"] == "precision"}
    assert pairs == {("slip", "dopri5"), ("slip", "adams")} | {(m, "dopri5") for m in MODELS if m != "slip"}
    for line in lines:
        low, middle, high = (float(line[key]) for key in ("smallest", "median", "largest"))
        assert low <= middle <= high
    errors = [float(line["median"]) for line in lines if line["quantity"] == "spin_error"]
    assert 0 < max(errors) < 1e-3
    wrong = {float(line["median"]) for line in lines if line["section"] == "counts"}
    assert wrong == {0.0}
    share = [float(line["median"]) for line in lines if line["quantity"] == "percent_of_peak"]
    assert len(share) == 4
    assert min(share) > 0  # a share of a peak measured while other tests run may be anything

    page = (tmp_path / "bench.html").read_text(encoding="utf-8")
    assert "http" not in page.replace("http-equiv", "")
    assert page.count("<h2>") == 8
    assert "data:image/png;base64" in page
    assert (tmp_path / "bench.png").read_bytes().startswith(b"\x89PNG")
    text = "\n".join(said)
    assert all(
        title in text for title in ("Work and precision", "Wrong counts", "FMA peak", "Cost", "Whole runs", "Hard")
    )


def test_a_call_inside_another_counts_for_its_own_share_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([0.0, 1.0, 11.0, 100.0])
    monkeypatch.setattr(time, "perf_counter", lambda: next(clock))

    class Calls:
        def outer(self) -> str:
            return self.inner()

        def inner(self) -> str:
            return "result"

    with stopwatch({(Calls, "outer"): "outside", (Calls, "inner"): "inside"}) as seconds:
        assert Calls().outer() == "result"
    assert seconds == {"outside": 90.0, "inside": 10.0}
    assert next(clock, None) is None


def test_nothing_is_left_in_the_code_that_was_timed() -> None:
    before = [vars(owner)[name] for owner, name in PLACES]
    with stopwatch(PLACES):
        assert all(vars(owner)[name] not in before for owner, name in PLACES)
    assert [vars(owner)[name] for owner, name in PLACES] == before


@pytest.mark.campaign
def test_whole_runs_are_timed_beside_their_kernels() -> None:
    part = whole(TINY)
    found = {(m.method, m.case, m.quantity): m.spread.median for m in part.measurements}
    for method in methods.METHODS:
        assert 0 < found[method, "T = 400", "spin_error"] < 1e-7
        for case in ("T = 400", "to the end"):
            assert found[method, case, "ratio"] > 1
            assert 0 < found[method, case, "kernel_seconds"] < found[method, case, "seconds"]
    assert found["adams", "T = 400", "start_up_seconds"] > 0
    assert found["dopri5", "T = 400", "start_up_seconds"] == 0
    shares = {quantity: value for (_, case, quantity), value in found.items() if case == "reference sweep"}
    assert all(value > 0 for value in shares.values())
    assert sum(shares.values()) == pytest.approx(2 * shares["whole_seconds"])
    (_, beside), (_, shared) = part.section.tables
    assert [len(line) for line in beside] == [9] * 5
    assert [len(line) for line in shared] == [8] * 3


@pytest.mark.campaign
@pytest.mark.parametrize("method", methods.METHODS)
def test_timed_runs_reach_the_end(method: str) -> None:
    work = Work(make_kernel(method, MODELS["slip"], ()), standard(mu=[60.0, 75.0]), np.full(2, 0.01), 50.0)
    states = work.kernel.unpack(work())[0]
    np.testing.assert_array_equal(states, simulate(standard(mu=[60.0, 75.0]), 50.0, method=method, step=0.01).states)


@pytest.mark.campaign
@pytest.mark.usefixtures("data")
def test_methods_are_compared_at_equal_error() -> None:
    work = precision.Work(make_kernel("adams", MODELS["slip"], ()), standard(), np.array([0.1]))
    settings = [("dopri5", 1e-9, 4.0), ("adams", 1e-5, 0.5), ("adams", 1e-7, 1.0), ("adams", 1e-8, 2.0)]
    points = [precision.Point("slip", method, "μ = 60", 0.1, error, work) for method, error, _ in settings]
    _, lines = precision._at_equal_error(points, [cost for *_, cost in settings])
    assert lines[1] == ["μ = 60", "4", "1", "4"]


@pytest.mark.parametrize(("holds", "code"), [(True, 0), (False, 1)])
def test_exit_code_tells_whether_the_hard_cases_hold(
    holds: bool, code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(report, "PARTS", (lambda _: Part(Section("Nothing"), panels=[lambda _: None]),))
    monkeypatch.setattr(report, "compile_kernels", lambda: None)
    monkeypatch.setattr(hard, "CASES", (lambda: [states("<one>", "adams", "a", "b", holds)],))
    result = CliRunner().invoke(main, ["bench", "--output", str(tmp_path)], catch_exceptions=False)
    assert result.exit_code == code
    assert f"{1 - holds} hard cases do not hold" in result.stdout
    assert "&lt;one&gt;" in (tmp_path / "bench.html").read_text(encoding="utf-8")


LONG = 2e5
REAL: dict[Any, Ends] = {}
Bug = Callable[[Ends, dict[str, Any]], None]


def remembered(columns: dict[str, np.ndarray], t_end: float, **options: Any) -> Ends:
    """`simulate`, which runs each case once; a test may change what it returns."""
    key = tuple(
        (name, np.asarray(value).tobytes() if isinstance(value, np.ndarray) else value)
        for name, value in (*columns.items(), ("t_end", t_end), *options.items())
    )
    if key not in REAL:
        REAL[key] = simulate(columns, t_end, **options)
    return Ends(REAL[key].kernel, REAL[key].images.copy(), t_end)


def rows_with(case: Callable[[], list[Row]], bug: Bug | None, monkeypatch: pytest.MonkeyPatch) -> list[Row]:
    def spoilt(columns: dict[str, np.ndarray], t_end: float, **options: Any) -> Ends:
        ends = remembered(columns, t_end, **options)
        if bug:
            bug(ends, {"t_end": t_end, "method": "dopri5"} | options)
        return ends

    monkeypatch.setattr(hard, "LONG", LONG)
    monkeypatch.setattr(hard, "simulate", spoilt)
    return case()


def row(name: str, value: float, when: Callable[[dict[str, Any]], bool] = lambda _: True) -> Bug:
    """A bug that sets a row of the images to a value."""

    def bug(ends: Ends, options: dict[str, Any]) -> None:
        if when(options):
            ends.images[:, ends.kernel.row(name)] = value

    return bug


def one_more_reversal(when: Callable[[dict[str, Any]], bool] = lambda _: True) -> Bug:
    def bug(ends: Ends, options: dict[str, Any]) -> None:
        if when(options):
            ends.images[:, ends.kernel.row("reversals")] += 1

    return bug


def scaled(states: slice, factor: float, when: Callable[[dict[str, Any]], bool] = lambda _: True) -> Bug:
    """A bug that multiplies some of the states."""

    def bug(ends: Ends, options: dict[str, Any]) -> None:
        if when(options):
            ends.images[:, states] *= factor

    return bug


def earlier(ends: Ends, options: dict[str, Any]) -> None:
    """Trajectories that end too early."""
    if "step" not in options:
        ends.images[:, ends.kernel.row("done")] *= 0.9


def undetected(ends: Ends, options: dict[str, Any]) -> None:
    """A divergence without its status."""
    if "step" in options:
        ends.images[:, ends.kernel.row("status")] = TIME_LIMIT


SPIN, ALL = slice(4, 5), slice(0, 7)
PLANTED: list[tuple[Callable[[], list[Row]], str, Bug]] = [
    (hard.frictions, "status", row("status", DIVERGED)),
    (hard.frictions, "energy", row("violation", 1e-3)),
    (hard.frictions, "not finite", row("v1", np.nan)),
    (hard.frictions, "spin", scaled(SPIN, 1.001, lambda o: o["method"] == "adams")),
    (hard.strong_friction, "status", row("status", DIVERGED, lambda o: o["tolerance"] != 1e-10)),
    (hard.strong_friction, "spin", scaled(SPIN, 1.01, lambda o: o["tolerance"] != 1e-10)),
    (hard.shapes, "count", one_more_reversal(lambda o: "tolerance" not in o)),
    (hard.shapes, "status", row("status", DIVERGED)),
    (hard.shapes, "energy", row("violation", 1.0)),
    (hard.achiral, "count", one_more_reversal()),
    (hard.achiral, "spin", scaled(SPIN, 1.001)),
    (hard.no_spin, "status", row("status", TIME_LIMIT)),
    (hard.no_spin, "energy", row("violation", 1.0)),
    (hard.no_spin, "spin", scaled(SPIN, 1000.0)),
    (hard.no_spin, "apart", scaled(SPIN, 1.1, lambda o: o["method"] == "adams")),
    (hard.equilibrium, "denormal", row("u1", 5e-324)),
    (hard.equilibrium, "last bit", scaled(SPIN, 1 + 2.3e-16)),
    (hard.tiny_rattle, "growth", scaled(ALL, 1.0001, lambda o: o["t_end"] == 350.0)),
    (hard.tilts, "spin", scaled(SPIN, 1.001, lambda o: "step" not in o)),
    (hard.tilts, "energy", row("violation", 1.0)),
    (hard.tilts, "status", row("status", LIFT_OFF)),
    (hard.fast_spins, "status", row("status", DIVERGED, lambda o: "step" not in o)),
    (hard.fast_spins, "time", earlier),
    (hard.fast_spins, "spin", scaled(SPIN, 1.001, lambda o: "step" not in o)),
    (hard.long_run, "spin", scaled(SPIN, 1.001, lambda o: o["t_end"] == LONG)),
    (hard.long_run, "count", one_more_reversal(lambda o: o["t_end"] == LONG)),
    (hard.long_run, "energy", row("violation", 1.0)),
    (hard.long_run, "status", row("status", DIVERGED)),
    (hard.beyond_stability, "undetected", undetected),
    (hard.beyond_stability, "count", one_more_reversal(lambda o: "step" in o)),
]


@pytest.mark.campaign
@pytest.mark.parametrize(
    ("case", "bug"), [(c, b) for c, _, b in PLANTED], ids=[f"{c.__name__}-{w}" for c, w, _ in PLANTED]
)
def test_a_planted_bug_fails_its_case(case: Callable[[], list[Row]], bug: Bug, monkeypatch: pytest.MonkeyPatch) -> None:
    sound = [r.holds for r in rows_with(case, None, monkeypatch)]
    spoilt = [r.holds for r in rows_with(case, bug, monkeypatch)]
    assert any(before and not after for before, after in zip(sound, spoilt, strict=True))


def test_every_case_has_a_planted_bug() -> None:
    assert {case for case, _, _ in PLANTED} | {hard.late_reversal} == set(hard.CASES)


@pytest.mark.campaign
@pytest.mark.parametrize(
    ("count", "last", "flag", "holds"),
    [(9, 12916, 0, True), (9, 12800, 0, True), (9, 12251, 0, False), (9, 12251, 1, True), (8, 12916, 1, False)],
)
def test_verdict_on_late_reversals(
    count: int, last: float, flag: int, holds: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    def plant(ends: Ends, _: dict[str, Any]) -> None:
        ends.images[:, ends.kernel.row("reversals")] = count
        ends.images[:, ends.kernel.row("last_reversal")] = last
        ends.images[:, ends.kernel.row("noise_limited")] = flag

    assert [r.holds for r in rows_with(hard.late_reversal, plant, monkeypatch)] == [holds, holds]


@pytest.mark.campaign
@pytest.mark.parametrize(
    "case",
    [c for c in hard.CASES if c not in (hard.late_reversal, hard.strong_friction)],
    ids=lambda case: case.__name__,
)
def test_hard_cases_hold(case: Callable[[], list[Row]], monkeypatch: pytest.MonkeyPatch) -> None:
    assert [r for r in rows_with(case, None, monkeypatch) if not r.holds] == []
