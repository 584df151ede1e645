"""Fits to films that another derivation has made, their intervals, and laws of friction compared by them.

A fit takes thousands of trajectories.  Two fits are of real ones: two parameters, and two laws.  What a fit makes of
its film does not depend on where curves come from, and is tested with those of a formula.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, cast, get_args
from unittest.mock import Mock, patch

import numpy as np
import pytest
import xarray as xr
from scipy import stats
from scipy.integrate import solve_ivp
from support import ROOT, Write, adaptive, columns, films, newton
from support.cli import invoke
from support.physics import turned_inertia

import sweep
from sweep.config import InputError
from sweep.config.film import Film, read
from sweep.explorer.slices import Source
from sweep.faults import FileError
from sweep.kernels.samples import Seen, sampled
from sweep.models import MODELS
from sweep.models.ladder import slip
from sweep.models.model import stack, take
from sweep.plots.fit import draw
from sweep.studies.concurrent import run_concurrently
from sweep.studies.filmed import shown
from sweep.studies.intervals import intervals
from sweep.studies.misfit import UNKNOWNS, Minimum, Problem, minimise
from sweep.studies.ranges import Range
from sweep.studies.verdict import judged

SCENE = "name: scene\nfriction: {mu: [30, 100]}\nstart: {n0: [0.03, 0.07], x0: 0.01, y0: 0.01}\n"
STONE = """\
units: SI
body: {a: 0.2, b: 0.03, c: 0.02, offset: 0.01, mass: 1.0, Ixx: 2.0e-4, Iyy: 1.6e-3, Izz: 1.7e-3, Ixy: -2.0e-5}
friction: {law: coulomb, mu: [0.1, 0.9], speed: [0.2, 1.5]}
start: {n0: 5, x0: 2.0e-3, y0: 2.0e-4}
integrator: {t_end: 2}
"""
ROCKED = {"n0": -5.0, "x0": 0.01, "y0": 1e-3}
TRUTH = {"mu": 55.0, "n0": 0.052}
NOISE = 0.001


def noisy(values: np.ndarray, noise: float = NOISE) -> np.ndarray:
    return np.asarray(values + np.random.default_rng(1).normal(0, noise, values.shape))


TIMES = np.arange(0, 150, 0.5)


@pytest.fixture(scope="module")
def seen() -> np.ndarray:
    """Spins of a body that reverses, by SciPy's DOP853, with noise."""
    body = columns(**TRUTH)
    *states, _ = adaptive.motion(body, TIMES, rtol=1e-10, atol=1e-13)
    return noisy(slip.MODEL.rhs(tuple(states), take(slip.MODEL.constants.of(body), 0))[1][0])


def formula(t: np.ndarray, *, n0: Any, x0: Any = 0.01, y0: Any = 0.01, **body: Any) -> np.ndarray:
    """A spin that depends on all that is fitted here, and is steady at an upright start or without friction."""
    b, delta, sigma, mu = (
        body.get(name, usual) for name, usual in (("b", 3.0), ("delta", 0.03), ("sigma", 0), ("mu", 1))
    )
    rocks = 2 * x0**2 / (x0**2 + 1e-4) * ("mu" in body)
    tilt = 2 * x0 * y0 / (x0**2 + 1e-4) - rocks
    turned = np.cos(np.pi * t / mu) - 1 + 20 * (delta - 0.03) * np.sin(t / 25) + (b - 3) * t / 150
    return np.asarray(n0 * (1 + rocks * turned + 0.2 * tilt * np.sin(t / 40)) * np.exp(-sigma * t))


FORMULA = noisy(formula(TIMES, **TRUTH))
"""The film of that, with noise."""


@pytest.fixture
def by_formula(monkeypatch: pytest.MonkeyPatch) -> None:
    draw_by_formula(monkeypatch)


def draw_by_formula(monkeypatch: pytest.MonkeyPatch) -> None:
    """Put curves of the formula in the place of those of trajectories."""

    def curves(problem: Problem, places: np.ndarray, times: np.ndarray, steps: Any = None) -> np.ndarray:  # noqa: ARG001
        columns = {name: each[:, None] for name, each in (problem.columns(places) | problem._found(places)).items()}
        problem.trajectories += len(places)
        late, bias = (columns.pop(name, 0.0) for name in UNKNOWNS)
        return formula(times + late, **columns) + bias

    monkeypatch.setattr(Problem, "curves", curves)


def posed(config: sweep.Config, film: Film, **ranges: tuple[float, float]) -> Problem:
    """A film all of whose instants count, and the ranges of what is free."""
    free = {name: Range.even(*each) for name, each in ranges.items()}
    return Problem(config, film, free, np.ones(len(film.time), bool))


def heading(body: Mapping[str, np.ndarray], law: str, start: np.ndarray, times: np.ndarray) -> np.ndarray:
    """How far the x axis of a body has turned, seen from above, by Newton and Euler."""
    turned, roll, pitch, *_ = newton.pose(
        start, {name: float(value[0]) for name, value in body.items()}, law, times, 1e-8
    )
    return np.asarray(turned - np.arctan(np.sin(roll) * np.tan(pitch)))


