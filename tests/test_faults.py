"""Real faults: killed, interrupted, without room or rights, damaged, twice at once, changed in between.

Whatever happens, the same command goes on and ends in the files of an undisturbed run, byte for byte.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import struct
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import nursery
import pytest
from conftest import ROOT, SMALL

from sweep.store import Checkpoint, Identity, StoreError

TEXT = SMALL + "verify: 0.3\n"

KILLS = 50

Start = Callable[..., Any]


@pytest.fixture(scope="module")
def config(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("config") / "small.yaml"
    path.write_text(TEXT, encoding="utf-8")
    return path


@dataclass
class Runs:
    """The command `run CONFIG --output OUT`, again and again."""

    config: Path
    out: Path
    started: list[Any] = field(default_factory=list)

    def start(self, *arguments: str, **settings: Any) -> Any:
        """A process that runs it."""
        asked = ["run", str(self.config), "--output", str(self.out), *arguments]
        log = self.out.parent / f"{self.out.name}.log{len(self.started)}"
        process = nursery.context().Process(target=nursery.command, args=(asked, log), kwargs=settings)
        process.start()
        process.log = log
        self.started.append(process)
        return process

    def finish(self, *arguments: str, **settings: Any) -> tuple[int, str]:
        """Exit code and output of a process that runs it."""
        process = self.start(*arguments, **settings)
        process.join(120)
        return process.exitcode, process.log.read_text(encoding="utf-8")


@pytest.fixture
def runs(config: Path, tmp_path: Path) -> Iterator[Runs]:
    runs = Runs(config, tmp_path / "out")
    yield runs
    for process in runs.started:
        process.kill()
        process.join()
        process.close()


@pytest.fixture(scope="module")
def undisturbed(config: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The files of a run that nothing happened to."""
    runs = Runs(config, tmp_path_factory.mktemp("undisturbed") / "out")
    code, said = runs.finish()
    assert code == 0, said
    return contents(runs.out)


def contents(folder: Path) -> dict[str, bytes]:
    """All files of a folder, but for the clock in a dataset."""
    return {
        path.name: without_clock(path) if path.suffix == ".nc" else path.read_bytes() for path in folder.iterdir()
    }  # fmt: skip


def without_clock(path: Path) -> bytes:
    """The bytes of a dataset, with those of the attributes that tell the time replaced."""
    whole = path.read_bytes()
    with netCDF4.Dataset(path) as dataset:
        clock = [dataset.created.encode()]
        clock += [struct.pack("<d", dataset.getncattr(name)) for name in ("wall_time", "trajectories_per_second")]
    masked = bytearray(whole)
    for value in clock:
        at = whole.index(value)
        assert whole.count(value) == 1
        masked[at : at + len(value)] = b"#" * len(value)
        # HDF5 keeps attributes in blocks: signature, version, address of the heap, offset in it, checksum.
        checksum = whole.rindex(b"FHDB", 0, at) + 4 + 1 + 8 + 5
        masked[checksum : checksum + 4] = b"####"
    return bytes(masked)


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


class Moments:
    """When to strike, told from the names of the files: each method says whether it is now."""

    def __init__(self, watch: Watch) -> None:
        self.watch = watch
        self.before = self._images()
        self.tiles = len(self._tiles())

    def _images(self) -> int:
        try:
            return (self.watch.folder / "small.checkpoint" / "running.npz").stat().st_mtime_ns
        except FileNotFoundError:
            return 0

    def _tiles(self) -> list[str]:
        return [name for name in self.watch.names if name.startswith("0")]

    def _unfinished(self, *names: str) -> bool:
        return any(name.endswith(".part") and name.startswith(names) for name in self.watch.names)

    def start(self) -> bool:
        """The lock is taken, no chunk is done."""
        return ".small.lock" in self.watch.names

    def kernel(self) -> bool:
        """A chunk is done and saved, the next one is at work."""
        return self._images() != self.before and not self._unfinished(".")

    def checkpoint(self) -> bool:
        return self._images() != self.before and self._unfinished(".running", ".0")

    def tile(self) -> bool:
        """A tile is saved, others of its group are not."""
        return len(self._tiles()) > self.tiles

    def dataset(self) -> bool:
        return self._unfinished(".small.nc")

    def files(self) -> bool:
        """The dataset is there, its picture is not."""
        return "small.nc" in self.watch.names and "small.png" not in self.watch.names

    def picture(self) -> bool:
        return self._unfinished(".small.png")


def strike(runs: Runs, undisturbed: dict[str, bytes], moment: str, delay: float, with_signal: int) -> Any:
    """Start the command and send the signal at the moment; None where it ended before that came."""
    watch = Watch(runs.out, undisturbed)
    watch.look()
    now = getattr(Moments(watch), moment)
    process = runs.start()
    while not now():
        if not process.is_alive():
            return None
        watch.look()
    time.sleep(delay)
    os.kill(process.pid, with_signal)
    process.join(60)
    watch.look()
    return process


def test_killed_at_any_moment(config: Path, tmp_path: Path, undisturbed: dict[str, bytes]) -> None:
    rng = random.Random(1)
    wanted = Counter(start=4, kernel=12, checkpoint=12, tile=4, dataset=8, files=5, picture=5)
    order = ["start", "kernel", "checkpoint", "tile", "dataset", "files", "picture"]
    survived: Counter[str] = Counter()
    for lane in range(40):
        runs = Runs(config, tmp_path / f"{lane}" / "out")
        runs.out.parent.mkdir()
        for moment in sorted((m for m in order for _ in range(3) if survived[m] < wanted[m]), key=order.index):
            # Up to a whole chunk later where the moment lasts, at once where it is over soon.
            delay = rng.uniform(0, 0.03) if moment in ("start", "kernel", "files") else 0.0
            process = strike(runs, undisturbed, moment, delay, signal.SIGKILL)
            if process is None:
                assert runs.started[-1].exitcode == 0, runs.started[-1].log.read_text()
                break
            if process.exitcode == -signal.SIGKILL:
                survived[moment] += 1
                assert ".small.lock" in os.listdir(runs.out)
        code, said = runs.finish()
        assert code == 0, said
        assert contents(runs.out) == undisturbed
        if survived >= wanted:
            break
    print(f"killed: {dict(survived)}, {survived.total()} times; {lane + 1} runs, {time.process_time():.0f} s")
    assert survived >= wanted, survived
    assert survived.total() >= KILLS
