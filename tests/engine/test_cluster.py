"""Runs in other processes: the same files as by threads, whatever happens to the workers."""

import asyncio
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

import dask
import distributed
import pytest
import xarray as xr
from support import ROOT, Write
from support.cli import invoke
from support.kernels import threads
from support.processes import python
from support.runs import Heard, limited, same_numbers
from support.same import contents

import sweep
from sweep.faults import FileError
from sweep.results.provenance import sources

TEXT = """\
name: tiles
body: {b: {start: 2, stop: 6, num: 40}}
friction: {mu: {start: 40, stop: 60, num: 40}}
start: {n0: [0.02, 0.05, 0.07]}
integrator: {t_end: 100}
"""
TILES, SMALL_TILES = 5, 20

Fault = Callable[[distributed.Client, distributed.LocalCluster], None]


@pytest.fixture(scope="module", autouse=True)
def _two_threads() -> Iterator[None]:
    """As processes of their own have, for datasets say how many."""
    with threads(2):
        yield


@pytest.fixture(scope="module")
def config(kept: Write) -> Path:
    return kept(TEXT, "tiles.yaml")


@pytest.fixture(scope="module")
def by_threads(config: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    out = tmp_path_factory.mktemp("threads")
    sweep.run(config, out)
    return contents(out)


@contextmanager
def patched(client: distributed.Client, target: str, value: Any) -> Iterator[None]:
    """Another `target` in workers; those that are started anew meanwhile have their own."""
    client.run(lambda: mock.patch(target, value).start())
    yield
    client.run(mock.patch.stopall)


def test_workers_of_a_scheduler_give_the_same_files(
    config: Path, tmp_path: Path, local: distributed.LocalCluster, by_threads: dict[str, bytes]
) -> None:
    result = invoke("run", config, "--output", tmp_path, "--client", local.scheduler_address, "--quiet")
    assert (result.exit_code, result.output) == (0, "")
    assert contents(tmp_path) == by_threads


def completed(local: distributed.LocalCluster) -> int:
    """How many tiles workers have finished since the log was cleared, any of them more than once included."""
    log = local.scheduler.transition_log
    moves = [(start, end) for key, start, end, *_ in log if str(key).startswith("_work")]
    return moves.count(("processing", "memory"))


def signal_busiest(number: int) -> Fault:
    """A fault that sends a signal to the worker that has most of the tiles."""

    def send(client: distributed.Client, local: distributed.LocalCluster) -> None:  # noqa: ARG001
        tiles = client.processing()
        busiest = max(tiles, key=lambda worker: len(tiles[worker]))
        os.kill(client.run(os.getpid)[busiest], number)

    return send


def add_one(client: distributed.Client, local: distributed.LocalCluster) -> None:  # noqa: ARG001
    local.scale(3)


def leave_none(client: distributed.Client, local: distributed.LocalCluster) -> None:  # noqa: ARG001
    local.scale(0)
    threading.Timer(1.0, local.scale, [2]).start()


@pytest.mark.campaign
@pytest.mark.parametrize(
    ("fault", "lost"),
    # With a worker go the few results that had not been fetched yet.
    [(signal_busiest(signal.SIGKILL), 6), (signal_busiest(signal.SIGSTOP), 6), (add_one, 0), (leave_none, 6)],
    ids=["killed", "hung", "new", "none for a second"],
)  # fmt: skip
def test_workers_that_come_go_hang_and_lag_cost_only_their_tiles(
    config: Path, tmp_path: Path, fault: Fault, lost: int
) -> None:
    """One worker of two is slow from the beginning; the fault comes with the first tile."""
    expected = sweep.run(config)
    with (
        limited(tile=expected.status.size // SMALL_TILES),
        dask.config.set({"distributed.scheduler.worker-ttl": "15s"}),
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=":0", silence_logs="CRITICAL"
        ) as local,
        distributed.Client(local) as client,
    ):
        client.wait_for_workers(2)
        client.run(slow_down, workers=list(client.scheduler_info(n_workers=-1)["workers"])[:1])

        def when_the_first_is_back() -> None:
            if len(heard.seen) == 1:
                time.sleep(0.1)  # into the next
                fault(client, local)

        heard = Heard(when_the_first_is_back)
        found = sweep.run(config, tmp_path, progress=heard, client=client)
        assert heard.seen
        tasks = SMALL_TILES // 2
        assert tasks <= completed(local) <= tasks + lost
    same_numbers(found, expected)


def slow_down() -> None:
    """Make a worker take a fifth of a second longer for each tile."""
    import time

    from sweep.engine import cluster

    run = cluster.run_batch
    cluster.run_batch = lambda *given: [time.sleep(0.2), *run(*given)][1:]


@pytest.mark.campaign
def test_types_of_cpu_are_listed(config: Path, client: distributed.Client) -> None:
    # One worker may take all tiles, so each says both.
    types = iter(["one", "another"] * TILES)
    with patched(client, "sweep.engine.local.this_cpu", lambda: next(types)):
        dataset = sweep.run(config, client=client, t_end=20)
    assert dataset.attrs["cpu"] == "another, one"


@pytest.mark.parametrize(
    ("changed", "said"),
    [((0, "0" * 16), "other sources of the model or kernel"), ((1, "numba 0.1"), "other versions: .*, now numba 0.1")],
)
def test_another_program_in_a_worker_is_refused(
    config: Path, threaded: distributed.Client, changed: tuple[int, str], said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = list(sources())
    own[changed[0]] = changed[1]
    monkeypatch.setattr("sweep.engine.cluster.sources", lambda: tuple(own))
    with pytest.raises(FileError, match=f"inproc://.*: the worker has {said}"):
        sweep.run(config, client=threaded)


@pytest.mark.campaign
def test_a_tile_that_kills_its_workers_is_reported(
    config: Path, client: distributed.Client, local: distributed.LocalCluster, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(local.scheduler, "allowed_failures", 0)
    with patched(client, "sweep.engine.cluster.run_batch", lambda *_: os._exit(1)):
        with pytest.raises(FileError, match="workers died computing it"):
            sweep.run(config, client=client)
        client.wait_for_workers(2)


UNANSWERED = """\
import sys
from sweep.cli import main
from sweep.engine import cluster

cluster.PATIENCE = "1s"
for address in sys.argv[3:]:
    try:
        main(["run", sys.argv[1], "--output", sys.argv[2], "--client", address, "--quiet"])
    except SystemExit as end:
        print(end.code)
"""


def test_a_scheduler_that_does_not_answer_is_reported(config: Path, tmp_path: Path) -> None:
    """In a process of its own, for what dask still says when that ends: one line for each is all that is printed."""
    addresses = ["tcp://127.0.0.1:1", "tls://127.0.0.1:1", "nonsense", "foo://here:1"]
    done = python("-c", UNANSWERED, config, tmp_path, *addresses)
    assert done.stdout.split() == ["2"] * len(addresses)
    lines = done.stderr.splitlines()
    assert len(lines) == len(addresses), done.stderr
    for line, address in zip(lines, addresses, strict=True):
        assert line.startswith(f"{address}: no dask scheduler answers")


@pytest.mark.campaign
def test_a_run_that_lost_its_scheduler_computes_what_is_missing_on_another(
    config: Path,
    tmp_path: Path,
    client: distributed.Client,
    local: distributed.LocalCluster,
    by_threads: dict[str, bytes],
) -> None:
    program = (
        "import time, distributed\n"
        "if __name__ == '__main__':\n"
        "    cluster = distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=':0')\n"
        "    print(cluster.scheduler_address, flush=True)\n"
        "    time.sleep(600)\n"
    )
    (tmp_path / "cluster.py").write_text(program, encoding="utf-8")
    out = tmp_path / "out"
    with subprocess.Popen(
        [sys.executable, tmp_path / "cluster.py"],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as scheduler:
        try:
            assert scheduler.stdout
            address = scheduler.stdout.readline().strip()
            run = [sys.executable, "-m", "sweep", "run", config, "--output", out, "--quiet", "--client", address]
            process = subprocess.Popen(run, cwd=ROOT, stderr=subprocess.PIPE, text=True)
            while not list(out.glob("tiles.checkpoint/0*.npz")):
                assert process.poll() is None
                time.sleep(0.002)
        finally:
            scheduler.kill()
        _, said = process.communicate(timeout=60)
    assert (process.returncode, said) == (
        2,
        "the dask scheduler is gone; finished tiles are kept, and the same command without --fresh resumes the run\n",
    )
    there = len(list(out.glob("tiles.checkpoint/0*.npz")))
    local.scheduler.transition_log.clear()
    sweep.run(config, out, client=client)
    assert completed(local) == TILES - there < TILES
    assert contents(out) == by_threads


def test_a_client_that_cannot_be_used_is_refused(config: Path, threaded: distributed.Client) -> None:
    closed = distributed.Client(threaded.cluster, set_as_default=False)
    closed.close()
    with pytest.raises(sweep.InputError, match=r"^client: is closed; give a client that is connected"):
        sweep.run(config, client=closed)

    async def asynchronous() -> None:
        async with distributed.Client(
            threaded.cluster.scheduler_address, asynchronous=True, set_as_default=False
        ) as client:
            with pytest.raises(sweep.InputError, match=r"^client: is asynchronous; give one that was made with"):
                sweep.run(config, client=client)

    asyncio.run(asynchronous())


def test_formulas_run_on_a_cluster(config: Path, threaded: distributed.Client) -> None:
    asked = {"model": "analytic"}
    here, there = sweep.run(config, **asked), sweep.run(config, client=threaded, **asked)
    xr.testing.assert_identical(here.drop_attrs(deep=False), there.drop_attrs(deep=False))