@pytest.fixture(scope="module")
def of_formula(kept: Write) -> xr.Dataset:
    """The fit of the film of the formula."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        draw_by_formula(monkeypatch)
        return sweep.fit(kept(SCENE), Film(TIMES, FORMULA), ["mu", "n0"])


@pytest.fixture(scope="module")
def found(seen: np.ndarray, kept: Write) -> xr.Dataset:
    return sweep.fit(kept(SCENE), Film(TIMES, seen), ["mu", "n0"])


def test_samples_are_those_of_a_trajectory() -> None:
    cells = {**columns(mu=[60.0, 20.0, 100.0]), "b": np.array([3.0, 2.0, 6.0])}
    times = np.sort(np.append(np.random.default_rng(0).uniform(0, 100, 50), 100.0))
    spins = sampled(MODELS["slip"], cells, np.array([0.02, 0.02, 0.01]), times)
    for i in range(3):
        body = {name: values[[i % len(values)]] for name, values in cells.items()}
        assert spins[i, -1] == pytest.approx(adaptive.spin(body, 100.0), abs=1e-9)
    many = {name: np.resize(values, 40) for name, values in cells.items()}
    again = sampled(MODELS["slip"], many, np.full(40, 0.01), times)
    np.testing.assert_array_equal(again[2::3], np.broadcast_to(spins[2], (13, 51)))


def test_a_body_that_lifts_off_has_no_spin_from_then_on() -> None:
    cells = columns(n0=[0.05, 5.0], x0=[0.01, 5.0])
    spins = sampled(MODELS["slip"], cells, np.full(2, 0.01), np.arange(0, 50, 0.5))
    assert np.isfinite(spins[0]).all()
    assert np.isnan(spins[1, -1])


def test_the_truth_is_found_and_lies_in_the_intervals(found: xr.Dataset, seen: np.ndarray) -> None:
    assert found.parameter.values.tolist() == ["mu", "n0"]
    true = np.array(list(TRUTH.values()))
    assert np.all((found.lower_95 < true) & (true < found.upper_95))
    assert np.all((found.lower_95 < found.lower_68) & (found.upper_68 < found.upper_95))
    assert np.all((found.upper_95 - found.lower_95) / true < [0.2, 0.01])
    assert found.attrs["root_mean_square"] == pytest.approx(NOISE, rel=0.1)
    assert not found.attrs["undetermined"]
    assert found.lower_95.attrs["long_name"] == "lower end, 95 % confidence"
    np.testing.assert_array_equal(found.seen, seen)


@pytest.mark.usefixtures("by_formula")
def test_an_interval_ends_where_the_misfit_has_risen_by_a_quantile(write: Write) -> None:
    """Of one parameter alone the profile is the misfit itself."""
    film = Film(TIMES, FORMULA, np.full(len(TIMES), NOISE))
    found = sweep.fit(write(SCENE), film, ["mu"], n0=TRUTH["n0"])
    problem = posed(sweep.load_config(write(SCENE), {"n0": TRUTH["n0"]}), film, mu=(40.0, 70.0))

    def misfit(mu: float) -> float:
        return float(np.sum(problem.residuals(np.log([[mu / 40]]) / np.log(70 / 40), len(TIMES)) ** 2))

    least = misfit(found.value.item())
    assert found.misfit[0].item() == pytest.approx(least, rel=1e-6)
    for level, rise in ((68, 1.0), (95, 3.84)):
        for side in ("lower", "upper"):
            assert misfit(found[f"{side}_{level}"].item()) - least == pytest.approx(rise, rel=0.06)


Curve = Callable[[np.ndarray, np.ndarray], np.ndarray]


class Toy(Problem):
    """A problem in shares of two ranges, the residuals of which are those of a formula: film - curve(places, times)."""

    curve: Curve
    turned: list[int]

    @property
    def mirrored(self) -> list[int]:
        return self.turned

    def answers(self, places: Any, *_: Any) -> Any:
        return iter([self.film.value - self.curve(each, self.film.time) for each in places])


def linear(places: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Two parameters that are tied: their columns have a correlation of 0.9."""
    columns = np.stack([np.cos(turns), 0.9 * np.cos(turns) + 0.44 * np.sin(turns)])
    return np.asarray((places - 0.5) @ columns)


def twofold(places: np.ndarray, _: np.ndarray) -> np.ndarray:
    """Two valleys, at 0.3 and 0.7, the second of which is shallower by a quarter; a wall of 16 stands between them."""
    x, y = places.T
    return np.stack([100 * ((x - 0.5) ** 2 - 0.04), (x - 0.3) / 0.8, 50 * (y - 0.5 * x)], axis=1)


def opposite(places: np.ndarray, _: np.ndarray) -> np.ndarray:
    """A start at (0.7, 0.7), which half a turn takes to the same motion at (0.3, 0.3)."""
    x, y = (places - 0.5).T
    return np.stack([100 * (x * y - 0.04), 100 * (x**2 - 0.04)], axis=1)


def toy(curve: Curve, value: np.ndarray, error: float | None) -> Toy:
    times = np.linspace(0, 20, len(value))
    free = {name: Range(0.0, 1.0, 1e9) for name in ("mu", "n0")}
    film = Film(times, value, None if error is None else np.ones(len(value)))
    problem = Toy(cast("sweep.Config", None), film, free, np.ones(len(value), bool))
    problem.curve, problem.turned = curve, [0, 1] if curve is opposite else []
    return problem


def found_near(problem: Toy, *places: list[float]) -> list[Minimum]:
    return run_concurrently([partial(minimise, place=np.array(place)) for place in places], problem.answers)


@pytest.mark.release
def test_intervals_hold_as_many_truths_as_they_say() -> None:
    """Of noise that the film does not tell; 200 films, so that a share has a standard error of 3 and 2 %."""
    random, held = np.random.default_rng(7), []
    for _ in range(200):
        problem = toy(linear, random.normal(0, 0.1, 40), None)
        _, limits, _ = intervals(problem, found_near(problem, [0.5, 0.5]), lambda _: None)
        held.append((limits[:, 0] < 0.5) & (limits[:, 1] > 0.5))
    shares = np.mean(held, axis=0)
    np.testing.assert_allclose(shares, [[0.683] * 2, [0.95] * 2], atol=0.07)
    np.testing.assert_allclose(shares[1], 0.95, atol=0.04)


