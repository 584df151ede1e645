"""Boundaries: curves on which a count changes."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from support import Write
from support.cli import invoke, refused
from support.figures import entries
from support.runs import same_numbers

import sweep
from sweep.axis import Axis
from sweep.grid import Array
from sweep.kernels.status import SETTLED
from sweep.plots import description, picture
from sweep.results.margins import FOUND, WIDE, Counts, smoothed
from sweep.results.store import Store
from sweep.studies.boundaries import Boundaries
from sweep.studies.curve import Cell, Curve, Point
from sweep.studies.roots import Root
from sweep.studies.study import measuring

AXES: dict[str, Any] = {"mu": [60.0, 72.0, 84.0], "b": [3.0, 4.0]}
SCENE = {
    "body": {"a": 10.0, "delta": 0.03},
    "start": {"n0": 0.05, "x0": 0.01, "y0": 0.01},
}


@pytest.fixture(scope="module")
def found() -> xr.Dataset:
    return sweep.boundaries(SCENE, **AXES)


def narrowed(function: Any, low: float, high: float, width: float) -> tuple[Root, int]:
    root = Root(low, high, width, {p: function(p) for p in (low, high)}, {p: function(p) for p in (low, high)})
    calls = 0
    while not root.ended:
        for place in root.wanted():
            root.learn(place, function(place), smooth=True)
            calls += 1
    return root, calls


@given(st.floats(0.01, 0.99), st.floats(0.3, 30), st.floats(-0.9, 0.9), st.booleans())
def test_a_smooth_root_takes_few_evaluations(at: float, steep: float, bent: float, falls: bool) -> None:
    def function(x: float) -> float:
        return (-1 if falls else 1) * float(np.sinh(steep * (x - at) * (1 + bent * (x - at) / 2)))

    root, calls = narrowed(function, 0.0, 1.0, 1e-6)
    assert root.low <= at <= root.high <= root.low + 1e-6
    assert calls <= 20
    assert steep > 2 or abs(bent) > 0.5 or calls <= 6


@given(st.floats(0.01, 0.99))
def test_a_jump_of_the_function_is_bracketed_too(at: float) -> None:
    root, calls = narrowed(lambda x: 1.0 if x > at else -1.0, 0.0, 1.0, 1e-6)
    assert root.low <= at <= root.high <= root.low + 1e-6
    assert calls <= 60


def test_a_bracket_is_narrow_beside_its_place_not_beside_the_ends_of_an_edge() -> None:
    axis = Axis("mu", np.array([0.0, 10.0]))
    cells = {0.0: Cell(-4.0, 0, True, True), 10.0: Cell(6.0, 1, True, True)}
    point = Point.between(axis, {}, cells, (0.0, 10.0), 0.01)
    point.narrow(1e-6)
    assert np.isclose(point.root.width, 4e-6)


def test_a_place_without_a_value_ends_the_search() -> None:
    root, _ = narrowed(lambda x: np.nan if 0.2 < x < 0.9 else x - 0.5, 0.0, 1.0, 1e-6)
    assert root.unknown


@pytest.mark.parametrize("order", [1, -1])
def test_a_place_without_a_value_outside_the_bracket_does_not_matter(order: int) -> None:
    root = Root(0.0, 1.0, 1e-6, {0.0: -0.1, 1.0: 0.9}, {})
    for place, value in [(0.25, 0.15), (0.5, np.nan)][::order]:
        root.learn(place, value, smooth=True)
    assert not root.unknown


def test_a_bracket_ends_where_no_number_lies_between_its_ends() -> None:
    root, _ = narrowed(lambda x: x - 1 / 3, 0.0, 1.0, 0.0)
    assert 0 <= root.high - root.low < 1e-15


def test_a_cell_on_the_boundary_itself_is_on_one_of_its_sides() -> None:
    """A body at rest has no margin at all."""
    found = sweep.boundaries(
        {"body": {"a": 10.0, "delta": 0.03}, "start": {"n0": 0.05, "y0": 0.0}, "friction": {"mu": 75.0}},
        x="x0", x0=[0.0, 0.01, 0.3], n0=[0.0, 0.02, 0.05], bracket=0.1, deviation=0.1,
    )  # fmt: skip
    assert found.sizes["point"] > 0


def test_margins_are_those_of_cells_that_settle() -> None:
    settings: dict[str, Any] = {"bracket": 1e-3, "progress": False, "mu": [60.0, 72.0], "b": [3.0, 4.0]}
    usual, endless = (sweep.boundaries(SCENE, stop_early=stops, **settings) for stops in (True, False))
    same_numbers(endless, usual)


def test_a_spin_that_comes_no_nearer_to_zero_gives_no_distance_to_the_next_count() -> None:
    """Cells of a line that count four, from where five begins (b = 7.7) to where three begins (b = 8)."""
    cells = sweep.run(SCENE, mu=121.74, b=np.linspace(7.5, 7.98, 33), progress=False).squeeze()
    counts = Counts.of({name: cells[name].values for name in description.MARGINS})
    begins = float(cells.b[cells.reversals == 5].max())
    four = np.flatnonzero(cells.reversals == 4)
    flat = four[~counts.borders(5)[four]]
    assert len(flat) < len(four) - 5
    assert counts.borders(4)[four].all()
    distance, first = counts.distance(5), cells.b.values[0]
    expected = first + distance[0] / (distance[0] - distance[flat]) * (cells.b.values[flat] - first)
    assert len(expected) > 3
    np.testing.assert_allclose(expected, begins, atol=0.03)  # 0.13 to 0.25 off if margins were distances


def searched(
    distance: Callable[[Array, Array], Array], axes: Mapping[str, list[float]], width: float
) -> tuple[Boundaries, set[tuple[float, float]]]:
    """A search whose simulations a formula of mu and b replaces, and the places with their errors, as (mu, b)."""

    class Formula(Store):
        def load(self, tile: int) -> dict[str, Array]:
            found = distance(search.rounds[tile]["mu"], search.rounds[tile]["b"])
            more, fewer = np.where(found > 0, np.nan, -found), np.where(found > 0, found, np.nan)
            cells = {"status": np.full(len(more), SETTLED), "reversals": (found > 0) * 1.0}
            return cells | {"margin_more": more, "margin_fewer": fewer, "seconds": np.array(0.0), "cpu": np.array("x")}

    search = Boundaries(measuring(sweep.load_config(SCENE, axes)), Formula(), ("b", "mu"), width, 0.01)
    sure: set[tuple[float, float]] = set()
    while search.grow():
        if search.estimates:
            sure |= set(zip(search.rounds[-1]["mu"].tolist(), search.rounds[-1]["b"].tolist(), strict=True))
    return search, sure


@pytest.mark.parametrize("width", [1e-6, 0.1])
def test_both_ends_of_each_bracket_are_simulated_with_their_errors(width: float) -> None:
    search, sure = searched(lambda mu, b: mu - 70 - b, AXES, width)
    points = [point for curve in search.curves for point in curve.points]
    assert len(points) == 2
    for point in points:
        assert {(p["mu"], p["b"]) for p in map(point.parameters, (point.root.low, point.root.high))} <= sure


@pytest.mark.parametrize(("sign", "size", "length"), [(1, 1.2, 0.2), (1, 4.0, 1.0), (-1, 2.0, 1.0)])
def test_a_curve_through_cells_of_the_grid_is_followed_all_around(sign: int, size: float, length: float) -> None:
    """Points on two edges that meet in such a cell are the same, or differ by rounding."""

    def distance(mu: Array, b: Array) -> Array:
        u, v = (mu - 60) / 10, b - 4
        return np.asarray(sign * (size - (u - v) ** 2 - length * (u + v) ** 2))

    axes = {"mu": [40.0, 50.0, 60.0, 70.0, 80.0], "b": [2.0, 3.0, 4.0, 5.0, 6.0]}
    (curve,) = searched(distance, axes, 1e-6)[0].curves
    places = np.array([[point.parameters(point.root.expected)[name] for name in axes] for point in curve.points])
    np.testing.assert_allclose(distance(*places.T), 0, atol=1e-4)
    ways = np.hypot(*((np.roll(places, -1, axis=0) - places) / [40, 4]).T)
    long = [point for point, way in zip(curve.points, ways, strict=True) if way > 0.1]
    assert len(long) >= 8
    assert all(curve.middles[id(point)].confirmed for point in long)


@pytest.mark.parametrize("closed", [False, True])
def test_smooth_curves_pass_through_their_points_and_near_a_circle(closed: bool) -> None:
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    x, y = smoothed(np.cos(angle), np.sin(angle), closed=closed)
    inner = slice(None) if closed else slice(8, -8)
    np.testing.assert_allclose(np.hypot(x, y)[inner], 1, atol=3e-4)
    assert min(np.hypot(x - 1, y)) < 1e-12
    assert np.hypot(x[-1] - x[0], y[-1] - y[0]) < (1e-9 if closed else 0.3)


def test_both_ends_of_each_bracket_count_what_another_method_counts(found: xr.Dataset) -> None:
    assert (found.outcome == FOUND).all()
    assert found.sizes["point"] >= 4
    width = np.abs(found.end_more - found.end_fewer) / np.minimum(found.end_more, found.end_fewer)
    assert float(width.max()) <= 1e-6
    assert (found.reversals_more - found.reversals_fewer == 1).all()
    assert (found.reversals_more == found.level).all()
    for end, counted in (("end_fewer", "reversals_fewer"), ("end_more", "reversals_more")):
        mu, b = (xr.where(found.bracket == name, found[end], found[name]).values for name in ("mu", "b"))
        again = sweep.run({**SCENE, "cases": {"mu": mu, "b": b}}, method="dopri5")
        np.testing.assert_array_equal(again.reversals.values, found[counted].values)


def test_margins_of_a_grid_draw_the_curves_without_a_search(found: xr.Dataset) -> None:
    grid = sweep.run(SCENE, **AXES)
    axes = [Axis(name, np.array(AXES[name])) for name in ("b", "mu")]
    lines = {int(line.symbol): np.concatenate(line.parts, axis=1) for line in description.boundaries(grid, *axes)}
    assert set(lines) == set(found.level.values)
    points = [found.isel(point=i) for i in range(found.sizes["point"])]
    off = [
        np.hypot(*((lines[int(p.level)].T - [p.b.item(), p.mu.item()]) / [1.0, 12.0]).T).min()
        for p in points
        if p.b.item() in AXES["b"] or p.mu.item() in AXES["mu"]
    ]
    assert len(off) >= 4
    assert np.median(off) < 0.15
    assert max(off) < 0.5
    assert "boundary of counts" in " ".join(entries(picture.plot(grid, x="b", y="mu")))
    assert not description.boundaries(grid.drop_vars("margin_more"), *axes)


def test_what_does_not_end_has_a_wide_bracket(tmp_path: Path) -> None:
    early = sweep.boundaries(SCENE, output=tmp_path, **AXES, t_end=4500.0)
    assert f"{early.sizes['point']} points" in invoke("info", tmp_path / "sweep_boundaries.nc").output
    assert (early.outcome == WIDE).any()
    assert "wide bracket" in " ".join(entries(picture.plot(early)))


def test_pairs_that_are_not_searched_are_counted(tmp_path: Path) -> None:
    """The counts are 1 1 2 / 1 1 3 / 1 2 3, and those beyond the first column are not final.

    Of the six pairs that differ only the lower left one has two known neighbours.
    """
    early = sweep.boundaries(
        {"friction": {"mu": [60, 70, 80]}}, tmp_path, n0=[0.02, 0.04, 0.06], t_end=1000, bracket=0.05
    )
    assert early.sizes["point"] == 1
    assert (float(early.mu[0]), int(early.level[0])) == (80, 2)
    assert 0.02 < float(early.n0[0]) < 0.04
    assert (early.cells_not_final, early.pairs_not_searched) == (6, 5)
    said = invoke("info", tmp_path / "sweep_boundaries.nc").output
    assert "not final 6: " in said
    assert "not searched 5: " in said


def test_a_picture_without_curves_says_whether_counts_differ() -> None:
    early = sweep.boundaries({"friction": {"mu": [60, 70]}}, n0=[0.04, 0.06], t_end=1000)
    assert (early.sizes["point"], early.pairs_not_searched) == (0, 3)
    assert picture.plot(early).axes[0].get_title() == "no boundary was searched"


def test_a_cell_without_a_count_hides_its_own_pairs_alone() -> None:
    """Counts begin at mu = 2; of nine cells the one in the middle has none, which is part of each square of four."""
    axes = {"mu": [1.0, 1.5, 3.0], "b": [4.0, 5.0, 6.0]}
    search, _ = searched(lambda mu, b: np.where((mu == 1.5) & (b == 5), np.nan, mu - 2), axes, 1e-3)
    found = search.dataset()
    assert sorted(found.b.values) == [4, 6]
    np.testing.assert_allclose(found.mu, 2, rtol=1e-3)
    assert found.pairs_not_searched == 1
    lines = picture.plot(found.assign_attrs(sweep_kind="boundaries")).axes[0].lines
    lone = [line for line in lines if line.get_gid() == "level1"]
    assert [line.get_marker() for line in lone] == [".", "."]


def test_a_map_without_boundaries_has_an_empty_picture(tmp_path: Path) -> None:
    none = sweep.boundaries(SCENE, output=tmp_path, **AXES, t_end=100.0)
    assert none.sizes["point"] == 0
    assert "no count changes" in picture.plot(none).axes[0].get_title()
    assert "0 points" in invoke("info", tmp_path / "sweep_boundaries.nc").output


def test_what_cannot_be_searched_is_refused(write: Write) -> None:
    refused(invoke("boundaries", write("friction: {mu: 60}\n", "none.yaml")), "boundaries need an axis")
    one = write("friction: {mu: [60, 70]}\n", "one.yaml")
    refused(invoke("boundaries", one, "--x", "c"), "--x: c is not an axis of more than one value", "mu")
    two = write("friction: {mu: [60, 70]}\nbody: {b: [2, 3]}\n", "two.yaml")
    refused(invoke("boundaries", two, "--x", "b", "--y", "b"), "--y: b is the other axis already")


def traced(edge: Callable[[Array], Array], points: int, deviation: float) -> tuple[Curve, int]:
    """The curve y = edge(x) over the unit square, followed from points on lines of a grid; how many cells it took."""
    x, y = (Axis(name, np.linspace(0, 1, points)) for name in "xy")

    def cell(at: Mapping[str, float]) -> Cell:
        return Cell(at["y"] - float(edge(np.array(at["x"]))), 0, True, True)

    def point(across: float) -> Point:
        cells = {place: cell({"x": across, "y": place}) for place in (0.0, 1.0)}
        return Point.between(y, {"x": across}, cells, (0.0, 1.0), deviation)

    curve, calls = Curve(1, False, (x, y), [point(across) for across in x.values.tolist()]), 0
    while wanted := [(each, place) for each in curve.searched() for place in each.wanted()] or calls == 0:
        for each, place in wanted:
            at = each.parameters(place)
            assert all(axis.values[0] <= at[axis.name] <= axis.values[-1] for axis in curve.across)
            each.learn(place, cell(at))
        calls += len(wanted)
        curve.grow(deviation)
    return curve, calls


@pytest.mark.parametrize("sign", [1, -1])
def test_a_curve_gets_points_where_it_is_not_as_smooth_as_its_points(sign: int) -> None:
    """A spike a hundredth wide between points a twentieth apart, such as resonances make."""

    def edge(x: Array) -> Array:
        return np.asarray(0.5 + 0.1 * x**2 + sign * 0.2 / (1 + ((x - 0.52) / 0.005) ** 2))

    curve, calls = traced(edge, 20, 1e-4)
    places = np.array([[point.parameters(point.root.expected)[name] for name in "xy"] for point in curve.points])
    true = np.linspace(0, 1, 200_000)
    off, _ = cKDTree(np.stack([true, edge(true)], axis=1)).query(np.stack(smoothed(*places.T, closed=False), axis=1))
    assert np.quantile(off, 0.99) < 1e-4
    assert off.max() < 3e-4
    assert len(places) < 80
    assert calls < 10 * len(places)
    assert all(middle.confirmed for middle in curve.middles.values())


def test_a_smooth_curve_gets_no_more_points() -> None:
    curve, _ = traced(lambda x: 0.5 + 0.1 * np.sin(3 * x), 20, 1e-3)
    assert len(curve.points) == 20
    assert len(curve.middles) == 19


def test_no_cell_beyond_the_map_is_asked_for() -> None:
    """The curve runs along its upper edge, nearer than the deviation."""
    curve, _ = traced(lambda x: 0.9995 + 4e-4 * np.sin(7 * x), 9, 1e-3)
    assert curve.middles
    assert all(middle.confirmed for middle in curve.middles.values())


def test_a_curve_that_leaves_the_map_between_two_lines_is_in_pieces() -> None:
    def edge(x: Array) -> Array:
        return np.asarray(0.5 + 0.8 * np.exp(-(((x - 0.4) / 0.05) ** 2)))

    curve, _ = traced(edge, 5, 1e-3)
    (left, open_), (right, _) = curve.pieces()
    assert not open_
    assert (len(left) > 2, len(right) > 2) == (True, True)
    assert max(point.parameters(point.root.expected)["x"] for point in left) < 0.4
    assert min(point.parameters(point.root.expected)["x"] for point in right) > 0.4
    round_ = Curve(1, True, curve.across, curve.points, curve.middles)
    ((whole, closed),) = round_.pieces()
    assert not closed
    assert {*map(id, whole)} == {*map(id, curve.points)}
    assert whole[0] is right[0]
