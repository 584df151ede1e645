"""Where the counts on boundaries are written."""

from __future__ import annotations

import numpy as np

from sweep.axis import Axis
from sweep.plots import levels
from sweep.plots.theory import Line, Points

MU = Axis("mu", np.geomspace(1, 100, 21))
B = Axis("b", np.linspace(0, 1, 21))


def across(b: float, first: int = 0, last: int = 21) -> Points:
    """A part of a line at this b, from one value of mu to another."""
    return MU.values[first:last], np.full(last - first, b)


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


def test_a_line_without_room_has_no_number() -> None:
    assert [count for *_, count in numbers([across(0.3)], [across(0.3, 10, 12)])] == ["1"]


def test_other_lines_have_no_number() -> None:
    assert not list(levels.numbers([Line("n_c2", "", [across(0.3)], "n_c2⁺")], MU, B))