@pytest.mark.parametrize("what", ["spin", "heading"])
def test_intervals_of_a_short_film_are_those_of_a_regression(what: Seen) -> None:
    """Of a line through eight rows, by Student's t: where a heading is counted from is not seen, but found as well."""
    times = np.linspace(0, 20, 8)
    value = 0.03 * times + np.random.default_rng(2).normal(0, 0.1, 8)
    if what == "heading":
        problem = toy(lambda places, t: places[:, :1] * (t - t.mean()), value - value.mean(), None)
        problem.film, problem.free = replace(problem.film, what="heading"), {"n0": problem.free["n0"]}
    else:
        problem = toy(lambda places, t: places[:, :1] * t + places[:, 1:] - 0.5, value, None)
    best, limits, _ = intervals(problem, found_near(problem, [0.5] * len(problem.free)), lambda _: None)
    line = stats.linregress(times, value)
    assert best.place[0] == pytest.approx(line.slope)
    for (low, high), share in zip(limits[..., 0], (0.6827, 0.95), strict=True):
        half = line.stderr * stats.t.isf((1 - share) / 2, 6)
        assert [low, high] == pytest.approx([line.slope - half, line.slope + half], abs=0.003 * half)


def test_an_interval_holds_other_minima_that_fit_as_well() -> None:
    """A wall beside the best one hides the second from its profile."""
    problem = toy(twofold, np.zeros(3), 1.0)
    minima = found_near(problem, [0.3, 0.15], [0.7, 0.35])
    assert [each.misfit for each in minima] == pytest.approx([0, 0.25], abs=0.01)
    best, limits, _ = intervals(problem, minima, lambda _: None)
    assert best.place == pytest.approx([0.3, 0.15], abs=1e-3)
    for low, high in limits:
        assert low[0] < 0.3 < 0.69 < high[0]
        assert low[1] < 0.15 < 0.34 < high[1]


def test_the_intervals_of_a_curve_that_is_not_believed_are_linear() -> None:
    """About the lower of two minima, which a rough scan finds."""
    problem = toy(lambda places, t: twofold(places, t) * [1, 20, 1], np.zeros(3), 1.0)
    best, limits, _ = intervals(problem, found_near(problem, [0.7, 0.35]), lambda _: None, lambda _: False)
    assert best.place == pytest.approx([0.3, 0.15], abs=1e-3)
    spread = np.diag(np.linalg.inv(best.jacobian.T @ best.jacobian))
    np.testing.assert_allclose(limits[1, 1] - limits[1, 0], 2 * np.sqrt(3.84 * spread))


def test_a_right_curve_of_many_parameters_in_a_short_film_is_hardly_ever_refused() -> None:
    """One in 500 by construction; chi square for Ljung and Box's sum would refuse 2 %."""
    times, random = np.linspace(-1, 1, 83), np.random.default_rng(5)
    columns = np.polynomial.legendre.legvander(times, 8)
    basis, free = np.linalg.qr(columns)[0], {f"p{i}": Range(0.0, 1.0, 1e9) for i in range(9)}
    problem = Problem(cast("sweep.Config", None), Film(times, times), free, np.ones(83, bool))

    def fits(values: np.ndarray) -> bool:
        away = values - basis @ basis.T @ values
        return judged(problem, Minimum(np.full(9, 0.5), float(away @ away), columns, away)).fits

    assert sum(fits(random.normal(size=83)) for _ in range(400)) >= 397
    assert not any(fits(random.normal(size=83) + 1.5 * np.sin(30 * times)) for _ in range(10))


@pytest.mark.release
@pytest.mark.parametrize("places", [[[0.7, 0.35]], [[0.7, 0.35], [0.3, 0.15]]], ids=["other valley", "both"])
def test_intervals_of_two_valleys_hold_as_many_truths_as_they_say(places: list[list[float]]) -> None:
    """Also where the search did not find the valley of the truth; 60 films, so that shares have errors of 6 and 3 %."""
    random, truth, held = np.random.default_rng(3), np.array([0.3, 0.15]), []
    for _ in range(60):
        problem = toy(twofold, random.normal(0, 1, 3), 1.0)
        minima = sorted(found_near(problem, *places), key=lambda each: each.misfit)
        _, limits, _ = intervals(problem, minima, lambda _: None)
        held.append((limits[:, 0] < truth) & (truth < limits[:, 1]))
    shares = np.mean(held, axis=0)
    np.testing.assert_allclose(shares[0], 0.68, atol=0.15)
    np.testing.assert_allclose(shares[1], 0.95, atol=0.05)


def test_an_interval_of_a_start_holds_no_opposite_start_of_the_same_motion() -> None:
    problem = toy(opposite, np.zeros(2), 1.0)
    _, limits, _ = intervals(problem, found_near(problem, [0.7, 0.7]), lambda _: None)
    assert (limits > 0.5).all()
    assert (limits[:, 0] < 0.7).all()
    assert (limits[:, 1] > 0.7).all()


@pytest.mark.parametrize(
    "what", [pytest.param(each, marks=[pytest.mark.campaign] * (each == "gyroscope")) for each in get_args(Seen)]
)
def test_a_film_of_the_true_body_is_reproduced(write: Write, what: Seen) -> None:
    """By another derivation and integrator, with delay and bias; a heading counts from anywhere, and wraps."""
    cell = (config := sweep.load_config(write(STONE), {"mu": 0.3, "speed": 0.5, **ROCKED})).grid.columns()
    start, true = stack(config.equations.start(cell))[:, 0], {"film_delay": 0.05, "film_bias": 0.3}
    times = np.arange(0, 1, 1 / 60)
    body, law = {name: float(value[0]) for name, value in cell.items()}, "coulomb"
    late = np.append(0, times + true["film_delay"])
    y = newton.follow(start, body, law, late)
    if what == "heading":
        del true["film_bias"]
        value = heading(cell, law, start, late)[1:]
        angles = np.degrees(value + 2) % 360
        rows = "".join(f"{time!r},{angle!r}\n" for time, angle in zip(times.tolist(), angles.tolist(), strict=True))
        film = read(write(f"time (s),heading (deg)\n{rows}", "film.csv"))
        assert np.ptp(film.value) == pytest.approx(np.ptp(value))
    else:
        value = (newton.spin(y) if what == "spin" else -y[4])[1:] + true["film_bias"]
        film = Film(times, value, what=what)
    problem = posed(config, film, **{name: (each, 2 * each) for name, each in true.items()})
    away = problem.residuals(np.zeros((1, len(true))), len(times))
    np.testing.assert_allclose(away, 0, atol=1e-6)
    assert np.ptp(value) > 0.1


