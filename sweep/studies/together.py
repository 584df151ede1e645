"""Runs several searches side by side, and answers in one batch what they ask at the same time.

A minimiser asks for a few trajectories, and goes on when it knows them.  Alone it leaves most lanes and threads idle.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from queue import SimpleQueue
from typing import Any, TypeVar

Question = TypeVar("Question")
Answer = TypeVar("Answer")
Found = TypeVar("Found")


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
    asked: SimpleQueue[tuple[int, Any, Future[Answer] | None]] = SimpleQueue()
    found: dict[int, Found] = {}

    def run(k: int) -> None:
        def ask(question: Question) -> Answer:
            reply: Future[Answer] = Future()
            asked.put((k, question, reply))
            return reply.result()

        try:
            found[k] = searches[k](ask)
        finally:
            asked.put((k, None, None))

    with ThreadPoolExecutor(len(searches)) as pool:
        ends = [pool.submit(run, k) for k in range(len(searches))]
        running, waiting = len(searches), dict[int, tuple[Question, Future[Answer]]]()
        try:
            while running:
                k, question, reply = asked.get()
                if reply:
                    waiting[k] = question, reply
                else:
                    running -= 1
                if len(waiting) < running or not waiting:
                    continue
                if any(map(enough, found.values())):
                    break
                pairs = [waiting[k] for k in sorted(waiting)]
                answers = [*answer([question for question, _ in pairs])]
                for (_, reply), told in zip(pairs, answers, strict=True):
                    reply.set_result(told)
                waiting.clear()
        finally:
            for _, reply in waiting.values():
                reply.cancel()
    for end in ends:
        if not isinstance(error := end.exception(), CancelledError) and error:
            raise error
    return [found[k] for k in sorted(found)]
