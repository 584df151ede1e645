"""Whole runs: dataset, files, resuming, refusing, interrupting."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner, Result
from conftest import ROOT, SMALL

import sweep
from sweep.cli import main
from sweep.engine import executor
from sweep.engine.plan import plan
from sweep.engine.run import Progress, Reporter
from sweep.plots import maps as plots
from sweep.results.dataset import STATUSES, VARIABLES
from sweep.results.store import RunFiles, StoreError, open_dataset, replacing

Write = Callable[..., Path]


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> xr.Dataset:
    path = tmp_path_factory.mktemp("small") / "small.yaml"
    path.write_text(SMALL, encoding="utf-8")
    return sweep.run(path)


def invoke(*arguments: str | Path) -> Result:
    return CliRunner().invoke(main, list(map(str, arguments)), catch_exceptions=False)


def same_numbers(one: xr.Dataset, other: xr.Dataset) -> None:
    xr.testing.assert_identical(one.drop_attrs(deep=False), other.drop_attrs(deep=False))


def test_dataset_is_labelled(small: xr.Dataset) -> None:
    assert dict(small.sizes) == {"mu": 2, "b": 3, "n0": 2}
    assert small["reversals"].dims == ("mu", "b", "n0")
    assert small["n_c1_plus"].dims == small["form_factor"].dims == ("mu", "b")
    assert set(small.coords) == {"mu", "b", "n0", "a", "c", "delta", "x0", "y0"}
    for name, variable in small.variables.items():
        assert {"long_name", "units"} <= set(variable.attrs), name
    assert small["delta"].attrs["units"] == "radian"
    assert set(small.data_vars) == {n for n in VARIABLES if "simulated" not in n} - {
        "critical_reason",
        "method",
        "t_first_reversal",
        "inferred",
    }
    assert {name: str(small[name].dtype) for name in ("reversals", "status", "spin_final", "reversals_predicted")} == {
        "reversals": "int16", "status": "int8", "spin_final": "float64", "reversals_predicted": "int16",
    }  # fmt: skip
    flags = dict(zip(small["status"].attrs["flag_values"], small["status"].attrs["flag_meanings"].split(), strict=True))
    assert flags == STATUSES
    assert flags == {0: "not_run", 1: "settled", 2: "time_limit", 3: "lift_off", 4: "diverged", 5: "paradox"}


def test_dataset_values_belong_to_their_labels(small: xr.Dataset, write: Write) -> None:
    for mu, b, n0 in ((40.0, 2.0, 0.05), (60.0, 5.0, 0.02), (60.0, 3.0, 0.05)):
        alone = sweep.run(write(), mu=mu, b=b, n0=n0)
        same_numbers(small.sel(mu=mu, b=b, n0=n0), alone)


def test_provenance(small: xr.Dataset) -> None:
    attributes = small.attrs
    assert attributes["Conventions"] == "CF-1.11"
    assert "t_end: 1500" in attributes["config"]
    assert len(attributes["config_hash"]) == len(attributes["source_hash"]) == 16
    assert attributes["git_commit"] != "unknown" or not (ROOT / ".git").exists()
    assert attributes["trajectories_per_second"] == pytest.approx(12 / attributes["wall_time"])
    assert {"numba_version", "numpy_version", "xarray_version", "sweep_version", "integrator", "cpu"} <= set(attributes)


def test_only_what_is_named_is_measured(write: Write, small: xr.Dataset) -> None:
    nothing = sweep.run(write(), measure=[])
    assert not {"reversals", "t_last_reversal", "spin_mean", "energy_error"} & set(nothing.data_vars)
    reversals = sweep.run(write(), measure=["reversals"])
    assert "energy_error" not in reversals
    xr.testing.assert_equal(reversals["reversals"], small["reversals"])


def test_no_reversal_has_no_time(small: xr.Dataset) -> None:
    without = small["reversals"] == 0
    assert (np.isnan(small["t_last_reversal"]) == without).all()
    assert (small["t_last_reversal"] < small["t_stop"]).where(~without, True).all()
    assert float(small["t_stop"].max()) <= 1500


def test_cases(write: Write, tmp_path: Path, small: xr.Dataset) -> None:
    rows = [(40, 2, 0.05), (60, 5, 0.02)]
    text = "mu,b,n0\n" + "\n".join(",".join(map(str, row)) for row in rows)
    (tmp_path / "cells.csv").write_text(text, encoding="utf-8")
    dataset = sweep.run(write("cases: cells.csv\nintegrator: {t_end: 1500}\n", "table.yaml"), tmp_path / "out")
    assert dict(dataset.sizes) == {"case": 2}
    for i, (mu, b, n0) in enumerate(rows):
        one, other = dataset.isel(case=i), small.sel(mu=mu, b=b, n0=n0)
        for name in small.data_vars:
            np.testing.assert_array_equal(one[name], other[name])
    same_numbers(xr.load_dataset(tmp_path / "out" / "table.nc"), dataset)


def test_predict_alone(write: Write, small: xr.Dataset) -> None:
    predicted = sweep.predict(write())
    xr.testing.assert_identical(predicted["n_c2_minus"], small["n_c2_minus"])
    assert "reversals" not in predicted


def test_command_writes_dataset_and_maps(write: Write, tmp_path: Path, small: xr.Dataset) -> None:
    result = invoke("run", write(), "--output", tmp_path / "out")
    assert result.exit_code == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"small.nc", "small.png"}
    assert "12 cells (mu 2 × b 3 × n0 2)" in result.stdout
    with xr.open_dataset(tmp_path / "out" / "small.nc") as stored:
        same_numbers(stored.load(), small)
        assert all("_FillValue" not in v.encoding for v in stored.variables.values() if v.dtype.kind == "i")
    again = invoke("run", write(), "--output", tmp_path / "out")
    assert "already complete" in again.stderr
    assert again.exit_code == 0


def test_a_missing_picture_is_drawn_again(write: Write, tmp_path: Path) -> None:
    sweep.run(write(), tmp_path / "out", mu=40.0)
    (tmp_path / "out" / "small.png").unlink()
    sweep.run(write(), tmp_path / "out", mu=40.0)
    assert (tmp_path / "out" / "small.png").exists()


def test_too_many_panels_for_a_picture_are_no_failure(write: Write, tmp_path: Path) -> None:
    many = ("b=[2,2.1,2.2,2.3,2.4]", "mu=[40,41,42,43,44]", "n0=[0.01,0.02,0.03]", "delta=[0.01,0.02,0.03]", "t_end=5")
    settings = [part for setting in many for part in ("--set", setting)]
    result = invoke("run", write(), "--output", tmp_path / "out", *settings)
    assert result.exit_code == 0
    assert "no picture: 9 panels" in result.stderr
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["small.nc"]


def test_python_writes_nothing_by_itself(write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    file = write()
    sweep.run(file, mu=40.0, b=2.0)
    assert list(tmp_path.iterdir()) == [file]


class Stop(Reporter):
    """Interrupts after some chunks."""

    def __init__(self, chunks: int) -> None:
        self.left, self.notes = chunks, list[str]()

    def chunk(self, progress: Progress) -> None:  # noqa: ARG002
        self.left -= 1
        if self.left < 0:
            raise KeyboardInterrupt

    def note(self, message: str) -> None:
        self.notes.append(message)


@pytest.fixture
def short_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(executor, "CHUNK_SECONDS", 0.01)


@pytest.mark.usefixtures("short_chunks")
def test_resumes_and_recomputes_nothing(write: Write, tmp_path: Path, small: xr.Dataset) -> None:
    out, interruptions, steps = tmp_path / "out", 0, [0.0]
    while True:
        try:
            dataset = sweep.run(write(), out, reporter=Stop(2))
            break
        except KeyboardInterrupt:
            interruptions += 1
            assert [path.name for path in out.iterdir()] == ["small.checkpoint"]
            with np.load(out / "small.checkpoint" / "running.npz") as archive:
                (part,) = plan(sweep.load_config(write())).parts
                steps.append(archive["dopri5"][:, part.kernel.row("done")].sum())
    assert interruptions > 2
    assert steps == sorted(set(steps))
    same_numbers(dataset, small)
    assert {path.name for path in out.iterdir()} == {"small.nc", "small.png"}


@pytest.fixture
def interrupted(write: Write, tmp_path: Path) -> Path:
    with pytest.raises(KeyboardInterrupt):
        sweep.run(write(), tmp_path / "out", reporter=Stop(1))
    return tmp_path / "out"


def test_refuses_another_configuration(write: Write, interrupted: Path) -> None:
    result = invoke("run", write(), "--output", interrupted, "--set", "delta=0.04")
    assert result.exit_code == 2
    assert "another configuration" in result.stderr
    assert "+ delta: 0.04" in result.stderr.replace("{", "").replace("}", "")
    assert invoke("run", write(), "--output", interrupted).exit_code == 0
    result = invoke("run", write(), "--output", interrupted, "--set", "delta=0.04")
    assert (result.exit_code, "small.nc: not resumed" in result.stderr) == (2, True)
    assert invoke("run", write(), "--output", interrupted, "--set", "delta=0.04", "--fresh").exit_code == 0


def test_refuses_other_sources(write: Write, interrupted: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.modules["sweep.results.provenance"], "fingerprint", lambda *_: "0" * 16)
    with pytest.raises(StoreError, match="other sources"):
        sweep.run(write(), interrupted)


def spoil(file: Path, how: str) -> None:
    whole = file.read_bytes()
    half = len(whole) // 2
    damaged = {"cut": whole[:half], "empty": b"", "flipped": whole[:half] + bytes(b ^ 255 for b in whole[half:])}[how]
    assert damaged != whole
    file.write_bytes(damaged)


@pytest.mark.parametrize("how", ["cut", "empty", "flipped"])
def test_a_damaged_checkpoint_is_computed_again(write: Write, interrupted: Path, small: xr.Dataset, how: str) -> None:
    spoil(interrupted / "small.checkpoint" / "running.npz", how)
    result = invoke("run", write(), "--output", interrupted)
    assert (result.exit_code, "running.npz: damaged" in result.stderr) == (0, True)
    same_numbers(open_dataset(interrupted / "small.nc"), small)


@pytest.mark.parametrize("how", ["cut", "empty", "flipped"])
def test_a_damaged_tile_is_computed_again(
    write: Write, tmp_path: Path, small: xr.Dataset, how: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(RunFiles, "save_tiles", _interrupt)
    with pytest.raises(KeyboardInterrupt):
        sweep.run(write(), tmp_path / "out")
    monkeypatch.undo()
    spoil(tmp_path / "out" / "small.checkpoint" / "000000.npz", how)
    result = invoke("run", write(), "--output", tmp_path / "out")
    assert (result.exit_code, "000000.npz: damaged" in result.stderr) == (0, True)
    same_numbers(open_dataset(tmp_path / "out" / "small.nc"), small)


def _interrupt(*_: object) -> None:
    raise KeyboardInterrupt


def test_a_damaged_identity_is_refused(write: Write, interrupted: Path) -> None:
    spoil(interrupted / "small.checkpoint" / "identity.json", "cut")
    result = invoke("run", write(), "--output", interrupted)
    assert (result.exit_code, "identity.json: damaged" in result.stderr) == (2, True)
    assert invoke("run", write(), "--output", interrupted, "--fresh").exit_code == 0


@pytest.mark.parametrize("size", [1, 5, 7])
def test_tiles_do_not_touch_the_numbers(
    write: Write, tmp_path: Path, small: xr.Dataset, size: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.modules["sweep.engine.run"], "tile_size", lambda cells: size)  # noqa: ARG005
    monkeypatch.setattr(sys.modules["sweep.engine.local"], "GROUP", 2)
    same_numbers(sweep.run(write()), small)
    with pytest.raises(KeyboardInterrupt):
        sweep.run(write(), tmp_path / "out", reporter=Stop(3))
    same_numbers(sweep.run(write(), tmp_path / "out"), small)
    checked = sweep.run(write(SMALL + "verify: 0.5\n"))
    monkeypatch.undo()
    xr.testing.assert_equal(checked, sweep.run(write(SMALL + "verify: 0.5\n")))


def test_two_runs_at_once(write: Write, tmp_path: Path) -> None:
    files = RunFiles(tmp_path / "out", "small")
    with files.locked():
        result = invoke("run", write(), "--output", tmp_path / "out")
        assert (result.exit_code, "another run is at work there" in result.stderr) == (2, True)
        assert invoke("run", write(), "--output", tmp_path / "out", "--set", "name=other").exit_code == 0
    assert invoke("run", write(), "--output", tmp_path / "out").exit_code == 0
    assert not list((tmp_path / "out").glob(".*"))


def test_another_name_is_another_run(write: Write, interrupted: Path) -> None:
    sweep.run(write(), interrupted, name="second", mu=40.0, b=2.0)
    assert {path.name for path in interrupted.iterdir()} == {"small.checkpoint", "second.nc", "second.png"}


def test_too_many_failures(write: Write, tmp_path: Path) -> None:
    settings = ("--set", "n0=[0.05, 3.0]", "--set", "x0=1", "--set", "mu=20", "--set", "b=3", "--set", "t_end=5")
    result = invoke("run", write(), "--output", tmp_path / "out", *settings)
    assert result.exit_code == 3
    assert "50.00% of the cells failed; allowed: max_failed_fraction 1.00%" in result.stderr
    assert (tmp_path / "out" / "small.nc").exists()
    assert (
        invoke("run", write(), "--output", tmp_path / "b", *settings, "--set", "max_failed_fraction=0.5").exit_code == 0
    )


def test_dry_run_computes_and_writes_nothing(write: Write, tmp_path: Path) -> None:
    result = invoke("run", write(), "--output", tmp_path / "out", "--dry-run")
    assert result.exit_code == 0
    assert [line.split(":")[0] for line in result.stdout.splitlines()] == ["cells", "steps", "memory", "time"]
    assert not (tmp_path / "out").exists()


def test_interrupt_stops_within_two_seconds_and_the_same_command_goes_on(write: Write, tmp_path: Path) -> None:
    long = (
        SMALL.replace("1500", "30000").replace("0.03}", "0.03}").replace("[40, 60]", "{start: 150, stop: 200, num: 40}")
    )
    file, out = write(long), tmp_path / "out"
    command = [sys.executable, "-m", "sweep", "run", str(file), "--output", str(out)]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, cwd=ROOT)
    deadline = time.monotonic() + 120
    while not (out / "small.checkpoint" / "running.npz").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    began = time.monotonic()
    _, messages = process.communicate(timeout=60)
    assert process.returncode == 130
    assert time.monotonic() - began < 2 + 8 * (os.getloadavg()[0] > 3)
    assert "the same command goes on" in messages
    assert [path.name for path in out.iterdir()] == ["small.checkpoint"]
    with np.load(out / "small.checkpoint" / "running.npz") as archive:
        assert archive["dopri5"].shape[0] == 240
    with pytest.raises(KeyboardInterrupt):
        sweep.run(file, out, reporter=(reporter := Stop(0)))
    assert "0 of 1 tiles are there from an earlier run: going on" in reporter.notes[0]


def test_info_and_plot(write: Write, tmp_path: Path) -> None:
    out = tmp_path / "out"
    sweep.run(write(), out)
    told = invoke("info", out / "small.nc").stdout
    assert "12 cells (mu 2 × b 3 × n0 2)" in told
    assert "numba_version" in told
    (out / "small.png").unlink()
    assert invoke("plot", out / "small.nc").exit_code == 0
    assert invoke("plot", out / "small.nc", "--var", "status", "--output", out / "s.png").exit_code == 0
    assert all((out / name).read_bytes().startswith(b"\x89PNG") for name in ("small.png", "s.png"))
    result = invoke("plot", out / "small.nc", "--var", "colour")
    assert (result.exit_code, "no variable colour; allowed: reversals," in result.stderr) == (2, True)


@pytest.mark.parametrize("verb", ["info", "plot"])
def test_files_that_are_no_datasets(verb: str, tmp_path: Path) -> None:
    (tmp_path / "x.nc").write_text("hello", encoding="utf-8")
    xr.Dataset({"t": 1.0}).to_netcdf(tmp_path / "other.nc")
    for name, said in (("x.nc", "not a netCDF"), ("none.nc", "no such file"), ("other.nc", "no variable")):
        result = invoke(verb, tmp_path / name)
        assert result.exit_code == 2
        assert f"{name}: " in result.stderr
        assert said in result.stderr


def test_cells_without_a_result_are_no_zeros(small: xr.Dataset) -> None:
    failed = small.isel(n0=0).copy(deep=True)
    failed["status"][:] = 4
    stretched = failed.interp(b=np.linspace(2, 5, 6), mu=np.linspace(40, 60, 5), method="nearest")
    stretched = stretched.astype({name: failed[name].dtype for name in failed.data_vars})
    for name in stretched.data_vars:
        stretched[name].attrs = failed[name].attrs
    figure = plots.draw(stretched)
    mesh = figure.axes[0].collections[0]
    assert mesh.get_array().mask.all()
    assert not figure.axes[1].collections[0].get_array().mask.any()  # the prediction is there all the same


@pytest.mark.parametrize("selection", [{"mu": 0}, {"mu": 0, "n0": 0}, {"mu": 0, "b": 0, "n0": 0}])
def test_draws_any_number_of_axes(small: xr.Dataset, selection: dict[str, int]) -> None:
    assert plots.draw(small.isel(selection)).axes


def test_damaged_final_file_is_refused(write: Write, tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "small.nc").write_bytes(b"not a dataset")
    result = invoke("run", write(), "--output", out)
    assert (result.exit_code, "not a netCDF dataset" in result.stderr) == (2, True)


def test_no_temporary_file_survives_a_failure(tmp_path: Path) -> None:
    def fill_the_disk() -> None:
        with replacing(tmp_path / "x.nc") as temporary:
            temporary.write_text("half")
            raise OSError("full")

    with pytest.raises(StoreError, match="cannot be written: full"):
        fill_the_disk()
    assert list(tmp_path.iterdir()) == []


def test_open_dataset_is_in_memory(write: Write, tmp_path: Path) -> None:
    sweep.run(write(), tmp_path / "out", mu=40.0, b=2.0)
    dataset = open_dataset(tmp_path / "out" / "small.nc")
    (tmp_path / "out" / "small.nc").unlink()
    assert int(dataset["reversals"].sum()) >= 0


def test_help_tells_every_verb_and_exit_code() -> None:
    text = invoke("--help").stdout
    assert all(word in text for word in ("run", "plot", "info", "130", "interrupted"))
    assert "PATH=VALUE" in invoke("run", "--help").stdout