def test_a_heading_is_what_a_camera_sees_of_the_long_axis(write: Write) -> None:
    """Not an Euler angle, which differs from it by 0.01 rad at this tilt."""
    config = sweep.load_config(write(STONE), {"mu": 0.3, "speed": 0.5, "n0": 5.0, "x0": 0.12, "y0": 4e-3})
    cell, times = config.grid.columns(), np.arange(0, 0.25, 1 / 60)
    p = {name: float(value[0]) for name, value in cell.items()}
    seen = films.heading(p, "coulomb", {"n0": 5.0, "x0": 0.12, "y0": 4e-3}, times)
    assert seen is not None
    problem = posed(config, Film(times, seen, what="heading"), mu=(0.3, 0.4))
    np.testing.assert_allclose(problem.residuals(np.zeros((1, 1)), len(times)), 0, atol=1e-6)
    turned, roll, pitch, *_ = newton.pose(stack(config.equations.start(cell))[:, 0], p, "coulomb", times, 1e-8)
    assert np.hypot(roll, pitch).max() > 0.1
    assert np.ptp(turned - seen) > 0.01


@pytest.mark.usefixtures("by_formula")
def test_what_the_film_does_not_determine_is_reported(write: Write) -> None:
    """A body that spins upright shows no friction."""
    found = sweep.fit(write(SCENE), Film(TIMES, noisy(np.full(len(TIMES), 0.05))), ["mu", "n0"], x0=0.0, y0=0.0)
    assert found.attrs["undetermined"].startswith("the film hardly determines mu: the 95 %")
    assert [found[f"{side}_95"].values[0] for side in ("lower", "upper")] == pytest.approx([30, 100])
    assert abs(found.value.values[1] - 0.05) < 1e-3


@pytest.mark.usefixtures("by_formula")
def test_a_steady_spin_cannot_be_distinguished_from_the_bias_of_a_gyroscope(write: Write) -> None:
    times = np.arange(0, 2, 1 / 60)
    film = Film(times, noisy(np.full(len(times), 5.3), 0.02), what="gyroscope")
    upright = {"n0": [4.5, 5.5], "x0": 0.0, "y0": 0.0, "mu": 0.3, "speed": 0.5}
    found = sweep.fit(write(STONE), film, ["n0", "film_bias"], **upright)
    assert "film_bias and n0 are known only in combination" in found.attrs["undetermined"]
    assert found.value.sum().item() == pytest.approx(5.3, abs=0.01)
    assert "film_bias" not in found.attrs["config"]
    assert found.seen.attrs["long_name"] == "angular velocity about the sensor's axis"


@pytest.mark.usefixtures("by_formula")
def test_the_command_writes_what_runs_the_fitted_body(write: Write, tmp_path: Path, of_formula: xr.Dataset) -> None:
    rows = "".join(f"{time},{spin}\n" for time, spin in zip(TIMES, FORMULA, strict=True))
    film = write("time,spin\n" + rows, "film.csv")
    said = invoke("fit", write(SCENE), film, "--free", "mu,n0", "--output", tmp_path / "out")
    assert said.exit_code == 0, said.output
    assert "95 %" in said.stdout
    written = sweep.open_dataset(tmp_path / "out" / "scene_fit.nc")
    xr.testing.assert_equal(written.drop_attrs(), of_formula.drop_attrs())
    body = sweep.load_config(tmp_path / "out" / "scene_fit.yaml")
    assert body.name == "scene_fit"
    assert body.parameters["mu"].numbers[0] == written.value.values[0]
    for verb in ("info", "plot"):
        assert invoke(verb, tmp_path / "out" / "scene_fit.nc").exit_code == 0
    with pytest.raises(FileError, match="has a fit; open a dataset of run"):
        Source(written)


def test_a_right_curve_is_called_right(found: xr.Dataset) -> None:
    assert found.attrs["fits"] == 1
    assert found.attrs["noise"] == pytest.approx(NOISE, rel=0.15)
    how, known, unknown = found.attrs["verdict"].splitlines()
    assert how == "The curve fits the film: they differ by 0.00092 √(g/c) (root mean square), which is noise."
    assert re.fullmatch(r"At 95 % confidence, friction μ is 5\d\.\d .* start spin n₀ is 0\.0519 .*\)\.", known)
    assert unknown == "A film with a different start would test the law of friction."
    assert found.edge.values.tolist() == [0, 0]
    assert not found.outlier.any()


@pytest.mark.parametrize(
    ("given", "reason", "change"),
    [
        ({"delta": 0.04}, "times the noise, and in the same direction for many rows", "correct delta = 0.03"),
        ({"mu": [30.0, 48.0]}, "better values of mu lie outside the range searched", "widen the range of mu = 55"),
        ({"b": {"normal": [3.2, 0.02]}}, "b would have to be more than 3.5 errors from the meas", "correct b = 3 c"),
    ],
    ids=str,
)
@pytest.mark.usefixtures("by_formula")
def test_a_wrong_curve_is_called_wrong_and_the_change_that_it_needs_is_named(
    write: Write, given: dict[str, Any], reason: str, change: str
) -> None:
    found = sweep.fit(write(SCENE), Film(TIMES, FORMULA), ["mu", "n0"], **given)
    assert found.attrs["fits"] == 0
    assert reason in found.attrs["fits_because"]
    how, check, _ = found.attrs["verdict"].splitlines()
    assert how.startswith("The fit cannot be trusted: ")
    assert check.startswith(f"Change one thing: {change}")
    assert check.endswith("; the curve then fits.")
    if given.keys() == {"mu"}:
        assert found.edge.values.tolist() == [2, 0]


