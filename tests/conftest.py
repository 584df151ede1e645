"""Fixtures of all rooms, and the kernels that the tests of every room need, compiled ahead of them."""

from __future__ import annotations

import os
import platform
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import distributed
import numba
import numpy as np
import pytest
import xarray as xr
from hypothesis import settings
from support import SMALL, Write
from support.kernels import SHARED, kernel
from support.runs import limited, nothing_drawn

import sweep
from sweep.jit import showing
from sweep.kernels.build import FAILING, PATH, build
from sweep.kernels.kernel import Kernel

if TYPE_CHECKING:
    from playwright.sync_api import Browser

# Compiling takes longer than any deadline; the same examples on every machine.
settings.register_profile("sweep", deadline=None, derandomize=True, max_examples=200)
settings.load_profile("sweep")

# A shell ignores SIGINT in what it starts in the background, and so would the processes that tests interrupt.
signal.signal(signal.SIGINT, signal.default_int_handler)

# Several processes share the cores; what a test says of threads, it sets.
if "PYTEST_XDIST_WORKER" in os.environ:
    numba.set_num_threads(1)


def pytest_configure(config: pytest.Config) -> None:
    """Hide what the extra `browser` installs from the tests that have to pass without it."""
    if "not browser" in config.option.markexpr:
        sys.modules.update(dict.fromkeys(["bokeh", "playwright"]))


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile the kernels on all cores before processes that share the tests wait for the same ones."""
    config = session.config
    whole = config.args_source is pytest.Config.ArgsSource.TESTPATHS and not config.option.collectonly
    if hasattr(config, "workerinput") or not whole:
        return
    writer = config.get_terminal_writer()
    with showing(lambda: nullcontext(writer.line("compiling kernels", flush=True))):
        build([kernel()], PATH, FAILING)
        build([kernel(*each) for each in SHARED])


LIGHT = ("config", "cli", "explorer", "plots", "results")
"""Folders whose files take seconds, but for those in a browser."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run light files last, so that no process waits long for another; skip instructions of x86 CPUs on others."""
    items.sort(key=lambda item: item.path.parent.name in LIGHT and not item.get_closest_marker("browser"))
    if platform.machine().lower() not in ("x86_64", "amd64"):
        for item in items:
            if item.get_closest_marker("x86"):
                item.add_marker(pytest.mark.skip(reason="looks at instructions of x86 CPUs"))


@pytest.fixture(scope="session")
def small(kept: Write) -> xr.Dataset:
    """The dataset of the sweep of twelve cells."""
    return sweep.run(kept())


@pytest.fixture(scope="session")
def local() -> Iterator[distributed.LocalCluster]:
    """Two worker processes, of one thread and of two."""
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, dashboard_address=":0", silence_logs="CRITICAL"
    ) as cluster:
        cluster.new_spec["options"]["nthreads"] = 2
        cluster.scale(2)
        yield cluster


@pytest.fixture
def client(local: distributed.LocalCluster) -> Iterator[distributed.Client]:
    with distributed.Client(local) as client:
        client.wait_for_workers(2)
        yield client


@pytest.fixture(scope="session")
def threaded() -> Iterator[distributed.Client]:
    """A client of a scheduler and a worker in this process, which start in a fraction of a second."""
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=1, processes=False, dashboard_address=":0", silence_logs="CRITICAL"
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        yield client


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """Debian's chromium: playwright's own is downloaded from a place that many machines do not reach."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        found = playwright.chromium.launch(
            executable_path="/usr/bin/chromium", args=["--no-sandbox", "--disable-gpu"]
        )  # fmt: skip
        yield found
        found.close()


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Steps that kernels take from now on, one number for each call."""
    steps, plain = list[float](), Kernel.advance

    def advance(kernel: Kernel, rows: np.ndarray, *rest: Any) -> int:
        before = kernel.table(rows)["done"].sum()
        blocks = plain(kernel, rows, *rest)
        steps.append(kernel.table(rows)["done"].sum() - before)
        return blocks

    monkeypatch.setattr(Kernel, "advance", advance)
    return steps


@pytest.fixture
def short_chunks() -> Iterator[None]:
    """Chunks of twenty blocks on any machine; twelve cells take some twenty of them."""
    with limited(chunk_blocks=20):
        yield


@pytest.fixture
def no_pictures() -> Iterator[None]:
    with nothing_drawn():
        yield


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Writes a configuration, by default a sweep of twelve cells, and returns its path."""
    return partial(_written, lambda: tmp_path)


@pytest.fixture(scope="session")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Write:
    """As `write`, for the fixtures of whole files: each configuration is in a folder of its own."""
    return partial(_written, lambda: tmp_path_factory.mktemp("kept"))


def _written(folder: Callable[[], Path], text: str = SMALL, name: str = "small.yaml") -> Path:
    path = folder() / name
    path.write_text(text, encoding="utf-8")
    return path
