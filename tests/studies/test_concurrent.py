"""Searches side by side are answered in batches, end together where one was enough, and never wait for ever."""

from collections.abc import Callable
from functools import partial

import pytest

from sweep.studies.concurrent import run_concurrently

Ask = Callable[[int], int]

pytestmark = pytest.mark.timeout(20)


class Squares:
    """Squares numbers, and remembers the batches."""

    def __init__(self) -> None:
        self.batches: list[list[int]] = []

    def __call__(self, numbers: list[int]) -> list[int]:
        self.batches.append(numbers)
        return [number**2 for number in numbers]


def total(ask: Ask, first: int, questions: int) -> int:
    return sum(ask(first + k) for k in range(questions))


def test_what_is_asked_at_the_same_time_is_one_batch_in_the_order_of_the_searches() -> None:
    for _ in range(20):
        answer = Squares()
        searches = [partial(total, first=10 * k, questions=k) for k in (3, 0, 1)]
        assert run_concurrently(searches, answer) == [2885, 0, 100]
        assert answer.batches == [[30, 10], [31], [32]]


def test_searches_stop_when_one_was_enough() -> None:
    for _ in range(20):
        answer = Squares()
        searches = [partial(total, first=k, questions=k) for k in (5, 2, 2, 4)]
        assert run_concurrently(searches, answer, lambda found: found == 13) == [13, 13]
        assert answer.batches == [[5, 2, 2, 4], [6, 3, 3, 5]]


def test_a_fault_in_a_search_is_raised_when_the_others_have_ended() -> None:
    def fault(ask: Ask) -> int:
        raise ZeroDivisionError(ask(3))

    with pytest.raises(ZeroDivisionError, match="9"):
        run_concurrently([fault, partial(total, first=1, questions=3)], Squares())


@pytest.mark.parametrize("fault", [ZeroDivisionError, KeyboardInterrupt])
def test_a_fault_in_an_answer_ends_all_searches(fault: type[BaseException]) -> None:
    def answer(numbers: list[int]) -> list[int]:
        if max(numbers) > 2:
            raise fault
        return numbers

    with pytest.raises(fault):
        run_concurrently([partial(total, first=k, questions=3) for k in range(3)], answer)
