"""Samples of distributions: drawn as SciPy's quantiles say, run as cases, counted as probabilities."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy import stats
from support import Write
from support.cli import invoke, refused
from support.figures import maps
from support.runs import Heard, same_numbers

import sweep
from sweep.config.distributions import Distribution, chances, drawn
from sweep.explorer.setup import Setup
from sweep.explorer.slices import Source
from sweep.grid import CASE, SAMPLE, Grid
from sweep.kernels.status import LIFT_OFF, SETTLED
from sweep.parameters import START
from sweep.results.probabilities import interval, probabilities

SCENE = """\
name: finger
body: {a: 10, b: [2, 3], delta: 0.03}
friction: {mu: 60}
start: {n0: {normal: [0.05, 0.01]}, x0: {uniform: [0, 0.02]}, y0: 0.01}
samples: 32
integrator: {method: dopri5, t_end: 1000}
"""


@pytest.mark.parametrize(
    ("ours", "scipy"),
    [
        (Distribution("normal", -6.3, 0.3), stats.norm(-6.3, 0.3)),
        (Distribution("uniform", -1, 3), stats.uniform(-1, 4)),
        (Distribution("lognormal", 2, 0.5), stats.lognorm(0.5, scale=2)),
    ],
    ids=lambda each: getattr(each, "family", ""),
)
def test_samples_are_of_their_distribution(ours: Distribution, scipy: stats.rv_continuous) -> None:
    chance = np.linspace(0.001, 0.999, 99)
    np.testing.assert_allclose(ours.at(chance), scipy.ppf(chance), rtol=1e-12)
    assert ours.median == pytest.approx(scipy.median(), rel=1e-12)
    samples = drawn({"a": ours, "b": ours}, chances(2, 1024, 0))
    for numbers in samples.values():
        assert stats.kstest(numbers, scipy.cdf).statistic < 0.003  # of random numbers 0.03
    assert abs(np.corrcoef(*samples.values())[0, 1]) < 0.01


def test_more_samples_begin_with_the_fewer_and_another_seed_gives_others() -> None:
    known = {"n0": Distribution("normal", 0, 1), "x0": Distribution("uniform", 0, 1)}
    few, more, others = (drawn(known, chances(2, *how)) for how in ((5, 1), (300, 1), (5, 2)))
    for name in known:
        assert more[name][:5] == few[name]
        assert not set(others[name]) & set(few[name])


def test_samples_are_run_as_cases_beside_each_value_of_an_axis(write: Write) -> None:
    found = sweep.run(write(SCENE))
    assert found["status"].dims == ("b", "sample")
    cases = {"n0": found["n0"].values.tolist(), "x0": found["x0"].values.tolist()}
    for b in (2, 3):
        alone = sweep.run({"cases": cases}, a=10, b=b, delta=0.03, mu=60, y0=0.01, method="dopri5", t_end=1000)
        here = found.sel(b=b)
        for name in ("reversals", "status", "spin_final", "t_stop"):
            np.testing.assert_array_equal(alone[name], here[name])
        np.testing.assert_array_equal(alone["n_c1_linear"], np.tile(here["n_c1_linear"], (here.sizes["sample"], 1)))
    assert found["n_c1_linear"].dims == ("b", "sign")
    assert found["n0"].attrs["distribution"] == "normal, mean 0.05, standard deviation 0.01"


def test_a_probability_is_the_share_of_the_range_beyond_a_boundary(write: Write) -> None:
    """The boundaries that brackets find cut the range of a uniform start spin where its probabilities say."""
    scene = "body: {a: 10, b: 3, delta: 0.03}\nstart: {n0: %s, x0: 0.01, y0: 0.01}\nfriction: {mu: %s}\n"
    low, high, samples = 0.01, 0.07, 128
    config = write(scene % (f"{{uniform: [{low}, {high}]}}", 60) + f"samples: {samples}\n")
    found = sweep.run(config)
    curves = sweep.boundaries(write(scene % (f"{{start: {low}, stop: {high}, num: 9}}", "[60, 61]")), bracket=1e-3)
    at = curves.isel(point=np.isclose(curves["mu"], 60, rtol=1e-4))
    for count in found["count"].values:
        places = at["n0"].values[at["level"].values == count]
        if len(places) == 1:
            expected = (high - places[0]) / (high - low)
            assert found["probability"].sel(count=count).item() == pytest.approx(expected, abs=1.5 / samples)
    assert len(set(at["level"].values) & set(found["count"].values)) >= 2


def test_probabilities_are_of_the_samples_that_did_not_fail() -> None:
    status = [[SETTLED, SETTLED, LIFT_OFF, SETTLED], [LIFT_OFF] * 4]
    made = xr.Dataset({"status": (("b", "sample"), status), "reversals": (("b", "sample"), [[0, 1, 7, 2], [1] * 4])})
    share, low, high = probabilities(made).values()
    np.testing.assert_allclose(share, [[2 / 3, 1 / 3], [np.nan, np.nan]])
    for k, count in enumerate((2, 1)):
        expected = stats.binomtest(count, 3).proportion_ci(0.95, method="wilson")
        assert (low[0, k], high[0, k]) == pytest.approx((expected.low, expected.high), rel=1e-12)
    assert np.isnan(low[1]).all()


def test_intervals_of_random_samples_hold_as_often_as_they_say() -> None:
    numbers = np.random.default_rng(0).random((2000, 64))
    low, high = interval((numbers < 0.3).mean(axis=1), np.array(64))
    assert ((low <= 0.3) & (high >= 0.3)).mean() == pytest.approx(0.95, abs=0.02)


@pytest.mark.usefixtures("no_pictures")
def test_more_samples_take_over_the_fewer(write: Write, tmp_path: Path) -> None:
    more, reporter = SCENE.replace("32", "48"), Heard()
    sweep.run(write(SCENE), tmp_path)
    found = sweep.run(write(more), tmp_path, progress=reporter)
    assert reporter.notes[0].startswith("64 of 96 cells are reused")
    same_numbers(found, sweep.run(write(more)))
    assert sweep.load_config(write(found.attrs["config"])).samples == 48


def test_trajectories_of_samples_are_those_of_the_run(write: Write) -> None:
    scene = write(SCENE)
    found = sweep.run(scene, samples=5)
    seen = sweep.trajectory(scene, samples=5, b=[2, 3], every=20.0)
    assert seen.spin.dims == (*found.reversals.dims, "time") == ("b", "sample", "time")
    for name in ("reversals", "t_last_reversal", "probability"):
        xr.testing.assert_equal(seen[name].drop_vars("time", errors="ignore"), found[name])
    one = sweep.trajectory(scene, samples=3, at={"b": 2, "n0": 0.05}, t_end=10)
    assert (one.spin.dims, one.n0.item()) == (("sample", "time"), 0.05)
    all_named = {"b": 2, **dict.fromkeys(sweep.load_config(scene).distributions, 0.02)}
    assert "sample" not in sweep.trajectory(scene, samples=3, at=all_named, t_end=10).coords
    medians = sweep.trajectory(scene, at={"b": 2}, t_end=10)
    assert (medians["n0"].item(), medians["x0"].item(), medians.spin.dims) == (0.05, 0.01, ("time",))
    with pytest.raises(sweep.InputError, match="samples: needs a parameter that is a distribution"):
        sweep.trajectory({"friction": {"mu": 60}, "start": {"n0": 0.05}}, samples=3)


COLUMNS = st.lists(st.floats(-1, 1), min_size=1, max_size=4, unique=True).map(np.array)


@given(
    st.dictionaries(st.sampled_from(["mu", "b", "n0"]), COLUMNS, max_size=3),
    st.integers(1, 4),
    st.sampled_from([["x0"], ["x0", "y0"], ["x0", "delta"]]),
    st.sampled_from([CASE, SAMPLE]),
)
def test_tiles_cells_and_bodies_of_a_grid_with_a_table(
    axes: dict[str, np.ndarray], rows: int, names: list[str], row: str
) -> None:
    table = {name: np.arange(rows) + 10.0 * k for k, name in enumerate(names)}
    grid = Grid(axes, {"c": 1.0}, table, row)
    columns = grid.columns()
    assert [len(values) for values in columns.values()] == [grid.size] * len(columns)
    assert len(set(zip(*columns.values(), strict=True))) == grid.size
    tiles = grid.tiles(3)
    for name, values in columns.items():
        np.testing.assert_array_equal(np.concatenate([grid.part(tile).columns()[name] for tile in tiles]), values)
        np.testing.assert_array_equal(grid.take(np.arange(grid.size)[::-1]).columns()[name], values[::-1])
    bodies, which = grid.bodies()
    for name in set(columns) - START:
        np.testing.assert_array_equal(bodies.columns()[name][which], columns[name])
    assert row == CASE or "delta" in names or "sample" not in bodies.dims


@pytest.mark.parametrize("verb", ["critical", "boundaries"])
def test_a_search_asks_for_numbers(write: Write, verb: str) -> None:
    refused(invoke(verb, write(SCENE)), "start.n0: is a distribution, which only run can sample")


def test_bars_curves_and_maps_of_probabilities(write: Write) -> None:
    two = sweep.run(write(SCENE), t_end=1000)
    curves = sweep.plot(two).axes[0]
    assert sweep.plot(two, vmin=0.2, vmax=0.8).axes[0].get_ylim() == (0.2, 0.8)
    assert [line.get_label() for line in curves.lines][:2] == ["1 reversal or more", "2 reversals or more"]
    one = sweep.run(write(SCENE), t_end=1000, b=3)
    bars = sweep.plot(one).axes[0]
    heights = [bar.get_height() for bar in bars.patches]
    expected = np.bincount(one["reversals"].values) / 32
    np.testing.assert_allclose(heights, expected, atol=1e-12)
    panels = sweep.plot(two, x="count").axes
    assert [axes.get_xlabel() for axes in panels] == ["", "spin reversals"]
    for axes, here in zip(panels, two["reversals"].values, strict=True):
        expected = np.bincount(here, minlength=two.sizes["count"] + 1) / 32
        np.testing.assert_allclose([bar.get_height() for bar in axes.patches], expected, atol=1e-12)
    several = sweep.run(write(SCENE), t_end=300, b=np.linspace(2, 6, 5), mu=np.linspace(40, 200, 5), samples=4)
    assert len(maps(sweep.plot(several))) == min(several.sizes["count"], 3)
    assert len(maps(sweep.plot(several, at={"count": 1}))) == 1
    source = Source(several)
    shown = source.map("probability", "b", "mu", {"sample": 2, "count": 0})
    np.testing.assert_array_equal(shown.values, several["probability"].transpose("mu", "b", "count")[..., 0])
    setup = Setup(source)
    assert setup.config.parameters["n0"].numbers == (0.05,)


@pytest.mark.parametrize("given", [True, False], ids=["in given axes", "in a figure"])
def test_the_probability_of_a_chosen_count(write: Write, given: bool) -> None:
    two = sweep.run(write(SCENE), t_end=1000)
    shares = (two["reversals"] >= 2).mean("sample").values

    def drawn_of(dataset: xr.Dataset) -> Axes:
        ax = Figure().subplots() if given else None
        return sweep.plot(dataset, "probability", at={"count": 2}, ax=ax).axes[0]

    (curve,) = drawn_of(two).lines
    np.testing.assert_array_equal(curve.get_ydata(), shares)
    assert curve.get_label() == "2 reversals or more"
    bars = drawn_of(two.isel(b=1))
    np.testing.assert_allclose([bar.get_height() for bar in bars.patches], [1 - shares[1], shares[1]], atol=1e-12)
    assert [text.get_text() for text in bars.get_xticklabels()] == ["fewer", "2 reversals or more"]
