"""Whole runs: from a configuration to numbers, however they are cut into tiles, chunks and sittings."""

import gc
import time
import weakref
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from support import Write, columns
from support.kernels import kernel, started, threads
from support.runs import in_sittings, limited, same_numbers

import sweep
from sweep.config import load_config
from sweep.engine import executor, life, local
from sweep.engine.limits import LIMITS
from sweep.engine.lives import RUN, SECOND, Lives
from sweep.engine.plan import plan
from sweep.kernels import methods
from sweep.kernels.kernel import Kernel
from sweep.models import MODELS


def test_cases(write: Write, tmp_path: Path, small: xr.Dataset) -> None:
    rows = [(40, 2, 0.05), (60, 5, 0.02)]
    text = "mu, b,n0\n" + "".join(f"{mu:.0e},{b},{n0}\n" for mu, b, n0 in rows) + "\n"
    (tmp_path / "cells.csv").write_text(text, encoding="utf-8")
    dataset = sweep.run(
        write("cases: cells.csv\nintegrator: {method: dopri5, t_end: 1500}\n", "table.yaml"), tmp_path / "out"
    )
    assert dict(dataset.sizes) == {"case": 2, "sign": 2}
    for i, (mu, b, n0) in enumerate(rows):
        one, other = dataset.isel(case=i), small.sel(mu=mu, b=b, n0=n0)
        for name in small.data_vars:
            np.testing.assert_array_equal(one[name], other[name])
    same_numbers(xr.load_dataset(tmp_path / "out" / "table.nc"), dataset)


def test_python_writes_nothing_by_itself(write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    file = write()
    sweep.run(file, mu=40.0, b=2.0)
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.usefixtures("short_chunks")
def test_resumes_and_recomputes_nothing(write: Write, tmp_path: Path, small: xr.Dataset, counted: list[float]) -> None:
    out, began = tmp_path / "out", time.perf_counter()
    sweep.run(write())
    needed = sum(counted)
    counted.clear()
    dataset, interruptions, last = in_sittings(5, write(), out)
    assert interruptions > 2
    assert last.notes[0].startswith("resuming an earlier run: ")
    assert sum(counted) == needed
    assert 0 < dataset.attrs["wall_time"] < time.perf_counter() - began
    same_numbers(dataset, small)
    assert {path.name for path in out.iterdir()} == {"small.nc", "small.png"}


def test_chunks_are_kept_short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C waits for a chunk: it takes as long wherever a block takes less, by a clock of the test's own."""
    clock = 0.0
    chunks: list[float] = []
    ours = kernel()
    table = started(ours, 0.02, 5_000.0, mu=np.linspace(40, 60, 8))

    def advance(*arguments: Any) -> None:
        nonlocal clock
        Kernel.advance(ours, *arguments)
        chunks.append(0.01 * arguments[2])
        clock += chunks[-1]

    monkeypatch.setattr(ours, "advance", advance)
    monkeypatch.setattr(executor.time, "perf_counter", lambda: clock)
    executor.execute(ours, table)
    assert len(chunks) > 20
    assert max(chunks) <= 1.01 * LIMITS.chunk_seconds
    assert np.median(chunks) > 0.9 * LIMITS.chunk_seconds


def test_the_images_of_a_batch_go_with_it(monkeypatch: pytest.MonkeyPatch, write: Write) -> None:
    """Not when Python looks for cycles: the state rows of several batches take hundreds of MiB."""
    made: list[weakref.ref[Lives]] = []

    class Watched(Lives):
        def __init__(self, *given: Any) -> None:
            super().__init__(*given)
            made.append(weakref.ref(self))

    monkeypatch.setattr(local, "Lives", Watched)
    gc.disable()
    try:
        sweep.run(write(), t_end=20)
        assert [reference() for reference in made] == [None]
    finally:
        gc.enable()


MIXED = """\
friction: {mu: [1.0, 60, 1000]}
start: {n0: [0.02, 0.3]}
integrator: {method: auto, t_end: 60}
"""


def test_the_cheapest_method_depends_on_friction_and_time() -> None:
    slip = MODELS["slip"]
    by_mu, *_ = methods.cheapest(slip, columns(mu=[1.0, 60.0, 1e3, 1e5]), 1e-6, 400.0)
    assert list(by_mu[1:]) == ["adams"] * 3
    assert methods.cheapest(slip, columns(), 1e-6, 1.0)[0] == "dopri5"
    only, *_ = methods.cheapest(MODELS["averaged"], columns(), 1e-6, 400.0)
    assert only == "dopri5"


def test_auto_runs_each_cell_with_its_cheapest_method(write: Write) -> None:
    mixed = sweep.run(write(MIXED))
    codes = mixed["method"].attrs["flag_values"]
    assert dict(zip(mixed["method"].attrs["flag_meanings"].split(), codes, strict=True)) == {
        name: method.code for name, method in methods.METHODS.items()
    }
    names = np.vectorize({method.code: name for name, method in methods.METHODS.items()}.get)(mixed["method"].values)
    chosen = methods.automatic(MODELS["slip"])
    assert set(names.ravel()) == {*chosen}
    for method in chosen:
        alone = sweep.run(write(MIXED), method=method)
        assert "method" not in alone
        for name in ("spin_final", "reversals", "status", "step", "energy_error", "t_stop"):
            np.testing.assert_array_equal(mixed[name].values[names == method], alone[name].values[names == method])


@pytest.mark.usefixtures("short_chunks")
def test_a_run_of_both_methods_resumes_from_a_checkpoint(write: Write, tmp_path: Path) -> None:
    file = write(MIXED.replace("60}\n", "120}\n") + "name: mixed\n")
    found, interruptions, _ = in_sittings(3, file, tmp_path / "out")
    assert interruptions >= 2
    same_numbers(found, sweep.run(file))


MAP = {
    "name": "lives",
    "body": {"a": 10.0, "b": {"start": 2, "stop": 9, "num": 8}, "delta": 0.03},
    "friction": {"mu": {"start": 40, "stop": 80, "num": 8}},
    "start": {"n0": 0.05, "x0": 0.01, "y0": 0.01},
    "integrator": {"method": "adams"},
}


def test_progress_counts_the_work_of_cells_whose_second_runs_run_beside_first_runs_of_others(
    counted: list[float],
) -> None:
    """A bar that is at 60 % has 60 % of the steps behind it, once enough runs have ended to guess the others by."""
    (part,) = plan(load_config(MAP, {"tolerance": 1e-8})).parts
    each, shares, beside = Lives(part), list[tuple[float, float]](), list[bool]()

    def check() -> None:
        shares.append((sum(counted), life.progress([each])[0] / 64))
        beside.append(bool((each.stage == RUN).any() and (each.stage == SECOND).any()))

    with threads(1), limited(chunk_blocks=100):  # chunks that do not depend on the machine
        life.live([each], check)
    work, reported = np.array(shares).T
    work /= sum(counted)
    assert len(work) > 20
    assert reported[-1] == pytest.approx(1.0)
    assert np.abs(reported - work)[work > 0.5].max() < 0.1
    assert any(beside)
