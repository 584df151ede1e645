"""Kernels are compiled in processes of their own, side by side, and only what the cache lacks."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import psutil
import pytest
from support import ENDS, ROOT, Write, columns
from support.kernels import kernel, threads
from support.processes import python
from support.runs import run_cells

import sweep
from sweep.jit import Cached, showing
from sweep.kernels import build as builder
from sweep.kernels.build import FAILING, build, missing
from sweep.kernels.methods import METHODS
from sweep.kernels.samples import sampled
from sweep.kernels.status import LIFT_OFF
from sweep.models import MODELS

AUTO = "body: {b: [2, 3]}\nfriction: {mu: [1, 1000]}\nintegrator: {method: auto, t_end: 10}\nname: auto\n"
"""Its cells need both methods."""


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, ...]]:
    """What would be compiled if there were no cache, in the order in which processes start."""
    pieces: list[tuple[str, ...]] = []

    def start(piece: tuple[str, ...], _: object) -> subprocess.Popen[bytes]:
        pieces.append(piece)
        return subprocess.Popen([sys.executable, "-c", ""])

    monkeypatch.setattr(Cached, "is_missing", lambda _: True)
    monkeypatch.setattr(builder, "_start", start)
    return pieces


def test_a_process_imports_nothing_from_the_current_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And finds this package wherever it is; `random` is imported by Numba.  This kernel compiles fastest."""
    (tmp_path / "random.py").write_text("open('imported', 'w').close()\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    with builder._start(("kernel", "dopri5", "averaged"), None) as process:
        process.wait(300)
    assert process.returncode == 0
    assert not (tmp_path / "imported").exists()
    assert [*(tmp_path / "cache").rglob("*.nbc")]


def test_all_that_two_methods_need_is_compiled_once(started: list[tuple[str, ...]]) -> None:
    measure = ("reversals", "resting_spin")
    build(kernel(method, measure=measure) for method in ("adams", "dopri5", "adams"))
    assert started == [
        ("kernel", "adams", "slip", "reversals", "round_off", "decay"),
        ("exchange", "dopri5", "slip"),
        ("follow", "dopri5", "slip"),
        ("beginning", "adams", "slip"),
        ("kernel", "dopri5", "slip", "reversals", "round_off", "decay"),
    ]


def test_estimated_counts_need_no_kernel(started: list[tuple[str, ...]]) -> None:
    sweep.predict({"friction": {"mu": 60}}, measure=["estimate"])
    assert started == [("exchange", "dopri5", "slip"), ("follow", "dopri5", "slip")]


def test_what_only_failures_need_is_compiled_when_one_is_met(started: list[tuple[str, ...]]) -> None:
    piece = ("failing", "dopri5", "slip")
    run_cells([{}], t_end=10.0)
    assert piece not in started
    assert run_cells([ENDS[LIFT_OFF]], t_end=10.0).status == LIFT_OFF
    assert piece in started


@pytest.mark.parametrize("method", METHODS)
def test_what_was_compiled_is_found(method: str) -> None:
    """Also what a method needs of the model in its own variables."""
    ours = kernel(method)
    build([ours], FAILING)
    assert missing([ours], FAILING) == []


@pytest.mark.usefixtures("started")
def test_no_more_processes_at_once_than_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    alive: list[subprocess.Popen[bytes]] = []
    most = 0

    def start(*_: object) -> subprocess.Popen[bytes]:
        nonlocal most
        alive.append(subprocess.Popen([sys.executable, "-c", "import time; time.sleep(0.2)"]))
        most = max(most, sum(process.poll() is None for process in alive))
        return alive[-1]

    monkeypatch.setattr(builder, "_start", start)
    with threads(1):
        build([kernel("adams"), kernel()])
    assert (len(alive), most) == (5, 1)


def test_what_is_compiled_is_shown(started: list[tuple[str, ...]]) -> None:
    shown: list[object] = []

    @contextmanager
    def show() -> Iterator[None]:
        shown.append("begins")
        yield
        shown.append(len(started))

    with showing(show):
        build([kernel()])
    build([kernel()])
    assert shown == ["begins", 3]


def test_functions_are_compiled_for_the_arguments_that_they_get(monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise Numba would compile them once more when they are called."""
    call, signatures = Cached.__call__, dict[str, int]()

    def count(function: Cached, *arguments: object) -> None:
        call(function, *arguments)
        dispatcher = function._dispatcher
        signatures[dispatcher.py_func.__qualname__.split(".")[0]] = len(dispatcher.signatures)

    monkeypatch.setattr(Cached, "__call__", count)
    run_cells([ENDS[LIFT_OFF], {}], method="adams", t_end=2000.0)
    sampled(MODELS["slip"], columns(), np.full(1, 0.1), np.arange(2.0))
    sweep.trajectory({"friction": {"mu": 60}, "start": {"n0": 0.05}}, t_end=10.0)
    assert signatures == dict.fromkeys(signatures, 1)
    made = {"make_advance", "compiled_start_up", "compiled_approach", "compiled_samples", "compiled_path"}
    assert signatures.keys() == made | {"compiled_exchange", "make_follow"}


def test_measurements_without_a_place_in_the_kernel_share_it() -> None:
    def name(*measure: str) -> str:
        return str(kernel(measure=measure).advancing._cache._cache_file._index_name)

    alone = name("reversals")
    assert name("reversals", "resting_spin") == alone
    for other in ("energy_error", "reversal_times=3"):
        assert name("reversals", other) != alone


@pytest.mark.parametrize(("with_signal", "code"), [(signal.SIGINT, 130), (signal.SIGKILL, -signal.SIGKILL)])
def test_processes_end_with_the_one_that_started_them(
    with_signal: signal.Signals, code: int, write: Write, tmp_path: Path
) -> None:
    """Only the parent gets the signal."""
    command = [sys.executable, "-m", "sweep", "run", write(AUTO), "--output", tmp_path / "out"]
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    with subprocess.Popen(command, cwd=ROOT, env=environment, stderr=subprocess.PIPE, text=True) as process:
        while not (children := psutil.Process(process.pid).children()):
            assert process.poll() is None
            time.sleep(0.01)
        process.send_signal(with_signal)
        assert process.stderr
        shown = process.stderr.read().splitlines()
        assert process.wait() == code
    assert not psutil.wait_procs(children, timeout=60)[1]
    assert list((tmp_path / "cache").rglob("*.nbc")) == []  # they were ended, and have not come to their ends
    assert len(shown) == (2 if with_signal == signal.SIGINT else 1), shown
    assert shown[0].startswith("compiling")
    assert shown[1:] == ["interrupted: no cells finished and kept; the same command resumes the run"][: len(shown) - 1]


@pytest.mark.release
def test_counts_are_estimated_alike_by_the_process_that_compiles(tmp_path: Path) -> None:
    """High counts, some of which depend on the last bits."""
    program = """
import numpy as np, sweep
random = np.random.default_rng(5)
drawn = {"b": random.uniform(1.5, 9.5, 300), "mu": random.uniform(500, 4000, 300), "n0": random.uniform(0.05, 0.2, 300)}
cases = {name: values.tolist() for name, values in drawn.items()}
print(sweep.predict({"cases": cases}, measure=["estimate"])["reversals_estimated"].values.tolist())
"""
    first, second = (python("-c", program, NUMBA_CACHE_DIR=str(tmp_path)).stdout for _ in range(2))
    assert first == second


@pytest.mark.campaign
@pytest.mark.parametrize("folder", ["none at all", "a file in its place"])
def test_without_a_cache_a_run_compiles_for_itself(folder: str, write: Write, tmp_path: Path) -> None:
    """The averaged model: its kernel compiles fastest."""
    (tmp_path / "cache").write_text("", encoding="utf-8")
    text = "model: averaged\nname: small\nfriction: {mu: 60}\nmeasure: []\nintegrator: {t_end: 5}\n"
    program = "from sweep.__main__ import main\nmain()\n"
    if folder == "none at all":
        program = "from numba.core.caching import CacheImpl\nCacheImpl._locator_classes = []\n" + program
    python(
        "-c", program, "run", write(text), "--output", tmp_path / "out", NUMBA_CACHE_DIR=str(tmp_path / "cache")
    )  # fmt: skip
    assert (tmp_path / "out" / "small.nc").exists()
