"""The address of the explorer: what is written there opens the same page, and nothing else gets through."""

from dataclasses import replace
from urllib.parse import parse_qs

import numpy as np
import pytest

from sweep.explorer import state
from sweep.explorer.setup import Setup
from sweep.explorer.slices import Source
from sweep.explorer.state import State

HOSTILE = {
    "show=../../etc/passwd": "show=../../etc/passwd is not there; choose reversals, ",
    "show=<script>alert(1)</script>": "show=<script>alert(1)</script> is not there; choose ",
    "x=delta": "x=delta is not there; choose mu, b, n0",
    "file=/etc/passwd": "unknown URL parameter 'file'; expected one of show, x, y, mu, b, n0, sign, palette, scale,",
    "n0=nan": "n0=nan is not there; choose from 0.02 to 0.05",
    "n0=" + "1" * 5000: "n0=1111",
    "palette=jet": "palette=jet is not there; choose , viridis",
    "low=nan": "low=nan: give a number from -1e+15 to 1e+15",
    "high=1e16": "high=1e16: give a number from ",
    "low=3&high=3": "low is not below high; ",
    "&".join(f"key{k}=1" for k in range(5000)): "unknown URL parameter 'key0', 'key1', 'key2', 'key3', 'key4' …; ",
    "cell=__class__:1": "cell=__class__:1: __class__ is not a parameter; choose ",
    "cell=mu:-1": "cell=mu:-1: mu has to be a finite number >= 0",
    "cell=:": "cell=::  is not a parameter",
}
"""What is said of an address that asks for what is not there."""


@pytest.fixture
def base(setup: Setup) -> state.Cell:
    return setup.base


def read(query: str, source: Source, base: state.Cell) -> tuple[State, list[str]]:
    return state.read(parse_qs(query, keep_blank_values=True), source, base)


def test_the_longest_axes_are_shown_first(source: Source) -> None:
    shown = state.first(source)
    assert (shown.x, shown.y, shown.show) == ("b", "mu", "reversals")


def test_what_is_written_is_read_again(source: Source, base: state.Cell) -> None:
    cells = ({**base, "mu": 47.123456789, "b": 3.0}, {**base, "delta": -0.25})
    shown = State(
        "n0", "mu", "difference", {"mu": 0, "b": 2, "n0": 1, "sign": 1}, cells, "gray", "map", limits={"high": 4.5}
    )
    again, faults = read(state.write(shown, source, base), source, base)
    assert not faults
    assert again == shown


def test_a_cell_in_the_address_names_no_more_than_it_has_to(source: Source, base: state.Cell) -> None:
    shown = State("mu", "b", "reversals", {"n0": 1, "sign": 0}, ({**base, "mu": 47.0},))
    assert state.write(shown, source, base).endswith("cell=b:2,mu:47,n0:0.02")


@pytest.mark.parametrize(("query", "said"), HOSTILE.items(), ids=lambda text: text[:20])
def test_other_parameters_of_an_address_are_refused(query: str, said: str, source: Source, base: state.Cell) -> None:
    shown, (fault,) = read(query, source, base)
    assert shown == state.first(source)
    assert fault.startswith(said)
    assert len(fault) < 600


def test_no_more_cells_than_colours(source: Source, base: state.Cell) -> None:
    query = "&".join(f"cell=mu:{50 + k}" for k in range(state.MAX_CELLS + 3))
    shown, faults = read(query, source, base)
    assert len(shown.cells) == state.MAX_CELLS
    assert "9 cells" in faults[0]


def test_without_a_configuration_no_cell_is_taken(source: Source) -> None:
    shown, faults = read("cell=mu:50", source, {})
    assert not shown.cells
    assert "no configuration" in faults[0]


@pytest.mark.parametrize("query", ["x=b", "y=mu", "y=mu&x=b"])
def test_an_axis_chosen_twice_changes_places(query: str, source: Source, base: state.Cell) -> None:
    shown, faults = read(query, source, base)
    assert not faults
    assert (shown.x, shown.y) == ("b", "mu")


def test_the_first_cell_is_one_of_the_usual_count_near_the_middle(source: Source) -> None:
    shown = state.first(source)
    part = source.map(shown.show, shown.x, shown.y, shown.at)
    cell = state.telling(source, shown)
    counts = part.values[~part.blank & (part.values > 0)]
    assert part.values[cell[shown.y], cell[shown.x]] == np.median(counts)
    assert cell["n0"] == shown.at["n0"] == 1


def test_without_any_count_the_first_cell_is_in_the_middle(source: Source) -> None:
    shown = replace(state.first(source), show="spin_error")
    nothing = Source(source.dataset.assign(spin_error=source.dataset["spin_final"] * np.nan))
    cell = state.telling(nothing, shown)
    assert abs(cell[shown.x] - len(source.axes[shown.x].values) / 2) <= 1
