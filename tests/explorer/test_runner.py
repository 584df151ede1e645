"""Trajectories behind the page: the sweep's own numbers, the newest request first, and files that make them again."""

import re
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from support import ROOT

import sweep
from sweep.engine.reporter import Progress
from sweep.explorer import runner
from sweep.explorer.runner import COMPILING, Curve, Drawn, Job, Runner
from sweep.explorer.setup import Setup, usable
from sweep.explorer.slices import Source
from sweep.explorer.state import Cell
from sweep.jit import compiling


def cell_at(source: Source, setup: Setup, **index: int) -> dict[str, float]:
    return {**setup.base, **source.parameters_at(tuple(setup.base), index)}


def whole(setup: Setup, cell: Cell) -> Curve:
    """The curve of a cell when it is over."""
    *_, curve = Job(cell, lambda _: None).begin(setup)
    return curve


class Heard(Job):
    """A job that remembers what it was delayed by when it had news, and can be waited for."""

    def __init__(self, cell: Cell) -> None:
        super().__init__(cell, self._hear)
        self.delays, self._ended = list[str](), threading.Event()

    def _hear(self, job: Job) -> None:
        self.delays.append(job.delay)
        if job.over:
            self._ended.set()

    def wait(self) -> Job:
        assert self._ended.wait(60), self.delays
        return self


def test_a_curve_continues_where_a_sweep_ends(setup: Setup) -> None:
    """A spin below 1.5 n_c1 settles within a few units of time, and is seen nevertheless."""
    cell = {**setup.base, "mu": 75.0, "b": 3.0, "n0": -0.006}
    assert sweep.trajectory(setup.config, at=cell, stop_early=True)["t_stop"].item() < 10
    assert whole(setup, cell).dataset["time"][-1] == setup.config.integrator.t_end


def test_a_curve_grows(source: Source, setup: Setup) -> None:
    """Its first stretch, which takes a small part of the time, is the beginning of the whole."""
    first, *later = Job(cell_at(source, setup, mu=3, b=2, n0=1), lambda _: None).begin(setup)
    assert not first.whole
    assert [curve.whole for curve in later] == [False, False, False, False, True][-len(later) :]
    last = later[-1].dataset
    assert first.dataset["time"][-1] < last["time"][-1] / 100
    few = first.dataset["spin"].values
    np.testing.assert_allclose(few, np.interp(first.dataset["time"], last["time"], last["spin"]), atol=1e-4)


def test_a_curve_ends_where_nothing_happens_any_more(opened: xr.Dataset) -> None:
    """What a longer run counts is counted by then."""
    config = str(opened.attrs["config"])
    setup = Setup(Source(opened.assign_attrs(config=re.sub("t_end: [^,}]*", "t_end: 12000.0", config))))
    assert setup.config.integrator.t_end == 12000
    cell = {**setup.base, "mu": 40.0, "b": 4.0, "n0": 0.02}
    curve, long = whole(setup, cell), sweep.trajectory(setup.config, at=cell)
    assert curve.dataset["t_stop"] < 12000
    assert curve.dataset["reversals"] == long["reversals"].item() > 0


def test_a_curve_ends_with_the_steps_and_samples_of_a_long_one(setup: Setup, monkeypatch: pytest.MonkeyPatch) -> None:
    """An address may name a friction whose steps are so short that the first stretch would take days."""
    monkeypatch.setattr(runner, "MAX_STEPS", 1e5)
    monkeypatch.setattr(runner, "MAX_SAMPLES", 500)
    steep, usual = (whole(setup, {**setup.base, "mu": mu}).dataset for mu in (1e9, 60.0))
    assert steep["t_stop"] == pytest.approx(1e5 * steep["step"].item(), rel=1e-4)
    np.testing.assert_allclose(np.diff(usual["time"])[:-1], setup.config.integrator.t_end / 500)


