"""Time that a run spends in some of its calls.  Nothing is left in the code that runs when nobody measures."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from functools import wraps
from typing import Any
from unittest.mock import patch

Place = tuple[Any, str]
"""A class or module, and the name of a function in it."""


@contextmanager
def stopwatch(places: Mapping[Place, str]) -> Iterator[dict[str, float]]:
    """Time the calls of the functions at `places`, by the name of the share to which each belongs.

    Yields
    ------
    Seconds by share.  A call inside another one counts for its own share alone.  All calls must come from one thread.
    """
    seconds = dict.fromkeys(places.values(), 0.0)
    inner: list[float] = []
    """For each call under way, the time spent so far in calls inside it."""

    def timed(function: Callable[..., Any], share: str) -> Callable[..., Any]:
        @wraps(function)
        def call(*args: Any, **options: Any) -> Any:
            inner.append(0.0)
            began = time.perf_counter()
            try:
                return function(*args, **options)
            finally:
                spent = time.perf_counter() - began
                seconds[share] += spent - inner.pop()
                if inner:
                    inner[-1] += spent

        return call

    with ExitStack() as patches:
        for (owner, name), share in places.items():
            patches.enter_context(patch.object(owner, name, timed(vars(owner)[name], share)))
        yield seconds
