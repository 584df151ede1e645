"""Cells run until their counts are final, if no end of the time is given, and count as the signs of their spins say."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from support import ROOT, STANDARD
from support.kernels import default_measures
from support.runs import in_sittings, run_cells, same_numbers

import sweep
from sweep.kernels.measures.reversals import Reversals
from sweep.kernels.status import SETTLED, TIME_LIMIT

SCENE = {
    "name": "late", "cases": {"mu": [106.09, 130, 75], "b": [2.322, 9.8, 3]}, "body": {"a": 10.0, "delta": 0.03},
    "start": {"n0": 0.05, "x0": 0.01, "y0": 0.01}, "integrator": {"tolerance": 1e-8},
}  # fmt: skip
"""The first reverses once more after t = 30 000, the second is nearly round, the third settles early."""


@pytest.fixture(scope="module")
def run() -> xr.Dataset:
    return sweep.run(SCENE)


def test_a_cell_continues_if_a_reversal_can_be_predicted(run: xr.Dataset) -> None:
    ended = sweep.run(SCENE, t_end=30_000.0)
    assert list(ended.status) == [TIME_LIMIT, TIME_LIMIT, SETTLED]
    assert list(run.status) == [SETTLED, SETTLED, SETTLED]
    assert list((run.reversals - ended.reversals).values) == [1, 0, 0]
    assert float(run.t_last_reversal[0]) > 30_000
    assert list(run.certain[1:]) == [1, 1]  # the first grew from round-off, so it depends on the CPU whether it is


def test_to_have_paused_changes_no_count(run: xr.Dataset) -> None:
    """The late reversal grows from round-off: neither its time nor the last digits of its margin are firm."""
    cases = {"mu": [106.09, 75], "b": [2.322, 3]}
    whole = sweep.run(SCENE | {"cases": cases}, t_end=1e6, method="adams", estimate_errors=False)
    np.testing.assert_array_equal(run.reversals[[0, 2]], whole.reversals)
    np.testing.assert_allclose(run.margin_more[[0, 2]], whole.margin_more, rtol=1e-3)


def test_a_strong_rattle_that_hardly_decays_does_not_let_a_cell_settle() -> None:
    """It turns the spin by more than its energy at any one time would; counts by Taylor series at 1e-13."""
    rows = [(21.2915, 13.6769, 1.66529, 0.193173, 3.79616, -0.0487141, -1.44812, -1.94482),
            (42.6078, 34.6993, 1.14081, -0.123207, 1.13196, 0.0211796, 5.01597, -2.69675)]  # fmt: skip
    cells = [dict(zip(STANDARD, row, strict=True)) for row in rows]
    found = run_cells(cells, t_end=3000.0)
    assert list(found.reversals) == [1, 3]
    assert list(found.certain) == [1, 1]
    paper = {"name": "one", "friction": {"mu": 60.0}}
    ends = [sweep.trajectory(paper, at=cell, stop_early=True, t_end=600.0) for cell in cells]
    assert [int(each.reversals) for each in ends] == [1, 3]
    begun = sweep.trajectory(paper, at=cells[0], t_end=20.0)  # where the bound on its energy would let it settle
    assert (int(begun.reversals), int(begun.status)) == (0, TIME_LIMIT)


@pytest.mark.usefixtures("short_chunks")
def test_an_interrupted_run_continues_there_too(run: xr.Dataset, tmp_path: Path) -> None:
    found, interruptions, _ = in_sittings(100, SCENE, tmp_path)
    assert interruptions > 1
    same_numbers(found, run)


@pytest.mark.campaign
def test_a_run_that_settles_at_its_first_check_is_certain() -> None:
    """Its second run, in longer steps, closes a single window before the same time."""
    found = sweep.run(ROOT / "configs" / "kane_levinson_viscous.yaml", mu=5.0, n0=0.5, method="adams")
    assert float(found.margin_more) == pytest.approx(0.5, rel=0.01)
    assert bool(found.certain)


MAPS = ["kane_levinson_coulomb", "kane_levinson_viscous", "mu", "pebble", "plastic_toy", "taps", "wooden"]


@pytest.mark.parametrize(
    "name",
    [*(pytest.param(each, marks=pytest.mark.campaign) for each in MAPS),
     pytest.param("tippe_top", marks=pytest.mark.release)],
)  # fmt: skip
def test_counts_of_shipped_configurations_are_certain(name: str) -> None:
    """Of the others, three are of nearly round bodies too, two go to a published time, and two reverse for ever."""
    found = sweep.run(ROOT / "configs" / f"{name}.yaml")
    assert float(found.certain.mean()) >= 0.98


@pytest.mark.release
@pytest.mark.parametrize("name", ["b", "quick"])
def test_nearly_round_bodies_have_settled_in_the_end(name: str) -> None:
    found = sweep.run(ROOT / "configs" / f"{name}.yaml", estimate_errors=False)
    assert found.sweep.settled.all()


@pytest.mark.campaign
@pytest.mark.parametrize("name", ["b", "mu", "quick"])
def test_no_certain_count_contradicts_the_spin(name: str) -> None:
    found = sweep.run(ROOT / "configs" / f"{name}.yaml")
    odd = np.sign(found.n0) * np.sign(found.spin_final) != (-1.0) ** found.reversals
    assert not (odd & (found.certain == 1)).any()
    assert (found.certain == 1).sum() > 20


def test_settled_trajectories_stay_where_predicted() -> None:
    settings: dict[str, Any] = {"b": [2.0, 3.0], "mu": [40, 70], "n0": 0.05, "x0": 0.01, "y0": 0.01}
    settings |= {"t_end": 30_000, "method": "adams", "measure": list(default_measures("slip"))}
    quick = ROOT / "configs" / "quick.yaml"
    left, later = (sweep.run(quick, **settings, stop_early=stops) for stops in (True, False))
    settled = left.sweep.settled.values
    rest, end = left.spin_rest.values, later.spin_final.values
    # Beyond n_c1 a rattle grows, and turns the spin back, before it decays.
    n_c1 = left.n_c1_linear.sel(sign=np.sign(left.spin_final).astype(int))
    grows = (left.spin_final / n_c1 > 1).values
    assert min((settled & grows).sum(), (settled & ~grows).sum()) >= 2
    assert (np.abs(rest / end - 1) < np.where(grows, 4e-3, 1e-3))[settled].all()
    assert np.abs(left.spin_final.values / end - 1)[settled].max() > 0.01
    assert np.isnan(rest[~settled]).all()


def test_what_is_left_of_a_rattle_may_turn_a_spin_that_a_couple_slows() -> None:
    """It settled at t = 26, and its spin reverses at t = 2175.  A weak couple does not keep a cell from settling."""
    body = {"a": 2.34302, "b": 1.04662, "delta": -0.01263}
    scene = {"body": body, "friction": {"mu": 750.3, "sigma": 0.01134}, "start": {"x0": 0.02637, "y0": 0.01432}}
    swept, whole = (sweep.run(scene, n0=-0.06944, t_end=3000.0, stop_early=ends) for ends in (True, False))
    assert (int(swept.reversals), int(whole.reversals), int(swept.certain)) == (1, 1, 0)
    weak = sweep.run({"friction": {"mu": 60, "sigma": 1e-4}, "start": {"n0": 0.02}})
    assert (int(weak.status), int(weak.certain)) == (SETTLED, 1)


def test_the_end_of_a_rattle_that_outlasts_the_spin_is_predicted() -> None:
    """The couple takes the spin within a hundred units of time, and the rattle decays in thousands."""
    scene = {"friction": {"mu": 120, "sigma": 0.1}, "body": {"b": [2.0, 3.0, 5.0, 8.0]}, "start": {"n0": 0.05}}
    found, later = sweep.run(scene), sweep.run(scene, stop_early=False, t_end=1e5)
    assert (found.certain == 1).all()
    np.testing.assert_array_equal(found.reversals, later.reversals)
    assert (abs(found.spin_final) < 1e-3 * 0.05).all()


@pytest.mark.campaign
def test_no_count_of_a_body_that_a_couple_slows_is_certain_too_early() -> None:
    random = np.random.default_rng(20261127)
    size = 150

    def log(low: float, high: float) -> np.ndarray:
        return np.exp(random.uniform(np.log(low), np.log(high), size))

    a, signs = log(2, 15), random.choice([-1, 1], size)
    cells = {
        "a": a, "b": 1 + (a - 1) * random.uniform(0.02, 0.98, size), "c": np.ones(size),
        "delta": signs * log(0.005, 0.3), "sigma": log(1e-4, 3), "mu": log(50, 5000),
        "n0": random.uniform(-0.15, 0.15, size), "x0": random.uniform(-0.03, 0.03, size),
        "y0": random.uniform(-0.03, 0.03, size),
    }  # fmt: skip
    scene = {"cases": {name: values.tolist() for name, values in cells.items()}}
    swept, whole = sweep.run(scene, t_end=10_000.0), sweep.run(scene, stop_early=False, t_end=40_000.0)
    certain = swept.certain == 1
    assert int(certain.sum()) > 80
    assert (swept.reversals == whole.reversals).values[certain].all()


NEARLY_ROUND = {
    "body": {"a": 10.0, "b": (1 + np.logspace(-6, -2, 5)).tolist(), "delta": 0.03},
    "friction": {"mu": 100.0},
    "start": {"n0": 0.05, "x0": 0.01, "y0": 0.01},
    "integrator": {"tolerance": 1e-8},
}

TOO_EARLY = {
    (47.2841434079, 15.8501878478, 0.911245356655, 0.267442320328, 0.207115063054,
     -0.164575311323, -2.21633302516, -1.27952228851): 1686.95,
    (42.483166, 15.700788, 0.78415991, 0.13288258, 0.21073119, -0.18987983, 1.7206681, 1.5158422): 2411.47,
    (41.067662, 20.796681, 1.8073354, 0.19627002, 1.2663982, -0.16939016, 4.0267689, -1.8686359): 238.84,
}  # fmt: skip
"""Bodies with little friction that settled before their spin reversed, and when it does (heyoka.py, Taylor series)."""


def test_the_spin_of_a_nearly_round_body_reverses_once() -> None:
    """Its slower mode has a period that outlasts the motion."""
    found = sweep.run(NEARLY_ROUND, b=NEARLY_ROUND["body"]["b"][:4])
    assert found.reversals.values.tolist() == [1, 1, 1, 1]
    assert (found.spin_final < 0).all()
    assert (found.certain == 1).all()


QUICK = [
    (16.01224245, 1.00001705246, 0.124096559, 160.139144, 0.0768349043),
    (16.88874322, 1.00007295056, 0.227001132, 52.5499891, 0.0832656665),
    (13.92985626, 1.00236734583, 0.193787675, 57.6504173, 0.0846982491),
    (18.54757716, 1.00270211820, 0.211952389, 565.948581, 0.0740555402),
]
"""Bodies whose spin reverses within a few periods of the faster mode: (a, b, δ, μ, n0)."""


def test_a_reversal_within_the_first_window_counts() -> None:
    """The sign of the spin at the end differs from that at the start, so the count is odd."""
    cells = [dict(zip(("a", "b", "delta", "mu", "n0"), cell, strict=True)) for cell in QUICK]
    found = run_cells(cells)
    assert (found.spin_final < 0).all()
    assert (found.reversals == 1).all()
    assert (found.t_last_reversal > 0).all()


SLOW_RIPPLE = {
    "a": 38.2869031353, "b": 1.34495088526, "c": 0.732594252927, "delta": 0.415215784635, "mu": 1.02181473458,
    "n0": -0.055030349582, "x0": 0.742100712613, "y0": -0.122584293316,
}  # fmt: skip
"""The periods of its modes differ by a factor of 96, and its spin passes slowly through zero, with ripples of half the
slower period."""


@pytest.mark.parametrize("method", ["adams", pytest.param("dopri5", marks=pytest.mark.campaign)])
def test_ripples_of_a_slow_mode_are_not_counted(method: str) -> None:
    cell = {"cases": {name: [value] for name, value in SLOW_RIPPLE.items()} | {"sigma": [2.57275e-6]}}
    found = sweep.run(cell, method=method)
    assert (found.reversals.item(), found.certain.item()) == (1, 1)


def test_a_count_of_the_wrong_parity_is_not_certain(monkeypatch: pytest.MonkeyPatch) -> None:
    start = Reversals.start
    monkeypatch.setattr(Reversals, "start", lambda *args: {**start(*args), "first_spin": 0.0})
    found = sweep.run(NEARLY_ROUND, b=1.00001)
    assert (found.reversals.item(), found.spin_final.item() < 0, found.certain.item()) == (0, True, 0)


@pytest.mark.campaign
@pytest.mark.parametrize(("cell", "reverses"), TOO_EARLY.items())
def test_a_rattle_that_hardly_decays_does_not_settle(cell: tuple[float, ...], reverses: float) -> None:
    found = sweep.run({}, **dict(zip(STANDARD, cell, strict=True)))
    assert found.reversals.item() == 1
    assert found.t_last_reversal.item() == pytest.approx(reverses, rel=0.01)
