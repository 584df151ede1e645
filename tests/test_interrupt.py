"""Ctrl-C waits for a point where everything is consistent; a second one does not."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator

import pytest

from sweep.interrupt import deferred, point


@pytest.fixture(autouse=True)
def as_python_has_it() -> Iterator[None]:
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    signal.signal(signal.SIGINT, before)


def ctrl_c() -> None:
    signal.raise_signal(signal.SIGINT)


def reached(work: Callable[[Callable[[str], None]], None]) -> list[str]:
    """What a block reports before Ctrl-C is raised from it."""
    reported = list[str]()
    with pytest.raises(KeyboardInterrupt):
        deferred()(work)(reported.append)
    return reported


def test_an_interrupt_is_raised_once_at_the_next_point() -> None:
    def work(tell: Callable[[str], None]) -> None:
        point()
        ctrl_c()
        tell("after Ctrl-C")
        try:
            point()
        finally:
            point()  # cleaning up is not interrupted again
            tell("cleaned up")

    assert reached(work) == ["after Ctrl-C", "cleaned up"]


def test_an_interrupt_is_raised_at_the_end_of_a_block_without_points() -> None:
    def work(tell: Callable[[str], None]) -> None:
        ctrl_c()
        tell("end")

    assert reached(work) == ["end"]
    with deferred():
        point()  # it has been heard: nothing is left for a later block


@pytest.mark.parametrize("inside", [True, False])
def test_an_inner_block_leaves_an_interrupt_to_the_outer_one(inside: bool) -> None:
    def work(tell: Callable[[str], None]) -> None:
        if not inside:
            ctrl_c()
        with deferred():
            if inside:
                ctrl_c()
        tell("end")

    assert reached(work) == ["end"]


@pytest.mark.parametrize("answered", [True, False])
def test_a_second_interrupt_is_raised_at_once(answered: bool) -> None:
    def work(tell: Callable[[str], None]) -> None:
        ctrl_c()
        try:
            if answered:
                point()
        finally:
            tell("before the second")
            ctrl_c()
            tell("after the second")

    assert reached(work) == ["before the second"]


def test_an_error_in_the_block_is_the_one_raised() -> None:
    @deferred()
    def work() -> None:
        ctrl_c()
        raise ValueError("of the block")

    with pytest.raises(ValueError, match="of the block"):
        work()


@pytest.mark.parametrize("handler", [signal.SIG_IGN, lambda *_: None])
def test_a_handler_of_somebody_else_is_left_alone(handler: signal._HANDLER) -> None:
    signal.signal(signal.SIGINT, handler)
    with deferred():
        assert signal.getsignal(signal.SIGINT) is handler
        ctrl_c()
        point()
    assert signal.signal(signal.SIGINT, signal.default_int_handler) is handler


def test_nothing_is_changed_in_another_thread() -> None:
    def work() -> None:
        with deferred():
            handlers.append(signal.getsignal(signal.SIGINT))

    handlers: list[object] = []
    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert handlers == [signal.default_int_handler]
