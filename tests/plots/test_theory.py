"""Lines where counts change, and lines of theory, compared with formulas and eigenvalues of the bodies that they pass.

And where their numbers and symbols stand.
"""

from itertools import combinations
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.transforms import Bbox
from support.figures import made

import sweep
from sweep.axis import Axis
from sweep.kernels.status import DIVERGED, SETTLED
from sweep.models import MODELS
from sweep.models.ladder import analytic
from sweep.models.theory import stability
from sweep.plots import description, picture, places
from sweep.plots.theory import Line, Points, crossings, lines

BODY = {"a": 10.0, "c": 1.0, "delta": 0.03}


def predictions(mu: Any, n0: list[float] | float = 0.02, b: Any = (2.5, 4.5, 6.5, 8.5)) -> xr.Dataset:
    return sweep.predict({"body": {"b": list(b)}, "friction": {"mu": list(mu)}, "start": {"n0": n0}})


def axis(dataset: xr.Dataset, name: str) -> Axis:
    return Axis(name, dataset[name].values)


def exact(line: Line, **varying: np.ndarray) -> np.ndarray:
    """The critical spin of a line at bodies."""
    size = len(next(iter(varying.values())))
    columns = {name: np.full(size, value) for name, value in BODY.items()} | varying
    if line.name == "n_c2":
        return 2 * analytic.critical_spins(columns)[0]
    return stability.critical_spins(MODELS["slip"], columns)[0]


@pytest.mark.parametrize("mu", [np.linspace(10, 180, 18), np.geomspace(10, 270, 12)])
def test_lines_over_maps_pass_between_the_cells_from_one_edge_to_another(mu: np.ndarray) -> None:
    dataset = predictions(mu, b=np.linspace(2.5, 8.5, 13))
    b, friction = axis(dataset, "b"), axis(dataset, "mu")
    found = [line for line in lines(dataset, b, friction) if line.name != "best"]
    assert {line.name for line in found} == {"n_c1", "n_c2"}
    for line in found:
        x, y = max(line.parts, key=lambda part: len(part[0]))
        between = (x >= b.values[0]) & (x <= b.values[-1]) & (y >= friction.values[0]) & (y <= friction.values[-1])
        np.testing.assert_allclose(exact(line, b=x, mu=y)[between], 0.02, rtol=0.03)
        np.testing.assert_allclose(exact(line, b=x, mu=y), 0.02, rtol=0.1)  # to the edges, a straight line goes on
        for end in (0, -1):
            assert any(np.isclose(at[end], of.edges[[0, -1]]).any() for at, of in ((x, b), (y, friction)))


def test_lines_over_start_spins_are_those_of_each_friction() -> None:
    dataset = predictions([30.0, 80.0, 130.0, 180.0], [0.01, 0.05, 0.09]).sel(b=4.5)
    for line in lines(dataset, axis(dataset, "mu"), axis(dataset, "n0")):
        if line.symbol.endswith("⁺"):
            ((mu, spin),) = line.parts
            np.testing.assert_allclose(spin[1:-1], exact(line, b=np.full(4, 4.5), mu=mu[1:-1]), rtol=1e-9)
            np.testing.assert_allclose(spin, exact(line, b=np.full(6, 4.5), mu=mu), rtol=0.1)
            assert mu.tolist() == [5, 30, 80, 130, 180, 205]


def test_crossings_lie_where_the_spin_is_critical() -> None:
    dataset = predictions([30.0, 80.0], b=np.linspace(2.5, 8.5, 61)).sel(mu=30.0)
    (line,) = [line for line in crossings(dataset, axis(dataset, "b")) if line.name == "n_c2"]
    ((at, _),) = line.parts
    np.testing.assert_allclose(exact(line, b=at, mu=np.full(len(at), 30.0)), 0.02, rtol=1e-3)


def counted(counts: list[list[float]], widths: list[list[float]]) -> xr.Dataset:
    """Cells near the middle of their counts; where there is no width, no count is known."""
    width, count = np.array(widths), np.array(counts)
    values = {"reversals": count, "margin_more": 0.48 * width, "margin_fewer": 0.52 * width}
    values["status"] = np.where(np.isnan(width), DIVERGED, SETTLED)
    coordinates = {"b": np.arange(float(count.shape[0])), "mu": np.arange(1.0, count.shape[1] + 1)}
    return xr.Dataset({name: (("b", "mu"), v) for name, v in values.items()}, coordinates)


