"""What every store promises; a new store is one more line in `STORES`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sweep
from sweep.engine import local
from sweep.engine.local import Done
from sweep.results.checkpoint import Checkpoint
from sweep.results.identity import Identity
from sweep.results.memory import Memory
from sweep.results.store import Running, Store

IDENTITY = Identity("name: x", "0" * 16, "1" * 16, "sweep 0")

STORES: dict[str, Callable[[Path], Store]] = {
    "checkpoint": lambda folder: Checkpoint(folder / "x.checkpoint", IDENTITY, pytest.fail),
    "memory": lambda folder: Memory(),  # noqa: ARG005
}

TILE = {
    "status": np.array([1, 2], np.int8),
    "spin_final": np.array([-0.0, np.nan]),
    "seconds": np.array(0.1),
    "cpu": np.array("zen"),
}
RUNNING = Running([4, 2], {"dopri5": np.arange(6.0).reshape(2, 3)}, 1.5)


@pytest.fixture(params=STORES)
def store(request: pytest.FixtureRequest, tmp_path: Path) -> Store:
    return STORES[request.param](tmp_path)


def test_a_new_store_is_empty(store: Store) -> None:
    assert not store.done
    assert store.load_running() is None


def test_a_saved_tile_is_done_and_comes_back_bit_for_bit(store: Store) -> None:
    store.save(7, TILE)
    assert set(store.done) == {7}
    found = store.load(7)
    assert found.keys() == TILE.keys()
    for name, values in TILE.items():
        assert (found[name].dtype, found[name].shape) == (values.dtype, values.shape)
        assert found[name].tobytes() == values.tobytes()


def test_a_tile_saved_again_is_replaced(store: Store) -> None:
    store.save(0, TILE)
    store.save(0, {"seconds": np.array(2.0)})
    assert store.load(0) == {"seconds": 2.0}


def test_running_tiles_come_back_or_are_forgotten(store: Store) -> None:
    store.save_running(RUNNING)
    store.save_running(RUNNING._replace(seconds=2.5))
    found = store.load_running()
    if found is not None:
        assert (found.tiles, found.seconds) == ([4, 2], 2.5)
        assert found.tables["dopri5"].tobytes() == RUNNING.tables["dopri5"].tobytes()
    store.save(2, TILE)
    assert store.load_running() is None


def test_a_checkpoint_outlives_its_process(tmp_path: Path) -> None:
    first = STORES["checkpoint"](tmp_path)
    first.save(7, TILE)
    first.save_running(RUNNING)
    again = STORES["checkpoint"](tmp_path)
    assert set(again.done) == {7}
    assert again.load(7)["spin_final"].tobytes() == TILE["spin_final"].tobytes()
    assert again.load_running() is not None


def test_a_refined_run_in_memory_simulates_no_tile_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "map.yaml"
    path.write_text(
        "body: {b: {start: 1.5, stop: 8, num: 14}}\nfriction: {mu: {start: 20, stop: 120, num: 11}}\n"
        "integrator: {t_end: 1000}\nrefine: 2\n",
        encoding="utf-8",
    )
    run_batch, ran = local.run_batch, list[int]()

    def counted(*arguments: Any, **options: Any) -> Iterator[Done]:
        for done in run_batch(*arguments, **options):
            ran.append(done.tile)
            yield done

    monkeypatch.setattr(local, "run_batch", counted)
    sweep.run(path)
    assert len(ran) > 1
    assert sorted(ran) == list(range(len(ran)))
