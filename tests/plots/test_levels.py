"""Where the counts on boundaries are written."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from sweep.axis import Axis
from sweep.kernels.status import DIVERGED, SETTLED
from sweep.plots import levels
from sweep.plots.theory import Line, Points

MU = Axis("mu", np.geomspace(1, 100, 21))
B = Axis("b", np.linspace(0, 1, 21))


def across(b: float, first: int = 0, last: int = 21) -> Points:
    """A part of a line at this b, from one value of mu to another."""
    return MU.values[first:last], np.full(last - first, b)


def counted(counts: list[list[float]], widths: list[list[float]]) -> xr.Dataset:
    """Cells in the middle of their counts; where there is no width, no count is known."""
    width, count = np.array(widths), np.array(counts)
    values = {"reversals": count, "margin_more": width / 2, "margin_fewer": width / 2}
    values["status"] = np.where(np.isnan(width), DIVERGED, SETTLED)
    coordinates = {"b": np.arange(float(count.shape[0])), "mu": np.arange(1.0, count.shape[1] + 1)}
    return xr.Dataset({name: (("b", "mu"), v) for name, v in values.items()}, coordinates)


def drawn(dataset: xr.Dataset) -> dict[str, list[Points]]:
    x, y = (Axis(name, dataset[name].values) for name in ("mu", "b"))
    return {line.symbol: line.parts for line in levels.lines(dataset, x, y)}


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
    assert [x.max(), y.min(), y.max()] == [2.5, 0, 2]


def numbers(*lines: list[Points]) -> list[tuple[float, float, str]]:
    """The numbers on boundaries of one reversal, two, and so on, of these parts."""
    return list(levels.numbers([Line("boundary", "", parts, f"{k}") for k, parts in enumerate(lines, 1)], MU, B))


def test_a_number_is_in_the_middle_of_its_line() -> None:
    assert numbers([across(0.3)]) == [(MU.values[10], 0.3, "1")]


def test_numbers_of_close_lines_are_apart() -> None:
    found = numbers(*([across(b)] for b in np.linspace(0.5, 0.51, 8)))
    assert [count for *_, count in found] == list("12345678")
    places = np.sort(np.log(np.array([mu for mu, *_ in found])) / np.log(100))
    assert np.diff(places).min() > 0.06


def test_small_parts_have_no_number_beside_large_ones() -> None:
    island = across(0.8, 5, 8)
    assert numbers([across(0.3), island, across(0.6)]) == [(MU.values[10], 0.3, "1"), (MU.values[10], 0.6, "1")]
    assert numbers([island]) == [(MU.values[6], 0.8, "1")]


def test_no_number_is_on_the_edge_of_a_map() -> None:
    edge = (np.full(21, MU.edges[-1]), B.values)
    assert [count for *_, count in numbers([edge], [across(0.3)])] == ["2"]


def test_a_line_without_room_has_no_number() -> None:
    assert [count for *_, count in numbers([across(0.3)], [across(0.3, 10, 12)])] == ["1"]


def test_other_lines_have_no_number() -> None:
    assert not list(levels.numbers([Line("n_c2", "", [across(0.3)], "n_c2⁺")], MU, B))
