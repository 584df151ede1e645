"""What every store promises."""

from pathlib import Path

import numpy as np
import pytest

from sweep.results.checkpoint import Checkpoint
from sweep.results.provenance import Identity
from sweep.results.store import Running, Store

TILE = {
    "status": np.array([1, 2], np.int8),
    "spin_final": np.array([-0.0, np.nan]),
    "seconds": np.array(0.1),
    "cpu": np.array("zen"),
}
RUNNING = Running([4, 2], {"dopri5": np.arange(6.0).reshape(2, 3)}, 1.5)


@pytest.fixture(params=["memory", "checkpoint"])
def store(request: pytest.FixtureRequest, tmp_path: Path) -> Store:
    identity = Identity("name: x", "0" * 16, "1" * 16, "sweep 0")
    return Store() if request.param == "memory" else Checkpoint(tmp_path / "x", identity, pytest.fail)


def same(found: dict[str, np.ndarray], saved: dict[str, np.ndarray]) -> None:
    """Bit for bit."""
    assert {n: (v.dtype, v.shape, v.tobytes()) for n, v in found.items()} == {
        n: (v.dtype, v.shape, v.tobytes()) for n, v in saved.items()
    }


def test_a_tile_comes_back_as_it_was_saved_last(store: Store) -> None:
    assert not store.done
    store.save(7, {"seconds": np.array(2.0)})
    store.save(7, TILE)
    assert set(store.done) == {7}
    same(store.load(7), TILE)


def test_running_tiles_come_back_until_one_is_done(store: Store) -> None:
    assert store.load_running() is None
    store.save_running(RUNNING)
    store.save_running(RUNNING._replace(seconds=2.5))
    if isinstance(store, Checkpoint):
        found = store.load_running()
        assert found is not None
        assert (found.tiles, found.seconds) == (RUNNING.tiles, 2.5)
        same(found.tables, RUNNING.tables)
    store.save(2, TILE)
    assert store.load_running() is None
