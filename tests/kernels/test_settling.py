"""A cell that is called settled has had its last reversal."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sweep
from sweep.bench.reference import COUNTS


@pytest.mark.parametrize("method", ["dopri5", "adams"])
def test_nearly_round_bodies_do_not_settle_ahead_of_a_reversal(method: str, tmp_path: Path) -> None:
    """Cells of the reference whose second reversal comes while upright spin is stable and the rattle is small."""
    table = np.genfromtxt(str(COUNTS), delimiter=",", names=True, dtype=None)
    rows = [i for i, b in enumerate(table["b"]) if b in (8.34943, 8.85002, 8.91708)]
    assert list(table["reversals"][rows]) == [2, 2, 2]
    names = ["b", "mu", "n0"]
    cells = np.column_stack([table[name][rows] for name in names])
    np.savetxt(tmp_path / "cells.csv", cells, delimiter=",", header=",".join(names), comments="", fmt="%.17g")
    (tmp_path / "c.yaml").write_text("cases: cells.csv\nbody: {a: 10.0, delta: 0.03}\nstart: {x0: 0.01, y0: 0.01}\n")
    ours = sweep.run(tmp_path / "c.yaml", method=method)
    np.testing.assert_array_equal(ours["reversals"], 2)
    np.testing.assert_allclose(ours["t_last_reversal"], table["t_last_reversal"][rows], rtol=1e-3)
