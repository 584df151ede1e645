"""A cell that is called settled has had its last reversal."""

import numpy as np
import pytest
from support import ROOT, wide_bodies
from support.runs import settled

import sweep
from sweep.models import MODELS
from sweep.models.theory import stability


@pytest.mark.parametrize("method", ["dopri5", "adams"])
def test_nearly_round_bodies_do_not_settle_ahead_of_a_reversal(method: str) -> None:
    """Cells of the reference whose second reversal comes while upright spin is stable and the rattle is small."""
    table = np.genfromtxt(ROOT / "data" / "reference_counts_500.csv", delimiter=",", names=True, dtype=None)
    rows = [i for i, b in enumerate(table["b"]) if b in (8.34943, 8.85002, 8.91708)]
    assert list(table["reversals"][rows]) == [2, 2, 2]
    cells = {name: table[name][rows] for name in ("b", "mu", "n0")}
    ours = sweep.run({"cases": cells}, a=10.0, delta=0.03, x0=0.01, y0=0.01, method=method)
    np.testing.assert_array_equal(ours["reversals"], 2)
    np.testing.assert_allclose(ours["t_last_reversal"], table["t_last_reversal"][rows], rtol=1e-3)


def test_what_has_settled_beyond_n_c1_reverses_no_more() -> None:
    """Far beyond the paper's bodies, from 1 to 3.5 n_c1."""
    bodies, random = wide_bodies(200), np.random.default_rng(2)
    below, above = stability.stable_ranges(MODELS["slip"], bodies)[:2]
    spin = np.where(random.random(200) < 0.5, below, above) * random.uniform(1, 3.5, 200)
    cells = {name: bodies[name] for name in ("a", "b", "c", "delta", "mu")} | {"n0": spin}
    kept = np.isfinite(spin) & (np.abs(spin) < 0.5) & (np.abs(spin) > 1e-3) & (bodies["mu"] > 1)
    asked = {"cases": {name: values[kept] for name, values in cells.items()}, "max_failed_fraction": 1}
    asked |= {"start": {"x0": 0.003, "y0": 0.003}}
    asked |= {"integrator": {"method": "adams", "tolerance": 1e-7, "t_end": 10_000, "estimate_errors": False}}
    ended, _, which = settled(asked, 0.0)
    spins = ended.spin_final.values
    beyond = which & (np.abs(spins) > np.abs(np.where(spins > 0, ended.n_c1_plus_linear, ended.n_c1_minus_linear)))
    assert beyond.sum() > 10
