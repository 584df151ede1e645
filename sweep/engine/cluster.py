"""Runs tiles in other processes, of this machine or of a cluster, with dask.distributed.

Workers compute and send arrays back; only the process that started the run writes files.  If a
worker dies, another one computes the tile it was working on.
"""

from __future__ import annotations

import logging
import math
import signal
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numba

from sweep.config import Config
from sweep.engine.local import Done, run_batch
from sweep.engine.plan import kernels
from sweep.grid import Tile
from sweep.interrupt import point
from sweep.kernels.build import APPROACH, build
from sweep.results.identity import Identity
from sweep.results.provenance import identify, sources
from sweep.results.store import StoreError

AHEAD = 3
"""Tiles per worker that are sent out before the first comes back."""

PATIENCE = "10s"
"""How long to wait for a scheduler to answer."""

_RECOUNT = 1.0
"""Time in s between two questions how many workers there are, who come and go.  Asked for each tile, the
answers of 1000 workers would have kept this process busy."""

_POLL = 0.01
"""Time in seconds between two looks at whether a tile has come back."""

_LOST = "the dask scheduler is gone; finished tiles are kept, and the same command without --fresh resumes the run"


class Cluster:
    """A dask scheduler and its workers.

    Parameters
    ----------
    client : connected to the scheduler
    local : whether the workers find what this process compiles: then it compiles for all of them
    """

    def __init__(self, client: Any, local: bool = False) -> None:
        self.client, self.local = client, local

    def run(self, config: Config, tiles: Sequence[Tile], todo: Sequence[int]) -> Iterator[Done]:
        """Run the tiles `todo`, and yield them as they come back.

        Raises
        ------
        StoreError
            if a worker runs other source code, a tile kills several workers, or the scheduler disappears.
        """
        from distributed import CancelledError, KilledWorker, as_completed
        from distributed.comm import CommClosedError

        if self.local and config.simulated:
            build(kernels(config), APPROACH)
        # A task's result rather than scattered data, which would be lost along with the workers that hold it.
        shared = self.client.submit(tuple, [config, list(tiles), identify(config)], pure=False)
        waiting, numbers = iter(todo), dict[Any, int]()
        running = as_completed(loop=self.client.loop)
        workers, counted = 0, -math.inf

        def send_ahead() -> None:
            nonlocal workers, counted
            if time.monotonic() > counted + _RECOUNT:
                workers, counted = len(self.client.scheduler_info(n_workers=-1)["workers"]), time.monotonic()
            while len(numbers) < AHEAD * max(1, workers):
                if (i := next(waiting, None)) is None:
                    return
                future = self.client.submit(_work, shared, i, pure=False)
                numbers[future] = i
                running.add(future)

        send_ahead()
        for future in _arriving(running):
            try:
                done: Done = future.result()
            except KilledWorker as error:
                deaths = error.allowed_failures + 1
                raise StoreError(
                    f"tile {numbers[future]}: {deaths} workers died computing it; out of memory?"
                ) from None
            except CancelledError:
                raise StoreError(_LOST) from None
            del numbers[future]
            future.release()
            try:
                send_ahead()
            except CommClosedError:
                raise StoreError(_LOST) from None
            yield done


def _arriving(running: Any) -> Iterator[Any]:
    """Futures in the order in which they are done."""
    while not running.is_empty():
        while not running.has_ready():
            time.sleep(_POLL)
            point()
        yield next(running)


Shared = tuple[Config, list[Tile], Identity]
"""What the tasks of a run have in common."""


# Kernels of several tasks at once would share threads, which not all of numba's threading layers allow.
_one_tile = threading.Lock()


def _work(shared: Shared, tile: int) -> Done:
    from distributed import get_worker

    config, tiles, identity = shared
    source_hash, versions = sources()
    if reason := identity.difference(replace(identity, source_hash=source_hash, versions=versions)):
        raise StoreError(f"{get_worker().address}: the worker has {reason}")
    with _one_tile:
        most = numba.config.NUMBA_NUM_THREADS  # type: ignore[attr-defined]
        numba.set_num_threads(min(get_worker().state.nthreads, most))
        (done,) = run_batch(config, tiles, [tile])
    return done


@contextmanager
def connected(workers: int | None, scheduler: str | None) -> Iterator[Cluster | None]:
    """A local cluster of `workers` processes, or the cluster at the address `scheduler`; None if neither is given.

    Raises
    ------
    StoreError
        if dask.distributed is not installed, or no scheduler answers.
    """
    if workers is None and scheduler is None:
        yield None
        return
    import dask
    import distributed

    for logger in ("distributed", "distributed.client"):  # what a user has to know is raised as an error
        logging.getLogger(logger).setLevel("CRITICAL")
    quiet = {"distributed.nanny.pre-spawn-environ.DASK_LOGGING__DISTRIBUTED": "CRITICAL"}
    if scheduler is None:
        with (
            dask.config.set(quiet),
            distributed.LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                dashboard_address=":0",  # any free port: the usual one may be taken
                scheduler_kwargs={"dashboard": False},
                silence_logs="CRITICAL",
                # Whoever reaches a scheduler runs code as the one who started it, so it asks for a certificate.
                security=distributed.Security.temporary(),
                protocol="tls://",
                preload=__name__,
            ) as cluster,
            distributed.Client(cluster, set_as_default=False) as client,
        ):
            yield Cluster(client, local=True)
        return
    try:
        # A client that is given a wrong address waits 20 s for itself when it is collected, and prints a traceback.
        distributed.comm.resolve_address(scheduler)
        client = distributed.Client(scheduler, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise StoreError(f"{scheduler}: no dask scheduler answers ({error})") from None
    with client:
        yield Cluster(client)


def dask_setup(worker: Any) -> None:  # noqa: ARG001
    """Make a worker ignore Ctrl-C, which a terminal sends to all processes: it is for the one that started the run.

    Dask calls this in each worker, by the name of this module given as `preload`.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
