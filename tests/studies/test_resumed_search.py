"""Real processes of `sweep critical` and `sweep trajectory` that are killed or interrupted.

Whatever happens, the same command goes on and finds the very same spins.
"""

import os
import re
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import xarray as xr
from support import Write
from support.cli import invoke
from support.nursery import Runs
from support.runs import Heard, same_numbers

import sweep

TEXT = """\
name: standard
body: {a: 10.0, b: [3.0, 5.0], delta: 0.03}
friction: {mu: [60, 75, 100]}
integrator: {t_end: 12000}
"""


@pytest.fixture(scope="module")
def config(kept: Write) -> Path:
    return kept(TEXT, "standard.yaml")


@pytest.fixture(scope="module")
def undisturbed(config: Path) -> xr.Dataset:
    return sweep.critical(config)


@pytest.fixture
def runs(config: Path, tmp_path: Path) -> Iterator[Runs]:
    with Runs("critical", config, tmp_path / "out") as runs:
        yield runs


def rounds(folder: Path) -> int:
    return len([path for path in folder.glob("*.npz") if path.name != "running.npz"])


@pytest.mark.parametrize(
    "with_signal",
    [signal.SIGINT, pytest.param(signal.SIGKILL, marks=pytest.mark.campaign)],
    ids=["interrupted", "killed"],
)
@pytest.mark.parametrize(
    "wanted", [range(1, 6, 2), pytest.param(range(12), marks=pytest.mark.campaign)], ids=["some", "many"]
)
def test_a_stopped_search_continues(runs: Runs, undisturbed: xr.Dataset, wanted: range, with_signal: int) -> None:
    """Stopped within round after round, also between two saved states of the same one."""
    checkpoint = runs.out / "standard_critical.checkpoint"
    stops = 0
    for done in wanted:
        running, before = checkpoint / "running.npz", os.stat(checkpoint).st_mtime_ns if checkpoint.exists() else 0

        def within(done: int = done, before: int = before, running: Path = running) -> bool:
            saved = running.exists() and running.stat().st_mtime_ns > before
            return rounds(checkpoint) > done or (rounds(checkpoint) == done and saved)

        process = runs.strike(within, with_signal)
        if process is None:
            break  # it has finished
        stops += 1
        assert process.exitcode == (130 if with_signal == signal.SIGINT else -signal.SIGKILL)
        if with_signal == signal.SIGINT:
            (said,) = [line for line in process.log.read_text().splitlines() if "interrupted" in line]
            kept = "finished and kept; the same command resumes the search"
            assert re.fullmatch(rf"interrupted: (no|\d+ of \d+) cells {kept}", said)
            assert "Traceback" not in process.log.read_text()
    assert stops >= 2
    checkpoint_left = checkpoint.exists()
    code, said = runs.finish()
    assert code == 0, said
    assert ("resuming an earlier run: " if checkpoint_left else "already complete, nothing to compute") in said
    same_numbers(xr.load_dataset(runs.out / "standard_critical.nc"), undisturbed)
    assert {path.name for path in runs.out.iterdir()} == {"standard_critical.nc", "standard_critical.png"}


def test_a_finished_search_is_complete_and_another_is_refused(config: Path, tmp_path: Path) -> None:
    command = ["critical", config, "--set", "mu=60", "--set", "b=3", "--set", "model=averaged", "--output", tmp_path]
    assert invoke(*command).exit_code == 0
    assert "already complete, nothing to compute" in invoke(*command).stderr
    wider = invoke(*command, "--bracket", "0.01")
    assert wider.exit_code == 2
    assert "- # width of the brackets: 0.001" in wider.stderr
    assert invoke(*command, "--bracket", "0.01", "--fresh").exit_code == 0
    assert xr.load_dataset(tmp_path / "standard_critical.nc").relative_width == 0.01
    assert invoke(*command, "--set", "n0=0.3", "--bracket", "0.01").exit_code == 0  # no critical spin depends on it


def test_progress_is_reported(config: Path) -> None:
    following = Heard()
    sweep.trajectory(config, at={"mu": [60, 75], "b": 3}, t_end=3000, progress=following)
    done = [progress.done for progress in following.seen]
    assert done == sorted(done)
    assert done[0] < 0.2 * 6000 < done[-1] == 6000 == following.seen[-1].cells
    assert len(set(done)) > 5


def test_an_interrupted_trajectory_says_so(runs: Runs) -> None:
    runs.verb, seen = "trajectory", list[float]()

    def at_work() -> bool:
        """Half a second after the command has its output, however long it took to come so far."""
        if runs.started[0].log.exists():
            seen.append(time.monotonic())
        return bool(seen) and seen[-1] > seen[0] + 0.5

    endless = ("--at", "mu=100", "--set", "t_end=1e6", "--set", "stop_early=false")
    process = runs.strike(at_work, signal.SIGINT, *endless)
    assert process.exitcode == 130
    assert process.log.read_text().splitlines()[-1] == "interrupted"
    assert not runs.out.exists()