@pytest.mark.usefixtures("by_formula")
def test_outliers_are_left_out_and_widen_no_interval(write: Write, of_formula: xr.Dataset) -> None:
    spins = FORMULA.copy()
    spins[[40, 170, 250]] += [10.0, -0.05, 0.008]
    again = sweep.fit(write(SCENE), Film(TIMES, spins), ["mu", "n0"])
    assert np.flatnonzero(again.outlier).tolist() == [40, 170, 250]
    assert "; 3 outliers were left out." in again.attrs["verdict"]
    assert again.attrs["fits"] == 1
    above = draw(again).axes[0]
    (crosses,) = (line for line in above.lines if line.get_gid() == "outliers")
    low, high = above.get_ylim()
    np.testing.assert_allclose(crosses.get_ydata(), np.clip(spins[[40, 170, 250]], low, high))
    assert high < 0.1
    np.testing.assert_allclose(again.upper_95 - again.lower_95, of_formula.upper_95 - of_formula.lower_95, rtol=0.1)


@pytest.mark.usefixtures("by_formula")
def test_ranges_are_found_from_the_film(write: Write, of_formula: xr.Dataset) -> None:
    """From guesses that are far off."""
    guesses = write("friction: {mu: 5}\nstart: {n0: -3, x0: 0.01, y0: 0.01}\n", "guesses.yaml")
    again = sweep.fit(guesses, Film(TIMES, FORMULA), ["mu", "n0"])
    np.testing.assert_allclose(again.value, of_formula.value, rtol=1e-4)
    low, high = again.range_from.values[1], again.range_to.values[1]
    assert 0 < low < TRUTH["n0"] < high < 0.1


@pytest.mark.usefixtures("by_formula")
def test_what_was_measured_of_the_body_is_a_prior(write: Write) -> None:
    """A film of a body that spins upright does not depend on the body, so that what was measured stays as it was."""
    film = Film(TIMES[:100], noisy(np.full(100, 0.05)))
    found = sweep.fit(write(SCENE), film, ["n0"], mu=55, x0=0.0, y0=0.0, b={"normal": [3.0, 0.1]})
    assert found.parameter.values.tolist() == ["n0", "b"]
    one = found.sel(parameter="b")
    assert one.value.item() == pytest.approx(3.0, abs=0.01)
    assert [one.lower_68.item(), one.upper_68.item()] == pytest.approx([2.9, 3.1], abs=0.01)
    assert [one.lower_95.item(), one.upper_95.item()] == pytest.approx([2.804, 3.196], abs=0.015)


SPOILT: dict[str, tuple[Callable[[Film], Film], str]] = {
    "mirrored": (lambda film: replace(film, value=-film.value), "reverse the sign of the film"),
    "with a hand at its end": (
        lambda film: replace(film, value=np.where(film.time < 80, film.value, 0.04)), "leave out the rows after 74.8"
    ),
}  # fmt: skip
"""Films that are spoilt, and the change that they need."""


@pytest.mark.parametrize("kind", SPOILT)
@pytest.mark.usefixtures("by_formula")
def test_what_a_film_needs_is_named(write: Write, kind: str) -> None:
    spoil, change = SPOILT[kind]
    film = spoil(Film(TIMES, FORMULA))
    found = sweep.fit(write(SCENE), film, ["n0"], mu=TRUTH["mu"], delta={"normal": [0.03, 1e-4]})
    assert found.attrs["fits"] == 0
    assert change in found.attrs["verdict"].splitlines()[1]


@pytest.mark.parametrize(("delta", "believed"), [(0.036, True), (0.039, False)])
@pytest.mark.usefixtures("by_formula")
def test_a_fit_that_strains_three_sizes_is_left_for_one_change(write: Write, delta: float, believed: bool) -> None:
    """An angle that is off by several errors, which three measured numbers share, each fewer than 3.5."""
    film = Film(TIMES[:60], noisy(formula(TIMES[:60], **TRUTH, delta=delta)))
    known = {"delta": {"normal": [0.03, 1e-3]}, "b": {"normal": [3.0, 0.12]}, "y0": {"normal": [0.01, 1.6e-3]}}
    found = sweep.fit(write(SCENE), film, ["n0"], mu=TRUTH["mu"], **known)
    assert found.attrs["fits"] == believed
    if not believed:
        assert found.attrs["fits_because"] == "the film is far more likely with one change"
        assert "\nChange one thing: correct " in found.attrs["verdict"]


@pytest.mark.usefixtures("by_formula")
def test_a_film_that_no_change_mends_has_its_trials_listed(write: Write) -> None:
    film = Film(TIMES, noisy(0.05 * np.sin(TIMES**1.5 / 9)))
    found = sweep.fit(write(SCENE), film, ["mu", "n0"], n0=0.05, mu=40.0)
    said = found.attrs["verdict"].splitlines()[1]
    assert said.startswith("No single change makes it much better; tried were the unit, the sign, film_delay, ")
    assert said.endswith("and a cut.")


@pytest.mark.usefixtures("by_formula")
def test_an_interval_includes_the_error_of_what_was_measured(write: Write) -> None:
    """By the linear theory of the formula, whose derivatives are taken here."""
    times, error = TIMES[:60], 0.2
    film = Film(times, FORMULA[:60], np.full(60, NOISE))
    found = sweep.fit(write(SCENE), film, ["n0"], mu=TRUTH["mu"], b={"normal": [3.0, error]})
    up, down = (formula(times, **TRUTH, b=3 + side) for side in (1e-4, -1e-4))
    columns = np.stack([formula(times, **TRUTH) / TRUTH["n0"], (up - down) / 2e-4]) / NOISE
    spread = np.linalg.inv(columns @ columns.T + np.diag([0, error**-2]))
    widths = ((found.upper_68 - found.lower_68) / 2).values
    np.testing.assert_allclose(widths, np.sqrt(np.diag(spread)), rtol=0.04)
    assert widths[0] > 1.1 * np.linalg.norm(columns[0]) ** -1


