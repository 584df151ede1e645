"""The search outwards from zero, on events whose spins are known."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from sweep.studies.bracket import AT_ONCE, FAILED, HAPPENS, NOT_YET, UNDECIDED, Bracket, Question, search


def find(
    *searches: list[tuple[float, int]],
    begin: float = 0.01,
    limit: float = 10.0,
    width: float = 1e-3,
    margin: Callable[[float], float] = lambda _: np.nan,
    coarse: Callable[[float], float] = lambda spin: spin,
    asked: list[tuple[int, float, bool]] | None = None,
) -> Bracket:
    """Brackets where the outcome, `NOT_YET` at first, changes at the spins of each search.

    `coarse` is the spin for which an answer that need not be exact is given.
    """

    def ask(question: Question) -> Any:
        each = list(zip(question.search.tolist(), question.size.tolist(), question.exact.tolist(), strict=True))
        if asked is not None:
            asked.extend(each)
        outcomes = [
            next((outcome for start, outcome in reversed(searches[i]) if (s if sure else coarse(s)) >= start), NOT_YET)
            for i, s, sure in each
        ]
        return np.array(outcomes), np.array([margin(spin) for i, spin, _ in each])

    return search(ask, np.full(len(searches), begin), np.full(len(searches), limit), width)


def test_brackets_hold_the_first_change_and_are_narrow() -> None:
    starts = [0.0101, 0.05, 0.5, 3.0, 9.99]
    found = find(*([(start, HAPPENS)] for start in starts))
    assert (found.outcome == HAPPENS).all()
    assert (found.inner < starts).all()
    assert (starts <= found.outer).all()
    assert (found.outer - found.inner <= 1e-3 * found.outer).all()


def test_what_ceases_and_begins_again_is_bracketed_where_it_begins_first() -> None:
    twice = [(0.2, HAPPENS), (0.27, NOT_YET), (0.5, HAPPENS), (0.51, NOT_YET), (2.0, HAPPENS)]
    found = find(twice)
    assert found.inner < 0.2 <= found.outer


def test_what_does_not_happen_up_to_the_limit_is_not_found() -> None:
    found = find([(3.0, HAPPENS)], [(2.9, HAPPENS)], limit=2.95)
    assert list(found.outcome) == [NOT_YET, HAPPENS]
    assert np.isnan([found.inner[0], found.outer[0]]).all()


def test_what_happens_at_the_beginning_has_no_bracket() -> None:
    found = find([(0.005, HAPPENS)])
    assert (found.outcome[0], np.isnan(found.inner[0])) == (AT_ONCE, True)


def test_failures_end_a_search() -> None:
    found = find([(0.2, FAILED), (0.5, HAPPENS)], [(0.2, HAPPENS), (0.5, FAILED)], [(0.19, FAILED), (0.2, HAPPENS)])
    assert list(found.outcome) == [FAILED, HAPPENS, FAILED]
    assert np.isnan(found.outer[[0, 2]]).all()


def test_a_time_limit_at_the_inner_end_is_told() -> None:
    found = find(
        [(0.1, UNDECIDED), (0.2, HAPPENS)], [(0.1, UNDECIDED), (0.11, NOT_YET), (0.2, HAPPENS)], [(0.1, UNDECIDED)]
    )
    assert list(found.outcome) == [UNDECIDED, HAPPENS, UNDECIDED]
    assert np.isnan(found.inner[[0, 2]]).all()
    assert 0.2 <= found.outer[0] <= 0.2002
    assert np.isnan(found.outer[2])


@pytest.mark.parametrize(
    ("margin", "most"),
    [
        (lambda spin: 0.8 - spin if spin < 0.8 else np.nan, 4),
        (lambda spin: 0.9 * (0.8 - spin) + (0.8 - spin) ** 2 if spin < 0.8 else np.nan, 7),
        (lambda spin: 100 * (0.8 - spin) if spin < 0.8 else np.nan, 16),
        (lambda _: 1e-9, 16),
        (lambda _: -1.0, 16),
    ],
)
def test_margins_only_propose_spins(margin: Callable[[float], float], most: int) -> None:
    """A true margin saves simulations; one that misleads costs some, and changes nothing of what is found."""
    asked: list[tuple[int, float, bool]] = []
    found = find([(0.8, HAPPENS)], margin=margin, asked=asked)
    assert found.inner[0] < 0.8 <= found.outer[0]
    assert found.outer[0] - found.inner[0] <= 1e-3 * found.outer[0]
    assert sum(exact for _, _, exact in asked) <= most


def test_both_ends_of_a_bracket_are_exact() -> None:
    """The way outwards says of every spin what is true of one 0.3 % farther out, or nearer."""
    for error in (1.003, 0.997):
        for start in 0.01 * 1.25 ** np.arange(8) * np.array([0.999, 1.001])[:, None]:
            asked: list[tuple[int, float, bool]] = []
            searches = [[(at, HAPPENS)] for at in start.tolist()]
            found = find(*searches, width=0.3, coarse=lambda spin, error=error: error * spin, asked=asked)
            exact = {(i, spin) for i, spin, sure in asked if sure}
            for i in np.flatnonzero(found.outcome == HAPPENS):
                assert found.inner[i] < start[i] <= found.outer[i]
                assert {(i, found.inner[i]), (i, found.outer[i])} <= exact