def test_short_stretches_go_first(setup: Setup) -> None:
    """A cell that is added is seen before those before it are run to their ends."""
    news = list[tuple[float, bool]]()

    class Noting(Heard):
        def _hear(self, job: Job) -> None:
            if job.curve:
                news.append((job.cell["mu"], job.curve.whole))
            super()._hear(job)

    running = Runner(setup)
    jobs = [Noting({**setup.base, "mu": mu, "b": 4.0, "n0": 0.05}) for mu in (60.0, 70.0)]
    for job in jobs:
        running.submit(job)
    for job in jobs:
        job.wait()
    assert news.index((70.0, False)) < news.index((60.0, True))


def test_the_first_of_cells_that_are_shown_at_once_is_active(monkeypatch: pytest.MonkeyPatch, setup: Setup) -> None:
    monkeypatch.setattr(Runner, "submit", lambda *_: None)
    drawn = Drawn([], Runner(setup), lambda _: None)
    drawn.show([{"mu": 60.0}, {"mu": 70.0}])
    assert drawn.active == 0


def test_what_cannot_be_run_is_reported(setup: Setup) -> None:
    job = Heard({**setup.base, "x0": 50.0})
    Runner(setup).submit(job)
    assert "x0" in job.wait().fault


def test_dropped_jobs_report_nothing(setup: Setup, monkeypatch: pytest.MonkeyPatch) -> None:
    """The running one ends at its next chunk, and the waiting one is never begun."""
    begun, inside, go_on = list[float](), threading.Event(), threading.Event()

    def slow(job: Job, _: Setup) -> Iterator[Curve]:
        begun.append(job.cell["mu"])
        inside.set()
        assert go_on.wait(60)
        job.chunk(Progress(1, 0.5, 0, 0, 1.0))
        yield Curve(xr.Dataset(), np.zeros(0), 0.0)

    monkeypatch.setattr(Job, "begin", slow)
    running, first, second, third = Runner(setup), *(Heard({"mu": mu}) for mu in (1.0, 2.0, 3.0))
    for job in (first, second, third):
        running.submit(job)
    assert inside.wait(60)
    first.dropped = second.dropped = True
    go_on.set()
    assert third.wait().curve
    assert begun == [1.0, 3.0]
    assert first.delays + second.delays == []


def test_compiling_is_announced_to_all_who_wait(setup: Setup, monkeypatch: pytest.MonkeyPatch) -> None:
    inside, go_on = threading.Event(), threading.Event()

    def compile_first(*_: object) -> Iterator[Curve]:
        with compiling():
            inside.set()
            assert go_on.wait(60)
        yield Curve(xr.Dataset(), np.zeros(0), 0.0)

    monkeypatch.setattr(Job, "begin", compile_first)
    running, first, second = Runner(setup), Heard({"mu": 1.0}), Heard({"mu": 2.0})
    running.submit(first)
    assert inside.wait(60)
    running.submit(second)
    assert [first.delays, second.delays] == [[COMPILING], [COMPILING]]
    go_on.set()
    assert second.wait().curve
    assert not second.delay


def test_cases_are_run_with_their_own_parameters(tmp_path: Path) -> None:
    (tmp_path / "cases.csv").write_text("mu,b\n50,2.5\n70,4\n")
    config = tmp_path / "table.yaml"
    config.write_text("cases: cases.csv\nintegrator: {method: dopri5, t_end: 300}\n")
    dataset = sweep.run(config)
    source = Source(dataset)
    setup = Setup(source)
    cell = cell_at(source, setup, case=1)
    assert (cell["mu"], cell["b"]) == (70, 4)
    assert whole(setup, cell).dataset["spin_final"].item() == dataset["spin_final"][1].item()


@pytest.mark.parametrize("text", ["", "colour: red\n", "model: analytic\nfriction: {mu: [1, 2]}\n"])
def test_without_a_usable_configuration_there_are_maps_alone(text: str, opened: xr.Dataset) -> None:
    assert usable(Source(opened.assign_attrs(config=text))) is None


def test_an_axis_on_which_no_prediction_depends_has_its_first_value() -> None:
    predicted = sweep.predict(ROOT / "configs" / "kane_levinson_coulomb.yaml")
    source = Source(predicted)
    assert "n0" in predicted.dims
    assert "n0" not in source.axes
    assert Setup(source).base["n0"] == float(predicted["n0"][0])
