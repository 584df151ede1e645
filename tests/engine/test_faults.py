"""Real processes that are killed, interrupted, run twice at once, or find no room or no rights.

Whatever happens, the same command goes on and ends in the files of an undisturbed run, byte for byte.  Damage to
files that a run left is in `test_damage`.
"""

import json
import os
import random
import shutil
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from support import ROOT, SMALL, Write
from support.cli import one_line
from support.nursery import Runs
from support.physics import TURNS, stone
from support.runs import same_numbers
from support.same import contents, without_clock

TEXT = SMALL


@pytest.fixture(scope="module")
def config(kept: Write) -> Path:
    return kept(TEXT)


@pytest.fixture
def runs(config: Path, tmp_path: Path) -> Iterator[Runs]:
    with Runs("run", config, tmp_path / "out") as runs:
        yield runs


@pytest.fixture(scope="module")
def first(config: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run that nothing happened to."""
    out = tmp_path_factory.mktemp("undisturbed") / "out"
    Runs("run", config, out).complete()
    return out


@pytest.fixture(scope="module")
def undisturbed(first: Path) -> dict[str, bytes]:
    return contents(first)


@pytest.fixture(scope="module")
def values(first: Path) -> xr.Dataset:
    """Its numbers, bit for bit in a file that is cut otherwise, for its tiles are of another size."""
    return xr.load_dataset(first / "small.nc")


class Watch:
    """Looks at the files of a run while they come and go: one with its final name is complete."""

    def __init__(self, folder: Path, undisturbed: dict[str, bytes]) -> None:
        self.folder, self.undisturbed, self.seen = folder, undisturbed, set[tuple[int, int]]()
        self.names: set[str] = set()

    def look(self) -> None:
        files = [*_listed(self.folder), *_listed(self.folder / "small.checkpoint")]
        self.names = {path.name for path in files}
        for path in files:
            try:
                stat = path.stat()
                if path.name.startswith(".") or path.is_dir() or (stat.st_ino, stat.st_mtime_ns) in self.seen:
                    continue
                self._open(path)
            except FileNotFoundError:
                continue  # replaced or removed just now
            self.seen.add((stat.st_ino, stat.st_mtime_ns))

    def _open(self, path: Path) -> None:
        if path.suffix == ".nc":
            assert without_clock(path) == self.undisturbed[path.name]
        elif path.suffix == ".png":
            assert path.read_bytes() == self.undisturbed[path.name]
        elif path.suffix == ".npz":
            with np.load(path, allow_pickle=False) as archive:
                assert archive.zip.testzip() is None
        else:
            assert json.loads(path.read_bytes()), path


def _listed(folder: Path) -> list[Path]:
    try:
        return [folder / name for name in os.listdir(folder)]
    except FileNotFoundError:
        return []


def moments(watch: Watch) -> dict[str, Callable[[], bool]]:
    """When to strike, recognised by the names of the files."""

    def rows() -> int:
        try:
            return (watch.folder / "small.checkpoint" / "running.npz").stat().st_mtime_ns
        except FileNotFoundError:
            return 0

    def tiles() -> int:
        return sum(name.startswith("0") for name in watch.names)

    def unfinished(*names: str) -> bool:
        return any(name.endswith(".part") and name.startswith(names) for name in watch.names)

    images_before, tiles_before = rows(), tiles()
    return {
        # The lock is taken, no chunk is done.
        "start": lambda: ".small.lock" in watch.names,
        # A chunk is done and saved, the next one is at work.
        "kernel": lambda: rows() != images_before and not unfinished("."),
        "checkpoint": lambda: rows() != images_before and unfinished(".running", ".0"),
        # A tile is saved, others of its group are not.
        "tile": lambda: tiles() > tiles_before,
        "dataset": lambda: unfinished(".small.nc"),
        # The dataset is there, its picture is not.
        "files": lambda: "small.nc" in watch.names and "small.png" not in watch.names,
        "picture": lambda: unfinished(".small.png"),
    }


def strike(runs: Runs, undisturbed: dict[str, bytes], moment: str, with_signal: int, delay: float = 0.0) -> Any:
    """Send the signal to the command at the moment, and look at its files until then and after."""
    watch = Watch(runs.out, undisturbed)
    watch.look()
    it_is = moments(watch)[moment]

    def now() -> bool:
        watch.look()
        return it_is()

    process = runs.strike(now, with_signal, delay=delay)
    watch.look()
    return process


MOMENTS = ("start", "kernel", "checkpoint", "tile", "dataset", "files", "picture")
SOME = Counter(kernel=1, tile=1, dataset=1)
MANY = Counter(start=4, kernel=14, checkpoint=14, tile=6, dataset=12, files=5, picture=5)
"""How often to strike at each moment, sixty times in all."""


VARIANT = "name: small\n" + stone(
    ("mu: 0.5", "mu: [0.2, 0.5]"), ("speed: 1.0e-3", "speed: 0.02"), ("1.0e-4}", "[5.0e-5, 1.0e-4]}"),
    ("pitch: 0.5", "pitch: 1"), (TURNS, "omega3: [-5, 4, 5], slip1: 0.05"), ("t_end: 5", "t_end: 12"),
)  # fmt: skip
"""Any body and any law of friction."""

OWN = f"""\
name: small
model: {ROOT / "configs" / "tippe_top.py"}
body: {{eccentricity: [0.04, 0.1, 0.3]}}
start: {{n0: [2, 4, 6, 7]}}
integrator: {{t_end: 200}}
"""
"""A model that a user brings."""


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        (TEXT, SOME),
        (VARIANT, Counter(kernel=1, dataset=1)),
        pytest.param(OWN, Counter(kernel=1, tile=1), marks=pytest.mark.campaign),
        pytest.param(TEXT, MANY, marks=pytest.mark.campaign),
        pytest.param(VARIANT, Counter(kernel=4, checkpoint=4, tile=4), marks=pytest.mark.campaign),
    ],
    ids=["some", "some-variant", "some-own", "many", "many-variant"],
)
def test_killed_at_any_moment(write: Write, tmp_path: Path, text: str, wanted: Counter[str]) -> None:
    config = write(text)
    undisturbed = Runs("run", config, tmp_path / "calm").complete()
    rng = random.Random(1)
    survived: Counter[str] = Counter()
    for lane in range(40):
        runs = Runs("run", config, tmp_path / f"{lane}")
        for moment in sorted((m for m in MOMENTS for _ in range(3) if survived[m] < wanted[m]), key=MOMENTS.index):
            # Up to a whole chunk later where the moment lasts, at once where it is over soon.
            delay = rng.uniform(0, 0.03) if moment in ("start", "kernel", "files") else 0.0
            process = strike(runs, undisturbed, moment, signal.SIGKILL, delay)
            if process is None:
                assert runs.started[-1].exitcode == 0, runs.started[-1].log.read_text()
                break
            if process.exitcode == -signal.SIGKILL:
                survived[moment] += 1
                assert ".small.lock" in os.listdir(runs.out)
        assert runs.complete() == undisturbed
        if survived >= wanted:
            break
    print(f"killed: {dict(survived)}, {survived.total()} times; {lane + 1} runs")
    assert survived >= wanted, survived


@pytest.mark.parametrize(
    "when",
    [
        ("kernel", "dataset"),
        pytest.param(("kernel", "checkpoint", "kernel", "dataset"), marks=pytest.mark.campaign),
        pytest.param(("kernel", "files"), marks=pytest.mark.campaign),
    ],
    ids=["some", "many", "late"],
)
def test_an_interrupted_run_resumes_with_the_same_files(
    runs: Runs, undisturbed: dict[str, bytes], when: tuple[str, ...]
) -> None:
    for moment in when:
        process = strike(runs, undisturbed, moment, signal.SIGINT)
        assert process is not None
        said = process.log.read_text()
        assert (process.exitcode, "Traceback" in said) == (130, False), said
        assert "finished and kept; the same command resumes the run" in said
        assert not [name for name in os.listdir(runs.out) if name.startswith(".")]
    assert runs.complete() == undisturbed


@pytest.mark.campaign
def test_a_full_disk_is_reported(runs: Runs, values: xr.Dataset) -> None:
    """No file may grow beyond a number of kilobytes, and all is well when it is large enough."""
    for file, most in (("running.npz", 4), ("small.nc", 32), ("", 4096), ("small.png", 40)):
        (runs.out / "small.png").unlink(missing_ok=True)  # the last command draws it alone
        command = [sys.executable, "-m", "sweep", "run", runs.config, "--output", runs.out, "--quiet"]
        done = subprocess.run(
            ["bash", "-c", 'ulimit -S -f $0; "$@"', str(most), *command],
            cwd=ROOT, capture_output=True, text=True, check=False,
        )  # fmt: skip
        if file:
            one_line(done.returncode, done.stderr, file, "File too large")
        else:
            assert (done.returncode, done.stderr) == (0, "")
        assert not list(runs.out.rglob(".*"))
        for path in runs.out.glob("*.nc"):
            same_numbers(xr.load_dataset(path), values)


@pytest.mark.parametrize(
    "what", ["folder", *(pytest.param(w, marks=pytest.mark.campaign) for w in ("parent", "checkpoint"))]
)
def test_a_read_only_folder_is_reported(runs: Runs, undisturbed: dict[str, bytes], what: str) -> None:
    assert strike(runs, undisturbed, "kernel", signal.SIGKILL)
    checkpoint = runs.out / "small.checkpoint"
    if what == "parent":
        shutil.rmtree(runs.out)
    (runs.out / ".small.lock").unlink(missing_ok=True)
    folder = {"folder": runs.out, "parent": runs.out.parent / "closed", "checkpoint": checkpoint}[what]
    folder.mkdir(exist_ok=True)
    folder.chmod(0o555)
    if what == "parent":
        runs.out = folder / "out"
    one_line(*runs.finish("--quiet", unprivileged=True), str(folder), "Permission denied")
    folder.chmod(0o755)
    assert runs.complete(unprivileged=True) == undisturbed


def test_two_processes_at_once(runs: Runs, undisturbed: dict[str, bytes]) -> None:
    watch = Watch(runs.out, undisturbed)
    now = moments(watch)["kernel"]
    first = runs.start()
    while not now():
        assert first.is_alive()
        watch.look()
    os.kill(first.pid, signal.SIGSTOP)  # at work for as long as it takes
    for arguments in ((), ("--fresh",)):
        one_line(*runs.finish("--quiet", *arguments), f"{runs.out / 'small'}: in use by another run")
    assert runs.finish("--quiet", "--set", "name=other", "--set", "t_end=5") == (0, "")
    for left in runs.out.glob("other*"):
        left.unlink()
    os.kill(first.pid, signal.SIGCONT)
    first.join(60)
    assert first.exitcode == 0, first.log.read_text()
    assert contents(runs.out) == undisturbed
