"""Where counts and symbols stand on the lines of a map."""

from itertools import combinations

import numpy as np
import pytest
from matplotlib.transforms import Bbox
from support.figures import made

from sweep.axis import Axis
from sweep.plots import picture, places
from sweep.plots.theory import Line, Points

MU = Axis("mu", np.geomspace(1, 100, 21))
B = Axis("b", np.linspace(0, 1, 21))


def across(b: float, first: int = 0, last: int = 21) -> Points:
    """A part of a line at this b, from one value of mu to another."""
    return MU.values[first:last], np.full(last - first, b)


def numbers(*lines: list[Points]) -> list[tuple[float, float, str]]:
    """The numbers on boundaries of one reversal, two, and so on, of these parts."""
    return list(places.numbers([Line("boundary", "", parts, f"{k}") for k, parts in enumerate(lines, 1)], MU, B))


def test_a_number_is_in_the_middle_of_its_line() -> None:
    assert numbers([across(0.3)]) == [(MU.values[10], 0.3, "1")]


def test_numbers_of_close_lines_are_apart() -> None:
    found = numbers(*([across(b)] for b in np.linspace(0.5, 0.51, 8)))
    assert [count for *_, count in found] == list("12345678")
    places = np.sort(np.log(np.array([mu for mu, *_ in found])) / np.log(100))
    assert np.diff(places).min() > 0.06


def test_no_number_is_on_the_edge_of_a_map() -> None:
    edge = (np.full(21, MU.edges[-1]), B.values)
    assert [count for *_, count in numbers([edge], [across(0.3)])] == ["2"]


def test_a_line_without_room_has_no_number() -> None:
    assert [count for *_, count in numbers([across(0.3)], [across(0.3, 10, 12)])] == ["1"]


def test_a_number_keeps_off_lines_of_theory_if_it_can() -> None:
    middle = Line("best", "", [(np.full(2, MU.values[10]), B.edges[[0, -1]])])
    boundary = Line("boundary", "", [across(0.3)], "1")
    ((at, *_),) = places.numbers([middle, boundary], MU, B)
    assert at in (MU.values[9], MU.values[11])
    along = Line("best", "", [across(0.3)])
    assert list(places.numbers([along, boundary], MU, B)) == [(MU.values[10], 0.3, "1")]


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
