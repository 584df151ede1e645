"""What a tile costs beside its computation when workers of a dask scheduler run it, by `sweep.engine.cluster` itself.

    python scripts/cluster_costs.py [WORKERS]

Workers of this machine, by default 8, answer at once: with tiles of no bytes, which is what scheduler and network cost
of each, and with tiles as large as those of a run of 10⁹ cells, which are kept as files.
"""

from __future__ import annotations

import pickle
import sys
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import Any

import distributed

from sweep.config import Config, load_config
from sweep.engine import local
from sweep.engine.cluster import Cluster
from sweep.engine.local import Done
from sweep.engine.run import tile_size
from sweep.results.checkpoint import Checkpoint
from sweep.results.provenance import identify

CELLS = tile_size(10**9)
CONFIG = Path(__file__).parent.parent / "configs" / "mu_b.yaml"


def answer(arrays: dict[str, Any], _: Config, __: object, batch: list[int]) -> list[Done]:
    return [(batch[0], arrays)]


def replace_work(arrays: dict[str, Any]) -> None:
    """In a worker: answer with `arrays` instead of running a tile."""
    from sweep.engine import cluster

    cluster.run_batch = partial(answer, arrays)  # type: ignore[assignment]


def main(workers: int = 8) -> None:
    config = load_config(CONFIG, {"t_end": 20, "mu": list(range(1, 1 + CELLS)), "b": 3, "n0": 0.05})
    grid = config.grid
    tiles = grid.tiles(CELLS)
    ((_, real),) = local.run_batch(config, tiles, [0])
    print(f"bytes a cell on the way: {len(pickle.dumps(real)) / grid.size:.0f}")
    with (
        distributed.LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None) as there,
        distributed.Client(there) as client,
        tempfile.TemporaryDirectory() as folder,
    ):
        store = Checkpoint(Path(folder) / "store", identify(config), print)
        for name, arrays, number in (("no bytes", {}, 500), ("a whole tile", real, 100)):
            client.run(replace_work, arrays)
            began, used = time.perf_counter(), time.process_time()
            for done in Cluster(client).run(config, tiles[:1] * number, range(number)):
                if done[1]:
                    store.save(*done)
            rate, busy = number / (time.perf_counter() - began), (time.process_time() - used) / number
            print(f"{name}: {rate:.0f} tiles a second; scheduler, client and store {1e3 * busy:.1f} ms for each")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
