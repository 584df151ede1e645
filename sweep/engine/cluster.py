"""Runs tiles on the workers of a dask scheduler, with dask.distributed.

Workers compute and send arrays back; only the process that started the run writes files.  If a
worker dies, another one computes the tile it was working on.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numba

from sweep.config import Config
from sweep.engine.local import Done, run_batch, split
from sweep.engine.plan import kernels
from sweep.faults import FileError, fault_of, refusal
from sweep.grid import Tile
from sweep.interrupt import point
from sweep.kernels.build import FAILING, build
from sweep.kernels.layout import LANES
from sweep.results.provenance import Identity, identify, sources

if TYPE_CHECKING:
    from distributed import Client

PATIENCE = "10s"
"""Seconds to wait for a scheduler to answer."""

_POLL = 0.01
"""Seconds between two checks whether a tile has come back."""

_CELLS_A_LANE, _TASKS_A_WORKER = 32, 4
"""Cells of a task for each lane of a worker, and the least number of tasks for each worker, which takes precedence."""

_LOST = "the dask scheduler is gone; finished tiles are kept, and the same command without --fresh resumes the run"


def run_tiles(client: Client, config: Config, tiles: Sequence[Tile], todo: Sequence[int]) -> Iterator[Done]:
    """Run the tiles `todo` on the workers of `client`, and yield them as they come back.

    Raises
    ------
    FileError
        if a worker runs other source code, a tile kills several workers, or the scheduler disappears.
    """
    from distributed import CancelledError, KilledWorker, as_completed

    if config.simulated and _on_this_machine(client):
        build(kernels(config), FAILING)  # once, into the cache that those workers read
    # A task's result rather than scattered data, which would be lost along with the workers that hold it.
    shared = client.submit(tuple, [config, list(tiles), identify(config)], pure=False)
    numbers = {client.submit(_work, shared, some, pure=False): some for some in _tasks(client, config, tiles, todo)}
    for future in _arriving(as_completed(numbers, loop=client.loop)):
        try:
            done: list[Done] = future.result()
        except KilledWorker as error:
            deaths = error.allowed_failures + 1
            raise FileError(f"tile {numbers[future][0]}: {deaths} workers died computing it; out of memory?") from None
        except CancelledError:
            raise FileError(_LOST) from None
        del numbers[future]
        future.release()
        yield from done


def _tasks(client: Client, config: Config, tiles: Sequence[Tile], todo: Sequence[int]) -> Iterator[list[int]]:
    """Divide `todo` among tasks: enough cells in each to fill the lanes of a worker, but several for each worker."""
    threads = [*client.nthreads().values()] or [1]
    cells = max(threads) * LANES * _CELLS_A_LANE
    return split(config.grid, tiles, todo, cells, len(todo) // (_TASKS_A_WORKER * len(threads)))


def _on_this_machine(client: Client) -> bool:
    """Return whether any worker runs on the machine of this process."""
    from distributed.comm import get_address_host
    from distributed.utils import get_ip

    return not {"127.0.0.1", get_ip()}.isdisjoint(map(get_address_host, client.nthreads()))


def _arriving(running: Any) -> Iterator[Any]:
    """Yield futures in the order in which they finish."""
    while not running.is_empty():
        while not running.has_ready():
            time.sleep(_POLL)
            point()
        yield next(running)


Shared = tuple[Config, list[Tile], Identity]
"""What all tasks of a run share."""


# Kernels of several tasks at once would share threads, which not all of numba's threading layers allow.
_one_tile = threading.Lock()


def _work(shared: Shared, batch: Sequence[int]) -> list[Done]:
    from distributed import get_worker

    config, tiles, identity = shared
    source_hash, versions = sources()
    if reason := identity.difference(replace(identity, source_hash=source_hash, versions=versions)):
        raise FileError(f"{get_worker().address}: the worker has {reason}")
    with _one_tile:
        most = numba.config.NUMBA_NUM_THREADS  # type: ignore[attr-defined]
        numba.set_num_threads(min(get_worker().state.nthreads, most))
        return list(run_batch(config, tiles, batch))


def _require_usable(client: object) -> None:
    """Raise an `InputError` unless `client` is an open client that waits for results."""
    from distributed import Client

    if not isinstance(client, Client):
        raise fault_of(refusal(client, "a distributed.Client or the address of a scheduler"), "client")
    if client.asynchronous:
        raise fault_of("is asynchronous; give one that was made with asynchronous=False", "client")
    if client.status != "running":
        raise fault_of(f"is {client.status}; give a client that is connected to its scheduler", "client")


@contextmanager
def connected(client: Client | str | None) -> Iterator[Client | None]:
    """Connect to the scheduler at an address; a client, or None, is returned unchanged.

    Raises
    ------
    InputError
        if it is something else, or a client that is closed or asynchronous.
    FileError
        if no scheduler answers, or distributed is not installed.
    """
    if not isinstance(client, str):
        if client is not None:
            _require_usable(client)
        yield client
        return
    try:
        import distributed
    except ModuleNotFoundError:
        message = "needs distributed, which is not installed: pip install 'dask[distributed]'"
        raise FileError(f"{client}: {message}") from None

    for logger in ("distributed", "distributed.client"):  # user-visible problems are raised as errors
        logging.getLogger(logger).setLevel("CRITICAL")
    try:
        # When collected, a client with a wrong address would wait for itself for 20 s, and print a traceback.
        distributed.comm.resolve_address(client)
        there = distributed.Client(client, timeout=PATIENCE, set_as_default=False)
    except Exception as error:  # the errors of distributed for odd addresses are undocumented
        raise FileError(f"{client}: no dask scheduler answers ({error})") from None
    with there:
        yield there
