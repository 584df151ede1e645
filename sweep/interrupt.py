"""What Ctrl-C does to a command: while it starts, one line and the end; once there is something to keep, an exception.

A KeyboardInterrupt that is raised inside an import prints a traceback, or is lost in a callback that may not raise.
"""

from __future__ import annotations

import os
import signal

INTERRUPTED = 130
"""The exit code of an interrupted command."""


def end_at_once() -> None:
    """From now on Ctrl-C prints one line and ends the process, unless it was started to ignore Ctrl-C."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _end)


def raise_again() -> None:
    """From now on Ctrl-C raises KeyboardInterrupt, as Python has it: there is work to finish or files to remove."""
    if signal.getsignal(signal.SIGINT) is _end:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _end(_number: int, _frame: object) -> None:
    os.write(2, b"interrupted\n")
    os._exit(INTERRUPTED)