def test_the_speed_of_a_dry_law_is_free_unless_it_is_given(write: Write) -> None:
    dry = write(SCENE.replace("mu: [30, 100]", "law: coulomb, mu: 0.3") + "integrator: {t_end: 150}\n")
    film = Film(TIMES[:60], FORMULA[:60])
    for given, free in ({}, ["n0", "speed"]), ({"speed": 0.01}, ["n0"]):
        with (
            patch("sweep.studies.search.found", side_effect=InterruptedError) as found,
            pytest.raises(InterruptedError),
        ):
            sweep.fit(dry, film, ["n0"], x0=0.0, y0=0.0, **given)
        assert list(found.call_args.args[0].free) == free


def test_the_floor_of_a_bent_valley_is_followed_in_few_steps() -> None:
    """Rosenbrock's function, a hundred times as steep."""
    asked = list[int]()

    def ask(places: np.ndarray) -> np.ndarray:
        asked.append(len(places))
        x, y = 4 * places.T - 2
        return np.stack([100 * (y - x**2), 1 - x], axis=1)

    found = minimise(ask, np.array([0.2, 0.75]))
    np.testing.assert_allclose(found.place, 0.75, atol=1e-5)
    assert sum(asked) < 400


def test_a_parameter_that_is_held_stays_and_costs_no_trajectory() -> None:
    asked = list[int]()

    def ask(places: np.ndarray) -> np.ndarray:
        asked.append(len(places))
        return places - np.array([0.3, 0.7])

    found = minimise(ask, np.array([0.4, 0.4]), fixed=[0])
    np.testing.assert_allclose(found.place, [0.4, 0.7], atol=1e-6)
    assert asked[0] == 3


def test_a_minimum_at_a_bound_is_found() -> None:
    found = minimise(lambda places: places + np.array([0.3, -0.7]), np.array([0.4, 0.4]))
    np.testing.assert_allclose(found.place, [0.0, 0.7], atol=1e-6)


@pytest.mark.usefixtures("by_formula")
def test_a_drag_is_sought_where_the_configuration_names_none(write: Write) -> None:
    """Its interval ends at zero, which is no limit of the search."""
    found = sweep.fit(write(SCENE), Film(TIMES, FORMULA), ["sigma", "n0"], mu=TRUTH["mu"])
    one = found.sel(parameter="sigma")
    assert one.lower_95.item() == 0.0 < one.upper_95.item() < 2e-4
    assert one.edge.item() == 0


@pytest.mark.usefixtures("by_formula")
@pytest.mark.parametrize("turned", [False, True])
def test_a_start_is_given_on_the_side_of_the_configuration(
    write: Write, monkeypatch: pytest.MonkeyPatch, turned: bool
) -> None:
    """Half a turn takes the body to itself; a profile may end at the opposite of the minimum that it began from."""

    def opposite(*args: Any) -> Any:
        best, limits, rugged = intervals(*args)
        return best._replace(place=1 - best.place, jacobian=-best.jacobian), 1 - limits[:, ::-1], rugged

    if turned:
        monkeypatch.setattr("sweep.studies.fit.intervals", opposite)
    found = sweep.fit(write(SCENE), Film(TIMES, FORMULA), ["x0", "y0"], **TRUTH)
    assert (found.value > 0).all()
    assert ((found.lower_95 < found.value) & (found.value < found.upper_95)).all()


def test_film_and_fit_are_shown_side_by_side(found: xr.Dataset) -> None:
    both = shown(found.isel(time=slice(60)))
    assert both.trajectory.values.tolist() == ["film", "fit"]
    film, fit = (both.sel(trajectory=name) for name in ("film", "fit"))
    np.testing.assert_allclose(film.spin, fit.spin, atol=0.006)
    np.testing.assert_allclose(film.heading, fit.heading, atol=0.1)
    assert not film.roll_angle.any()
    assert fit.roll_angle.any()


def test_an_animation_has_no_outlier_and_no_difference_that_the_film_has_not(found: xr.Dataset) -> None:
    """A sensor on a tilted body does not show its spin, so that readings of a perfect fit would differ from it."""
    part = found.isel(time=slice(60)).copy(deep=True)
    part["seen"][:] = part["fitted"] + 0.002
    part["fitted"][:], part["seen"][:] = 2 * part["fitted"], part["seen"] + part["fitted"]
    part["seen"][30], part["outlier"][30] = 9.0, True
    film, fit = (shown(part).sel(trajectory=name) for name in ("film", "fit"))
    np.testing.assert_allclose(film.spin - fit.spin, 0.002, atol=1e-12)
    np.testing.assert_allclose(film.heading - fit.heading, 0.002 * fit.time, atol=1e-9)


def test_an_animation_of_several_laws_is_that_of_the_best(of_laws: xr.Dataset) -> None:
    late = of_laws.reindex(parameter=[*of_laws.parameter.values, "film_delay"])
    late["value"].loc[{"parameter": "film_delay"}] = 0.25
    film, fit = (shown(late).sel(trajectory=name) for name in ("film", "fit"))
    best = of_laws.sel(law="coulomb")
    assert fit.time[-1] == best.time[-1] + 0.25
    off = (best.seen - best.fitted).where(~best.outlier, drop=True)
    np.testing.assert_allclose((film.spin - fit.spin)[[0, -1]], off[[0, -1]], atol=1e-12)


