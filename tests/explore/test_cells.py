"""Trajectories behind the page: the sweep's own numbers, the newest request first, and files that make them again."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import sweep
from sweep.explore import cells, export
from sweep.explore.cells import COMPILING, News, Runner
from sweep.explore.setup import Setup, usable
from sweep.explore.slices import Source, open_source
from sweep.explore.state import State
from sweep.kernels.status import LIFT_OFF


@pytest.fixture(scope="module")
def source(tiny: Path) -> Source:
    return open_source(tiny)


@pytest.fixture(scope="module")
def setup(source: Source) -> Setup:
    return Setup(source)


def cell_at(source: Source, setup: Setup, **index: int) -> dict[str, float]:
    return {**setup.base, **source.parameters_at(tuple(setup.base), index)}


class Listener:
    """Collects what a run tells, and waits for its end."""

    def __init__(self) -> None:
        self.news = list[News]()
        self._ended = threading.Event()

    def __call__(self, news: News) -> None:
        self.news.append(news)
        if news.curve or news.fault:
            self._ended.set()

    def wait(self) -> News:
        assert self._ended.wait(60), self.news
        return self.news[-1]


def test_a_trajectory_has_the_sweeps_numbers(source: Source, setup: Setup, opened: xr.Dataset) -> None:
    index = {"mu": 3, "b": 2, "n0": 1}
    curve = cells.run(setup, cell_at(source, setup, **index))
    cell = opened.isel(index)
    for name in ("reversals", "t_stop", "spin_final"):
        assert curve.dataset[name].item() == cell[name].item()
    assert len(curve.reversals) == cell["reversals"]
    assert {"contact_x", "energy", "dissipated"} <= set(curve.dataset)


def test_long_trajectories_are_sampled_sparsely(
    source: Source, setup: Setup, monkeypatch: pytest.MonkeyPatch
) -> None:  # fmt: skip
    cell = cell_at(source, setup, mu=3, b=2, n0=1)
    whole = cells.run(setup, cell).dataset
    monkeypatch.setattr(cells, "SAMPLES", 500)
    sparse = cells.run(setup, cell).dataset
    assert whole.sizes["time"] > 2000
    assert 450 < sparse.sizes["time"] < 600
    assert sparse["spin"].values[-1] == whole["spin"].values[-1]


def test_what_cannot_be_run_is_told(setup: Setup) -> None:
    listener = Listener()
    Runner().submit(1, setup, {**setup.base, "x0": 50.0}, listener)
    assert "x0" in listener.wait().fault


def test_a_newer_request_replaces_the_older(setup: Setup, monkeypatch: pytest.MonkeyPatch) -> None:
    """The running one ends at its next chunk, the waiting one is never begun, and neither is heard of again."""
    begun, go_on = list[float](), threading.Event()

    def slow(_: Setup, cell: cells.Cell, reporter: Runner) -> cells.Curve:
        begun.append(cell["mu"])
        if len(begun) == 1:
            assert go_on.wait(60)
        reporter.chunk(cells.Progress(1, 0.5, 0, 0, 1.0))
        return cells.Curve(cell, xr.Dataset(), np.zeros(0), 0.0)

    monkeypatch.setattr(cells, "run", slow)
    runner, listeners = Runner(), [Listener() for _ in range(3)]
    runner.submit("a", setup, {"mu": 1.0}, listeners[0])
    while not begun:
        pass
    runner.submit("a", setup, {"mu": 2.0}, listeners[1])
    runner.submit("a", setup, {"mu": 3.0}, listeners[2])
    go_on.set()
    curve = listeners[2].wait().curve
    assert curve
    assert curve.cell == {"mu": 3.0}
    assert begun == [1.0, 3.0]
    assert not listeners[0].news
    assert not listeners[1].news


def test_compiling_is_announced_to_all_who_wait(setup: Setup, monkeypatch: pytest.MonkeyPatch) -> None:
    from sweep.jit import compiling

    inside, go_on = threading.Event(), threading.Event()

    def compile_first(_: Setup, cell: cells.Cell, _reporter: Runner) -> cells.Curve:
        with compiling():
            inside.set()
            assert go_on.wait(60)
        return cells.Curve(cell, xr.Dataset(), np.zeros(0), 0.0)

    monkeypatch.setattr(cells, "run", compile_first)
    runner, first, second = Runner(), Listener(), Listener()
    runner.submit(1, setup, {"mu": 1.0}, first)
    assert inside.wait(60)
    runner.submit(2, setup, {"mu": 2.0}, second)
    assert [news.note for news in (*first.news, *second.news)] == [COMPILING, COMPILING]
    go_on.set()
    assert second.wait().curve


def test_the_files_make_what_is_seen(source: Source, setup: Setup, opened: xr.Dataset, tmp_path: Path) -> None:
    cell = cell_at(source, setup, mu=3, b=2, n0=1)
    state = State("mu", "b", "reversals", {"n0": 1}, (cell,))
    saved = tmp_path / "saved.nc"
    saved.write_bytes(export.netcdf(source, "x=mu", state, [cells.run(setup, cell)]))
    with xr.open_dataset(saved, decode_times=False) as part:
        xr.testing.assert_equal(part.load(), opened.isel(n0=1))
        assert part.attrs["explored"] == "x=mu"
    with xr.open_dataset(saved, group="trajectory_1", decode_times=False) as dense:
        assert float(dense["spin_final"]) == opened["spin_final"].isel(mu=3, b=2, n0=1)

    config = tmp_path / "saved.yaml"
    config.write_text(export.yaml(source, setup, state, "saved.yaml"), encoding="utf-8")
    again = sweep.run(config)
    sound = opened["status"].isel(n0=1) != LIFT_OFF
    assert sound.sum() == 19
    np.testing.assert_array_equal(again["spin_final"].where(sound), opened["spin_final"].isel(n0=1).where(sound))
    (line,) = [line for line in config.read_text().splitlines() if "trajectory" in line]
    assert line == "# python -m sweep trajectory saved.yaml --at b=4 --at mu=70"


def test_cases_are_run_with_their_own_parameters(tmp_path: Path) -> None:
    (tmp_path / "cases.csv").write_text("mu,b\n50,2.5\n70,4\n")
    config = tmp_path / "table.yaml"
    config.write_text("cases: cases.csv\nintegrator: {method: dopri5, t_end: 300}\n")
    dataset = sweep.run(config)
    source = Source(dataset)
    setup = Setup(source)
    cell = cell_at(source, setup, case=1)
    assert (cell["mu"], cell["b"]) == (70, 4)
    assert cells.run(setup, cell).dataset["spin_final"].item() == dataset["spin_final"][1].item()


@pytest.mark.parametrize("text", ["", "colour: red\n", "model: analytic\nfriction: {mu: [1, 2]}\n"])
def test_without_a_usable_configuration_there_are_maps_alone(text: str, opened: xr.Dataset) -> None:
    assert usable(Source(opened.assign_attrs(config=text))) is None
