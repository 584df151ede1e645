"""Whole runs: from a configuration to numbers, however they are cut into tiles, chunks and sittings."""

import gc
import weakref
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from support import Write
from support.kernels import images, kernel
from support.runs import Stop, in_sittings, same_numbers

import sweep
from sweep.engine import executor, life
from sweep.engine.lives import Lives
from sweep.kernels.kernel import Kernel


def test_cases(write: Write, tmp_path: Path, small: xr.Dataset) -> None:
    rows = [(40, 2, 0.05), (60, 5, 0.02)]
    text = "mu,b,n0\n" + "\n".join(",".join(map(str, row)) for row in rows)
    (tmp_path / "cells.csv").write_text(text, encoding="utf-8")
    dataset = sweep.run(
        write("cases: cells.csv\nintegrator: {method: dopri5, t_end: 1500}\n", "table.yaml"), tmp_path / "out"
    )
    assert dict(dataset.sizes) == {"case": 2}
    for i, (mu, b, n0) in enumerate(rows):
        one, other = dataset.isel(case=i), small.sel(mu=mu, b=b, n0=n0)
        for name in small.data_vars:
            np.testing.assert_array_equal(one[name], other[name])
    same_numbers(xr.load_dataset(tmp_path / "out" / "table.nc"), dataset)


def test_predict_gives_only_predictions(write: Write, small: xr.Dataset) -> None:
    predicted = sweep.predict(write())
    xr.testing.assert_identical(predicted["n_c2_minus"], small["n_c2_minus"])
    assert "reversals" not in predicted


def test_python_writes_nothing_by_itself(write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    file = write()
    sweep.run(file, mu=40.0, b=2.0)
    assert list(tmp_path.iterdir()) == [file]


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Steps that kernels take from now on, one number for each call."""
    steps, plain = list[float](), Kernel.advance

    def advance(kernel: Kernel, images: np.ndarray, *rest: Any) -> int:
        before = kernel.table(images)["done"].sum()
        blocks = plain(kernel, images, *rest)
        steps.append(kernel.table(images)["done"].sum() - before)
        return blocks

    monkeypatch.setattr(Kernel, "advance", advance)
    return steps


@pytest.mark.usefixtures("short_chunks")
def test_resumes_and_recomputes_nothing(write: Write, tmp_path: Path, small: xr.Dataset, counted: list[float]) -> None:
    out = tmp_path / "out"
    sweep.run(write())
    needed = sum(counted)
    counted.clear()
    dataset, interruptions, last = in_sittings(5, write(), out)
    assert interruptions > 2
    assert last.notes[0].startswith("resuming an earlier run: ")
    assert sum(counted) == needed
    same_numbers(dataset, small)
    assert {path.name for path in out.iterdir()} == {"small.nc", "small.png"}


@pytest.mark.parametrize("size", [1, 5])
def test_tiles_do_not_touch_the_numbers(
    write: Write, tmp_path: Path, small: xr.Dataset, size: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sweep.engine.whole.tile_size", lambda cells: size)  # noqa: ARG005
    monkeypatch.setattr("sweep.engine.local.BATCH", 2)
    same_numbers(sweep.run(write()), small)
    with pytest.raises(KeyboardInterrupt):
        sweep.run(write(), tmp_path / "out", reporter=Stop(3))
    same_numbers(sweep.run(write(), tmp_path / "out"), small)


def test_chunks_are_kept_short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C waits for a chunk: it takes `CHUNK_SECONDS` wherever a block takes less, by a clock of the test's own."""
    clock = 0.0
    chunks: list[float] = []
    ours = kernel()
    table = images(ours, 0.02, 5_000.0, mu=np.linspace(40, 60, 8))

    def advance(*arguments: Any) -> None:
        nonlocal clock
        Kernel.advance(ours, *arguments)
        chunks.append(0.01 * arguments[2])
        clock += chunks[-1]

    monkeypatch.setattr(ours, "advance", advance)
    monkeypatch.setattr(executor.time, "perf_counter", lambda: clock)
    executor.execute(ours, table)
    assert len(chunks) > 20
    assert max(chunks) <= 1.01 * executor.CHUNK_SECONDS
    assert np.median(chunks) > 0.9 * executor.CHUNK_SECONDS


def test_the_images_of_a_batch_go_with_it(monkeypatch: pytest.MonkeyPatch, write: Write) -> None:
    """Not when Python looks for cycles: the images of several batches take hundreds of MiB."""
    made: list[weakref.ref[Lives]] = []

    class Watched(Lives):
        def __init__(self, *given: Any) -> None:
            super().__init__(*given)
            made.append(weakref.ref(self))

    monkeypatch.setattr(life, "Lives", Watched)
    gc.disable()
    try:
        sweep.run(write(), t_end=20)
        assert [reference() for reference in made] == [None]
    finally:
        gc.enable()
