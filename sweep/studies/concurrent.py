"""Runs several searches in parallel, and answers their simultaneous requests in one batch.

A minimiser asks for a few trajectories and waits for them. On its own it leaves most lanes and threads idle.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from queue import SimpleQueue
from typing import Any, TypeVar

Question = TypeVar("Question")
Answer = TypeVar("Answer")
Found = TypeVar("Found")


def run_concurrently(
    searches: Sequence[Callable[[Callable[[Question], Answer]], Found]],
    answer: Callable[[list[Question]], Iterable[Answer]],
    enough: Callable[[Found], bool] = lambda _: False,
) -> list[Found]:
    """Return the results of the searches, in order, except those still running when another result was `enough`.

    Parameters
    ----------
    searches : each is called in its own thread, with a function that answers its requests
    answer : called in this thread with one request of every running search, in order, so that the same searches always
        give the same batches

    Raises
    ------
    Exception
        Whatever `answer` or a search raised; other searches end at their next request.
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
                for (_, reply), answered in zip(pairs, answers, strict=True):
                    reply.set_result(answered)
                waiting.clear()
        finally:
            for _, reply in waiting.values():
                reply.cancel()
    for end in ends:
        if not isinstance(error := end.exception(), CancelledError) and error:
            raise error
    return [found[k] for k in sorted(found)]
