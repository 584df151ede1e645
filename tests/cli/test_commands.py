"""The commands run, info and plot: what they write, say and return."""

import os
import subprocess
import sys
from pathlib import Path
from unittest.mock import Mock

import pytest
import xarray as xr
from support import Write
from support.cli import invoke, refused
from support.runs import same_numbers

import sweep
from sweep.jit import Cached


def test_command_writes_dataset_and_maps(write: Write, tmp_path: Path, small: xr.Dataset) -> None:
    result = invoke("run", write(), "--output", tmp_path / "out")
    assert (result.exit_code, "resuming" in result.stderr) == (0, False)
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"small.nc", "small.png"}
    printed = invoke("info", tmp_path / "out" / "small.nc").stdout
    assert "12 cells (mu 2 × b 3 × n0 2)" in result.stdout
    assert "12 cells (mu 2 × b 3 × n0 2)" in printed
    assert len(printed.splitlines()) <= 24
    assert "numba_version" in invoke("info", "--all", tmp_path / "out" / "small.nc").stdout
    with xr.open_dataset(tmp_path / "out" / "small.nc") as stored:
        same_numbers(stored.load(), small)
        assert all("_FillValue" not in v.encoding for v in stored.variables.values() if v.dtype.kind == "i")


NO_DATASETS = {
    "x.nc": "not a netCDF", "none.nc": "no such file", "other.nc": "not a dataset of sweep", "fifo": "not a file",
    "folder": "not a file",
}  # fmt: skip


@pytest.mark.parametrize("verb", ["info", "plot"])
def test_files_that_are_not_datasets(verb: str, tmp_path: Path) -> None:
    (tmp_path / "x.nc").write_text("hello", encoding="utf-8")
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "fifo")
    xr.Dataset({"t": 1.0}).to_netcdf(tmp_path / "other.nc")
    for name, said in NO_DATASETS.items():
        refused(invoke(verb, tmp_path / name), f"{name}: ", said)


DRY_RUNS = {
    "run": ["cells:  12 (mu 2 × b 3 × n0 2)", "steps", "memory", "time"],
    "run --set method=auto --set mu=[1,1000]": ["cells:  12", "steps", "memory", "time"],
    "critical": ["bodies: 6 (mu 2 × b 3)", "cells", "steps", "memory", "time", "then"],
    "boundaries": ["cells:  12", "steps", "memory", "time", "then:   about 8 simulations for each point"],
    "trajectory --at mu=40 --at mu=60": ["trajectories: 12", "steps", "samples", "time"],
}
"""Commands, and how each of the lines that they say begins."""


@pytest.mark.parametrize(("command", "words"), DRY_RUNS.items())
def test_a_dry_run_compiles_computes_and_writes_nothing(
    command: str, words: list[str], write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("jit.Cached.__call__", "jit.Cached.compile", "kernels.build._start", "kernels.kernel.Kernel.advance"):
        monkeypatch.setattr(f"sweep.{name}", Mock(side_effect=AssertionError("compiled or computed")))
    verb, *options = command.split()
    result = invoke(verb, write(), *options, "--output", tmp_path / "out", "--dry-run")
    assert result.exit_code == 0, result.output
    lines = result.stdout.splitlines()
    assert [line[: len(word)] for line, word in zip(lines, words, strict=True)] == words
    assert not (tmp_path / "out").exists()


RESUMED = "interrupted: no cells finished and kept; the same command without --fresh resumes the run\n"


@pytest.mark.parametrize(
    ("command", "during", "said"),
    [
        ("run --fresh", "sweep.results.folder.RunFiles.locked", RESUMED),
        ("critical", "sweep.config.load_config", "interrupted\n"),
    ],
)
def test_an_interrupt_is_one_line(
    command: str, during: str, said: str, write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(during, Mock(side_effect=KeyboardInterrupt))
    result = invoke(*command.split(), write(), "--output", tmp_path)
    assert (result.exit_code, result.stderr) == (130, said)


def test_too_many_failures(write: Write, tmp_path: Path) -> None:
    settings = ("--set", "n0=[0.05, 3.0]", "--set", "x0=1", "--set", "mu=20", "--set", "b=3", "--set", "t_end=5")
    result = invoke("run", write(), "--output", tmp_path / "out", *settings)
    assert result.exit_code == 3
    assert "50.00% of the cells failed; max_failed_fraction allows 1.00%" in result.stderr
    assert (tmp_path / "out" / "small.nc").exists()
    allowed = invoke("run", write(), "--output", tmp_path / "b", *settings, "--set", "max_failed_fraction=0.5")
    assert allowed.exit_code == 0


@pytest.fixture
def _cold(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if no cache held anything; what is compiled takes no time."""
    monkeypatch.setattr(Cached, "is_missing", lambda _: True)
    monkeypatch.setattr("sweep.kernels.build._start", lambda *_: subprocess.Popen([sys.executable, "-c", ""]))


@pytest.mark.usefixtures("_cold")
@pytest.mark.parametrize(
    ("command", "lines"),
    [(["run"], 1), (["run", "--quiet"], 0), (["run", "--dry-run"], 0), (["trajectory"], 1), (["critical"], 1)],
    ids=["run", "quiet", "dry-run", "trajectory", "critical"],
)
def test_a_command_says_once_that_it_compiles(command: list[str], lines: int, write: Write, tmp_path: Path) -> None:
    text = "name: one\nmodel: averaged\nfriction: {mu: 60}\nintegrator: {t_end: 5}\n"
    result = invoke(*command, write(text), "--output", tmp_path / "out")
    assert result.exit_code == 0
    assert result.stderr.count("compiling for this model and machine") == lines


@pytest.mark.usefixtures("_cold")
def test_python_compiles_without_a_word(write: Write, capfd: pytest.CaptureFixture[str]) -> None:
    sweep.run(write("model: averaged\nfriction: {mu: 60}\nintegrator: {t_end: 5}\n"))
    assert tuple(capfd.readouterr()) == ("", "")