@pytest.mark.parametrize("laws", [(), ("viscous", "coulomb")])
def test_a_film_with_an_instant_without_a_number_is_refused(write: Write, laws: tuple[str, ...]) -> None:
    film = Film(np.arange(3.0), np.array([0.05, np.nan, 0.05]))
    with pytest.raises(InputError, match="not a number; leave out that instant"):
        sweep.fit(write(SCENE), film, ["mu"], n0=0.05, laws=laws, progress=False)


def test_degrees_taken_for_radians_are_refused_at_once(write: Write) -> None:
    """Their fit would take hours; one of the same film in radians begins."""
    times = np.linspace(0, 6, 200)
    stone = write(STONE.replace("mu: [0.1, 0.9], speed: [0.2, 1.5]", "mu: 0.3, speed: 0.01"))
    spins, free = 6.5 * np.exp(-times / 0.4), ["mu", "n0", "x0", "y0"]
    with pytest.raises(InputError, match=r"takes \S+ steps, .*; check the units of the film, which shows up to 372"):
        sweep.fit(stone, Film(times, np.degrees(spins)), free, progress=False, t_end=10)
    with patch("sweep.studies.search.found", Mock(side_effect=InterruptedError)), pytest.raises(InterruptedError):
        sweep.fit(stone, Film(times, spins), free, progress=False, t_end=10)


@pytest.mark.parametrize(
    ("free", "overrides", "words"),
    [
        (["muu"], {}, "muu is not a parameter of the slip model (did you mean mu?); these can be free: a, b"),
        ([], {}, "free: name at least one parameter"),
        (["n0"], {}, "has several values; make it free, or give one value"),
        (
            ["mu", "n0", "a"],
            {"x0": 5.0},
            "the range of a free parameter is too wide: start point off the ellipsoid at x0",
        ),
        (
            ["mu", "n0", "x0", "y0", "a", "b", "delta", "film_delay", "film_bias"],
            {},
            "free: 9 parameters, and the film",
        ),
        (["mu", "n0", "delta"], {"delta": 0.0}, "give the ends of its range as two values"),
        (["mu"], {"model": "analytic", "n0": 0.05}, "is not simulated"),
        (["mu"], {"laws": ["viscuos"]}, "laws: viscuos is not a law of friction (did you mean viscous?); "),
    ],
)
def test_what_cannot_be_fitted_is_refused(write: Write, free: list[str], overrides: dict[str, Any], words: str) -> None:
    film = Film(np.arange(9.0), np.ones(9))
    with pytest.raises(InputError) as refusal:
        sweep.fit(write(SCENE), film, free, **overrides)
    assert words in str(refusal.value)
    assert len(refusal.value.faults) == 1


DRY = "name: stone\n" + STONE.replace("mu: [0.1, 0.9], speed: [0.2, 1.5]", "mu: 0.3, speed: 0.02")
VISCOUS = DRY.replace("law: coulomb, mu: 0.3, speed: 0.02", "mu: 2")
SHAKY = 0.05
"""Noise of the films of `DRY` and `VISCOUS`."""


def film_of(config: Path, law: str, error: float | None = None) -> Film:
    """What Newton's equations give with a law, and noise."""
    checked, times = sweep.load_config(config), np.arange(0, 2, 1 / 60)
    columns, model = checked.grid.columns(), checked.equations
    p = {name: float(value[0]) for name, value in columns.items()}
    start = np.array(model.start(columns))[:, 0]
    spins = newton.spin(newton.follow(start, p, law, times, 1e-8))
    return Film(times, noisy(spins, SHAKY), None if error is None else np.full(len(times), error))


@pytest.fixture(scope="module")
def of_laws(kept: Write) -> xr.Dataset:
    """A film with dry friction, which both laws are fitted to.  Viscous friction, which takes three times as long, is
    compared in a campaign."""
    path = kept(DRY)
    return sweep.fit(path, film_of(path, "coulomb"), ["mu", "n0", "mu_static"], laws=["none", "coulomb"])


def test_a_film_is_attributed_to_its_law(of_laws: xr.Dataset) -> None:
    assert of_laws.law.values.tolist() == ["none", "coulomb"]
    assert of_laws.number_free.values.tolist() == [1, 2]
    assert of_laws.weight.sel(law="coulomb").item() > 0.9999
    assert "none is ruled out in favour of coulomb: Akaike's criteria" in of_laws.attrs["undetermined"]
    true = of_laws.sel(law="coulomb", parameter="mu")
    assert true.lower_95.item() < 0.3 < true.upper_95.item()
    assert true.chi_square.item() == pytest.approx(len(of_laws.time) - 2)
    assert "law: coulomb" in of_laws.attrs["config"]


@pytest.mark.campaign
def test_laws_that_cannot_be_distinguished_are_reported(write: Write) -> None:
    """A slip far below its speed: dry friction is viscous, with one parameter more."""
    config = write(VISCOUS)
    found = sweep.fit(config, film_of(config, "viscous", SHAKY), ["mu", "n0"], laws=["viscous", "coulomb"])
    words = found.attrs["undetermined"]
    assert "viscous and coulomb cannot be distinguished by this film" in words
    assert "coulomb: speed and mu are known only in combination" in words
    assert "misses the film" not in words
    assert found.number_free.values.tolist() == [2, 3]
    assert np.isnan(found.value.sel(law="viscous", parameter="speed"))
    np.testing.assert_allclose(found.weight.sum(), 1)
    np.testing.assert_allclose(found.akaike, found.chi_square + 2 * found.number_free)


@pytest.mark.usefixtures("by_formula")
def test_a_film_that_no_law_reproduces_is_reported(write: Write) -> None:
    film = Film(TIMES, FORMULA, np.full(len(TIMES), NOISE / 3))
    found = sweep.fit(write(SCENE), film, ["mu"], n0=TRUTH["n0"], laws=["viscous"])
    assert "even viscous misses the film by more than its errors" in found.attrs["undetermined"]
    assert "--laws" not in found.attrs["verdict"]