def drawn(dataset: xr.Dataset) -> dict[str, list[Any]]:
    x, y = (Axis(name, dataset[name].values) for name in ("mu", "b"))
    return {line.symbol: line.parts for line in description.boundaries(dataset, x, y)}


def test_lines_between_distant_counts_are_evenly_apart_whatever_the_widths_of_the_cells() -> None:
    found = drawn(counted([[1, 5], [1, 5]], [[0.001, 0.1], [0.001, 0.1]]))
    at = [found[level][0][0][0] for level in "2345"]
    assert np.diff(at) == pytest.approx(at[1] - at[0], rel=1e-6)
    assert 0.2 < at[1] - at[0] < 0.4


def test_a_cell_without_a_count_breaks_no_line_between_the_others() -> None:
    nowhere = float("nan")
    found = drawn(counted([[0, 1, 1], [0, 1, 1], [0, 0, 1]], [[1, 1, 1], [1, 1, 1], [nowhere, 1, 1]]))
    assert len(found["1"]) == 1
    (x, y), *_ = found["1"]
    assert [x.max(), y.min(), y.max()] == pytest.approx([2.48, -0.5, 2.5])


MU = Axis("mu", np.geomspace(1, 100, 21))
B = Axis("b", np.linspace(0, 1, 21))


def across(b: float, first: int = 0, last: int = 21) -> Points:
    """A part of a line at this b, from one value of mu to another."""
    return MU.values[first:last], np.full(last - first, b)


def numbers(*lines: list[Points]) -> list[tuple[float, float, str]]:
    """The numbers on boundaries of one reversal, two, and so on, of these parts."""
    return list(places.words([Line("boundary", "", parts, f"{k}") for k, parts in enumerate(lines, 1)], MU, B))


def test_numbers_of_close_lines_are_apart() -> None:
    found = numbers(*([across(b)] for b in np.linspace(0.5, 0.51, 8)))
    assert [count for *_, count in found] == list("12345678")
    places = np.sort(np.log(np.array([mu for mu, *_ in found])) / np.log(100))
    assert np.diff(places).min() > 0.06


def test_small_parts_next_to_large_ones_have_no_number() -> None:
    island = across(0.8, 5, 8)
    assert numbers([across(0.3), island, across(0.6)]) == [(MU.values[10], 0.3, "1"), (MU.values[10], 0.6, "1")]
    assert numbers([island]) == [(MU.values[6], 0.8, "1")]


def test_no_number_is_on_the_edge_of_a_map() -> None:
    edge = (np.full(21, MU.edges[-1]), B.values)
    assert [count for *_, count in numbers([edge], [across(0.3)])] == ["2"]


def test_a_line_without_room_has_no_number() -> None:
    assert [count for *_, count in numbers([across(0.3)], [across(0.3, 10, 12)])] == ["1"]


def test_the_symbol_of_a_line_is_within_the_map_and_off_the_numbers() -> None:
    far = Line("n_c1", "", [(MU.values, np.geomspace(0.2, 5, 21)), (np.full(2, np.nan), np.full(2, 0.5))], "n_c1")
    boundary = Line("boundary", "", [across(0.44)], "1")
    (count, *_), (mu, b, symbol) = places.words([boundary, far], MU, B)
    assert symbol == "n_c1"
    assert (mu, b) in zip(*far.parts[0], strict=True)
    assert B.edges[0] + 0.03 < b < B.edges[-1] - 0.03
    assert mu != count


@pytest.mark.parametrize("width", [None, "85mm"])
@pytest.mark.parametrize("over", ["b", "n0"])
def test_nothing_that_is_written_on_a_map_lies_on_something_else(width: str | None, over: str) -> None:
    one = made(n0=np.linspace(-0.1, 0.1, 21)).isel(b=0) if over == "n0" else made()
    one = one.assign(margin_more=one.spin_final * 0 + 0.5, margin_fewer=one.spin_final * 0 + 0.5)
    figure = picture.plot(one, width=width)
    figure.draw_without_rendering()
    for axes in (each for each in figure.axes if each.get_label() == ""):
        boxes = {text.get_text(): text.get_window_extent() for text in axes.texts if text.get_weight() != "bold"}
        assert sum("mathrm{c" in words for words in boxes) >= {"n0": 4, "b": 1}[over]
        assert not any(Bbox.intersection(*pair) for pair in combinations(boxes.values(), 2))
        for box in boxes.values():
            assert axes.bbox.x0 < box.x0 < box.x1 < axes.bbox.x1
            assert axes.bbox.y0 < box.y0 < box.y1 < axes.bbox.y1
