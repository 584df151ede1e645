"""Runs tiles in other processes, of this machine or of a cluster, by dask.distributed.

Workers compute and send arrays back; the process that started the run writes them.  A worker that
dies costs the tile it was at, which another one computes again.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numba

from sweep.config import Config
from sweep.grid import Tile
from sweep.local import Done, run_group
from sweep.store import StoreError

AHEAD = 3
"""Tiles a worker that are sent out before the first is back."""


class Cluster:
    """A dask scheduler and its workers."""

    def __init__(self, client: Any) -> None:
        self.client = client

    def run(self, config: Config, tiles: Sequence[Tile], todo: Sequence[int]) -> Iterator[Done]:
        """Run the tiles `todo`, yielding them as they come back."""
        from distributed import as_completed

        shared = self.client.scatter((config, list(tiles)), broadcast=True)
        waiting = iter(todo)
        ahead = AHEAD * max(1, len(self.client.scheduler_info(n_workers=-1)["workers"]))

        def submit(i: int) -> Any:
            # Bit-identical wherever it runs, so a second go after a worker's death is safe.
            return self.client.submit(_work, shared, i, pure=False, retries=3)

        running = as_completed([submit(i) for _, i in zip(range(ahead), waiting, strict=False)])
        for future in running:
            done: Done = future.result()
            future.release()
            if (i := next(waiting, None)) is not None:
                running.add(submit(i))
            yield done


def _work(shared: tuple[Config, list[Tile]], tile: int) -> Done:
    numba.set_num_threads(1)
    config, tiles = shared
    (done,) = run_group(config, tiles, [tile])
    return done


@contextmanager
def connected(workers: int | None, scheduler: str | None) -> Iterator[Cluster | None]:
    """A local cluster of `workers` processes, the one at the address `scheduler`, or none if neither is asked for.

    Raises
    ------
    StoreError
        where dask.distributed is not installed, or no scheduler answers.
    """
    if workers is None and scheduler is None:
        yield None
        return
    try:
        import distributed
    except ImportError:
        raise StoreError("--workers and --scheduler need: pip install 'rattleback-sweep[cluster]'") from None
    if scheduler is None:
        with (
            distributed.LocalCluster(
                n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs="ERROR"
            ) as cluster,
            distributed.Client(cluster) as client,
        ):
            yield Cluster(client)
        return
    try:
        client = distributed.Client(scheduler, timeout="10s")
    except (OSError, ValueError, TimeoutError) as error:
        raise StoreError(f"{scheduler}: no dask scheduler answers ({error})") from None
    with client:
        yield Cluster(client)
