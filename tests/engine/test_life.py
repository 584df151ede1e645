"""The queue that the cells of a batch share."""

from typing import Any

import numpy as np
import pytest
from support.kernels import threads

from sweep.config import load_config
from sweep.engine import life
from sweep.engine.cells import COMPANION, RUN, Lives
from sweep.engine.plan import plan
from sweep.kernels.kernel import Kernel


def lives_of(**scene: Any) -> list[Lives]:
    return life.begin(plan(load_config({"name": "lives", **scene})).parts)


MAP = {
    "body": {"a": 10.0, "b": {"start": 2, "stop": 9, "num": 8}, "delta": 0.03},
    "friction": {"mu": {"start": 40, "stop": 80, "num": 8}},
    "start": {"n0": 0.05, "x0": 0.01, "y0": 0.01},
    "integrator": {"method": "adams"},
}


def test_progress_counts_the_work() -> None:
    """A bar that is at 60 % has 60 % of the steps behind it, once enough runs have ended to guess the others by."""
    lives, done, shares = lives_of(**MAP), [0.0], list[tuple[float, float]]()
    plain = Kernel.advance

    def advance(kernel: Kernel, images: np.ndarray, *rest: Any) -> int:
        before = kernel.table(images)["done"].sum()
        blocks = plain(kernel, images, *rest)
        done.append(done[-1] + kernel.table(images)["done"].sum() - before)
        return blocks

    with threads(1), pytest.MonkeyPatch.context() as patch:
        patch.setattr(Kernel, "advance", advance)
        patch.setattr("sweep.engine.executor._rescale", lambda *_: 100)  # chunks that do not depend on the machine
        life.live(lives, lambda: shares.append((done[-1], life.progress(lives)[0] / 64)))
    work, told = np.array(shares).T
    work /= done[-1]
    assert len(work) > 20
    assert told[-1] == pytest.approx(1.0)
    assert np.abs(told - work)[work > 0.5].max() < 0.1


def test_companions_run_beside_the_first_runs_of_others() -> None:
    lives, beside = lives_of(**MAP), list[bool]()

    def look() -> None:
        (each,) = lives
        beside.append(bool((each.stage == RUN).any() and (each.stage == COMPANION).any()))

    with threads(1), pytest.MonkeyPatch.context() as patch:
        patch.setattr("sweep.engine.executor._rescale", lambda *_: 100)
        life.live(lives, look)
    assert any(beside)