@pytest.mark.usefixtures("by_formula")
def test_the_command_compares_laws_and_writes_table_picture_and_the_best_body(write: Write, tmp_path: Path) -> None:
    """The formula has friction if its law has a coefficient."""
    config = write(SCENE.replace("mu: [30, 100]", "law: coulomb, mu: 0.3, speed: 0.02") + "integrator: {t_end: 150}\n")
    rows = "".join(f"{time},{spin}\n" for time, spin in zip(TIMES, FORMULA, strict=True))
    table = write("time,spin\n" + rows, "film.csv")
    out = tmp_path / "out"
    said = invoke("fit", config, table, "--free", "mu,n0,speed", "--laws", "none,viscous", "--output", out)
    assert said.exit_code == 0, said.output
    assert "law none: free are n0; it has no mu, speed\n" in said.stderr
    assert "law viscous: free are mu, n0; it has no speed\n" in said.stderr
    assert re.findall(r"^(\w+) {3,}", said.stdout, re.MULTILINE) == ["viscous", "none"]
    assert said.stdout.startswith("viscous: The curve fits the film")
    best = sweep.load_config(out / "scene_laws.yaml")
    assert (best.law, best.integrator.t_end) == ("viscous", 150)
    for verb in ("info", "plot"):
        assert invoke(verb, out / "scene_laws.nc").exit_code == 0


LAWS: dict[str, dict[str, Any]] = {
    "viscous": {"mu": 30.0},
    "coulomb": {"law": "coulomb", "mu": 0.3, "speed": 0.01},
}
"""Laws of friction, with guesses of their parameters."""


def random_film(random: np.random.Generator) -> tuple[dict[str, Any], Film, np.ndarray] | None:
    """A configuration with guesses, a film of a random body of 5 to 20 cm, and the same without noise.

    There is none if the body lifts off.
    """
    a, b, c = random.uniform(0.05, 0.2), random.uniform(0.02, 0.045), random.uniform(0.01, 0.018)
    delta, mass = random.uniform(0.01, 0.2) * random.choice([-1, 1]), random.uniform(0.05, 1.0)
    moments = (mass / 5 * (p**2 + q**2) for p, q in ((b, c), (a, c), (a, b)))
    solid = {"a": a, "b": b, "c": c, "mass": mass} | turned_inertia(*moments, delta)
    law = str(random.choice(list(LAWS)))
    friction = LAWS[law] | {"mu": LAWS[law]["mu"] * random.uniform(0.5, 2)}
    friction["sigma"] = solid["Izz"] / np.exp(random.uniform(np.log(5), 4))
    start = {"n0": random.choice([-1, 1]) * random.uniform(1, 8)}
    start["x0"] = a * np.exp(random.uniform(np.log(0.004), np.log(0.1)))
    start["y0"] = b * np.exp(random.uniform(np.log(0.004), np.log(0.1))) * random.choice([-1, 1])
    scene = {"name": "film", "units": "SI", "body": solid, "friction": LAWS[law], "integrator": {"t_end": 100}}
    columns = (config := sweep.load_config(scene | {"friction": friction, "start": start})).grid.columns()
    times = np.arange(0, random.uniform(4, 8), 1 / random.choice([30, 60, 120, 240]))
    p = {name: float(value[0]) for name, value in columns.items()}
    # DOP853 took three times as many evaluations for most bodies, and minutes for stiff ones.
    y = solve_ivp(lambda _, y: newton.derivative(y, p, law)[0], (0, times[-1]),
                  stack(config.equations.start(columns))[:, 0], "LSODA", times, rtol=1e-9, atol=1e-12).y  # fmt: skip
    if y.shape[1] < len(times) or any(newton.derivative(state, p, law)[1] <= 0 for state in y.T[::10]):
        return None
    what: Seen = "spin" if random.random() < 0.5 else "gyroscope"
    exact = newton.spin(y) if what == "spin" else -y[4]
    value = exact + random.normal(0, abs(start["n0"]) * random.uniform(0.01, 0.05), len(times))
    guess = {"n0": 5.0, "x0": a / 50, "y0": b / 50}
    return scene | {"start": guess}, Film(times, value, what=what), exact


@pytest.mark.release
def test_good_films_of_random_bodies_are_called_good_and_have_the_best_minimum() -> None:
    """A few of the films that the page on fits counts."""
    random, verdicts = np.random.default_rng(1), list[tuple[bool, bool]]()
    while len(verdicts) < 12:
        if filmed := random_film(random):
            scene, film, exact = filmed
            found = sweep.fit(scene, film, ["mu", "sigma", "n0", "x0", "y0"], progress=False)
            kept = ~found["outlier"].values
            ours, true = (np.sum((curve - film.value)[kept] ** 2) for curve in (found["fitted"].values, exact))
            verdicts.append((found.attrs["fits"] == 1, bool(ours <= true)))
    assert (np.sum(verdicts, axis=0) >= 11).all(), verdicts


@pytest.mark.campaign
def test_the_film_of_a_phone_gives_its_friction(tmp_path: Path) -> None:
    """As the page on ruler and phone has it, word for word"""
    page = (ROOT / "docs" / "how-to" / "fit-phone.md").read_text(encoding="utf-8")
    (options,) = re.findall(r"sweep body (--mass .*?)(?: > \S+)?$", page, re.MULTILINE)
    (tmp_path / "phone.yaml").write_text(invoke("body", *options.split()).stdout, encoding="utf-8")
    film = ROOT / "data" / "phone_synthetic.csv"
    found = sweep.fit(tmp_path / "phone.yaml", film, ["mu", "sigma", "n0", "x0", "y0"])
    assert found.attrs["fits"] == 1
    assert "; 2 outliers were left out." in found.attrs["verdict"]
    one = found.sel(parameter="mu")
    assert one.lower_95.item() < 0.22 < one.upper_95.item()
    assert one.upper_95.item() - one.lower_95.item() < 0.01
