"""The margins of counts, and cells that are called settled, which have had their last reversal."""

import numpy as np
import pytest
import xarray as xr
from support import ROOT, wide_bodies
from support.runs import settled

import sweep
from sweep.models import MODELS
from sweep.models.theory import stability

SCENE = {
    "body": {"a": 10.0, "b": 3.0, "delta": 0.03},
    "friction": {"mu": 82.0},
    "start": {"n0": 0.05, "x0": 0.01, "y0": 0.01},
    "integrator": {"t_end": 20_000.0},
}
"""The fourth reversal begins near mu = 82.3."""


def averaged(one: xr.Dataset) -> np.ndarray:
    """The ripple-free spin of a trajectory, averaged over windows of about three periods."""
    spin = one.ripple_free_spin.values
    width = int(20 / float(one.time[1] - one.time[0]))
    return np.convolve(spin[np.isfinite(spin)], np.full(width, 1 / width), "valid")


@pytest.mark.parametrize("mu", [71.0, pytest.param(84.0, marks=pytest.mark.campaign)])
def test_margins_are_extremes_of_the_averaged_spin(mu: float) -> None:
    """The sweep leaves the first before its nearest approach; the trajectory goes on."""
    swept = sweep.run(SCENE, mu=mu)
    one = sweep.trajectory(SCENE, at={"mu": mu}, t_end=2e4, every=2.0, estimate_errors=False)
    spin = averaged(one)
    (changes,) = np.nonzero(spin[1:] * spin[:-1] < 0)
    assert len(changes) == int(swept.reversals)
    arc = np.abs(spin[changes[-1] + 1 :])
    assert float(swept.margin_fewer) == pytest.approx(arc.max(), rel=1e-2)
    assert float(swept.margin_more) == pytest.approx(arc[arc.argmax() :].min(), rel=1e-2)
    assert swept.certain == 1


def test_margins_on_both_sides_lie_on_one_line() -> None:
    found = sweep.run(SCENE, mu=[80.0, 81.0, 82.0, 83.0, 84.0])
    assert list(found.reversals) == [3, 3, 3, 4, 4]
    distance = xr.where(found.reversals == 3, -found.margin_more, found.margin_fewer)
    line = np.polynomial.Polynomial.fit(found.mu, distance, 2)
    np.testing.assert_allclose(line(found.mu.values), distance, atol=1e-2 * float(abs(distance).max()))


def test_margins_that_are_not_known_are_missing() -> None:
    found = sweep.run(SCENE, t_end=3000.0)
    assert found.sweep.time_limit
    assert np.isnan(found.margin_more)
    assert found.margin_fewer > 0
    assert found.certain == 0
    none = sweep.run(SCENE, n0=0.001)
    assert (int(none.reversals), bool(np.isnan(none.margin_fewer)), bool(none.margin_more > 0)) == (0, True, True)


def test_what_the_slow_equations_settle_stays_as_it_is() -> None:
    """Cells that have come to the time limit: most are final already, and what is called so is."""
    axes = {"mu": np.linspace(60, 200, 8), "b": np.linspace(1.6, 8.0, 8)}
    ended, later = (sweep.run(SCENE, **axes, t_end=t_end, estimate_errors=False) for t_end in (5000.0, 1e5))
    shown = (ended.sweep.settled & (ended.t_stop == 5000)).values
    assert shown.sum() >= 5
    assert (later.sweep.settled.values[shown]).all()
    np.testing.assert_array_equal(ended.reversals.values[shown], later.reversals.values[shown])
    np.testing.assert_allclose(ended.margin_more.values[shown], later.margin_more.values[shown], rtol=0.05)
    assert (later.reversals > ended.reversals).values[~shown].any()


@pytest.mark.parametrize("method", ["dopri5", "adams"])
def test_nearly_round_bodies_do_not_settle_ahead_of_a_reversal(method: str) -> None:
    """Cells of the reference whose second reversal comes while upright spin is stable and the rattle is small."""
    table = np.genfromtxt(ROOT / "data" / "reference_counts_500.csv", delimiter=",", names=True, dtype=None)
    rows = [i for i, b in enumerate(table["b"]) if b in (8.34943, 8.85002, 8.91708)]
    assert list(table["reversals"][rows]) == [2, 2, 2]
    cells = {name: table[name][rows] for name in ("b", "mu", "n0")}
    ours = sweep.run({"cases": cells}, a=10.0, delta=0.03, x0=0.01, y0=0.01, method=method, tolerance=1e-8)
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
    n_c1 = ended.n_c1_linear.sel(sign=xr.DataArray(np.where(spins > 0, 1, -1), dims="case")).values
    beyond = which & (np.abs(spins) > np.abs(n_c1))
    assert beyond.sum() > 10
