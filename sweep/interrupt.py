"""Handles Ctrl-C: one line and the end while a command starts; later, a stop where results are consistent.

Python raises KeyboardInterrupt wherever the program happens to be.  Inside an import it prints a traceback; numpy
turned one into a TypeError; in a lock of `concurrent.futures` it became "cannot release un-acquired lock", or left
the lock locked, so that the process never ended (5 of 1200 searches interrupted at random moments).
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

INTERRUPTED = 130
"""The exit code of an interrupted command."""

_heard = False


def end_at_once() -> None:
    """From now on Ctrl-C prints one line and ends the process, unless it was started to ignore Ctrl-C."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _end)


def raise_again() -> None:
    """From now on Ctrl-C raises KeyboardInterrupt, as Python has it: there is work to finish or files to remove."""
    if signal.getsignal(signal.SIGINT) is _end:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@contextmanager
def deferred() -> Iterator[None]:
    """Within the block, raise the first Ctrl-C at the next `point`, or at the end of the block; a second one at once.

    Outside the main thread, or where somebody else listens to Ctrl-C, this changes nothing.
    """
    global _heard
    listening = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if _heard or not listening or threading.current_thread() is not threading.main_thread():
        yield
        return
    signal.signal(signal.SIGINT, _defer)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        missed, _heard = _heard, False
    if missed:
        raise KeyboardInterrupt


def heard() -> bool:
    """Return whether a Ctrl-C waits for the next `point`."""
    return _heard


def point() -> None:
    """Raise a Ctrl-C that has been deferred; to be called where everything is consistent, some times a second."""
    global _heard
    if _heard:
        _heard = False
        raise KeyboardInterrupt


def _end(_number: int, _frame: object) -> None:
    os.write(2, b"interrupted\n")
    os._exit(INTERRUPTED)


def _defer(_number: int, _frame: object) -> None:
    global _heard
    _heard = True
    signal.signal(signal.SIGINT, signal.default_int_handler)
