"""The search outwards from zero, on events whose spins are known."""

from __future__ import annotations

from typing import Any

import numpy as np

from sweep.studies.bracket import AT_ONCE, FAILED, HAPPENS, NOT_YET, UNDECIDED, Bracket, search


def find(*searches: list[tuple[float, int]], begin: float = 0.01, limit: float = 10.0, width: float = 1e-3) -> Bracket:
    """Brackets where the outcome, `NOT_YET` at first, changes at the spins of each search."""

    def ask(which: Any, spins: Any) -> Any:
        return np.array([
            next((outcome for start, outcome in reversed(searches[i]) if spin >= start), NOT_YET)
            for i, spin in zip(which, spins, strict=True)
        ])  # fmt: skip

    return search(ask, np.full(len(searches), begin), limit, width)


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
