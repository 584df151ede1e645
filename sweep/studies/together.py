"""Runs several searches side by side, and answers in one batch what they ask at the same time.

A minimiser asks for a few trajectories, and goes on when it knows them.  Alone it leaves most lanes and threads idle.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor
from queue import SimpleQueue
from typing import Any, TypeVar

Question = TypeVar("Question")
Answer = TypeVar("Answer")
Found = TypeVar("Found")

_ENDED = object()


def together(
    searches: Sequence[Callable[[Callable[[Question], Answer]], Found]],
    answer: Callable[[list[Question]], Iterable[Answer]],
    enough: Callable[[Found], bool] = lambda _: False,
) -> list[Found]:
    """What the searches return, in their order, without those that have not ended when one of the others was `enough`.

    Parameters
    ----------
    searches : each is called with a function that answers its questions, in a thread of its own
    answer : called in this thread with a question of every search that goes on, in their order, so that the same
        searches always ask the same batches

    Raises
    ------
    Exception
        What `answer` or a search has raised; other searches end at their next question.
    """
    asked: SimpleQueue[tuple[int, Any]] = SimpleQueue()
    answered: list[SimpleQueue[Any]] = [SimpleQueue() for _ in searches]
    found: dict[int, Found] = {}

    def run(k: int) -> None:
        def ask(question: Question) -> Answer:
            asked.put((k, question))
            if (told := answered[k].get()) is _ENDED:
                raise CancelledError
            return told  # type: ignore[no-any-return]

        try:
            found[k] = searches[k](ask)
        finally:
            asked.put((k, _ENDED))

    with ThreadPoolExecutor(len(searches)) as pool:
        ends = [pool.submit(run, k) for k in range(len(searches))]
        running, waiting = len(searches), dict[int, Question]()
        try:
            while running:
                k, question = asked.get()
                if question is _ENDED:
                    running -= 1
                else:
                    waiting[k] = question
                if len(waiting) < running:
                    continue
                if any(map(enough, found.values())):
                    break
                order = sorted(waiting)
                for k, told in zip(order, answer([waiting[k] for k in order]) if order else (), strict=True):
                    answered[k].put(told)
                waiting.clear()
        finally:
            for each in answered:
                each.put(_ENDED)
    for end in ends:
        if not isinstance(error := end.exception(), CancelledError) and error:
            raise error
    return [found[k] for k in sorted(found)]
