"""What a command says, and how it ends: exit codes, and errors as lines that a user can act on."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from sweep.interrupt import INTERRUPTED
from sweep.parameters import Parameter

if TYPE_CHECKING:
    from sweep.config import Fault

DONE, ROWS_FAILED, WRONG_INPUT, TOO_MANY_FAILED = range(4)
CLOSED_PIPE = 141
"""As the shell reports of any command that SIGPIPE ends: what read its output, such as `head`, has enough."""


def say(text: str, *, err: bool = False) -> None:
    """Print lines that may quote files and their names."""
    from sweep.config.faults import printable

    click.echo("\n".join(map(printable, text.split("\n"))), err=err)


def refuse(option: str, message: str) -> NoReturn:
    """Raise the fault of an option."""
    from sweep.config.faults import ConfigError, Fault

    raise ConfigError([Fault(option, None, None, (), message)])


@contextmanager
def of_option(option: str, known: Mapping[str, Parameter]) -> Iterator[None]:
    """Name `option` in faults of the parameters that it gave."""
    from dataclasses import replace

    from sweep.config.faults import ConfigError

    def named(fault: Fault) -> Fault:
        first, *rest = fault.path or ("",)
        ours = not fault.file and (not first or first in known)
        return replace(fault, path=(f"{option} {first}".rstrip(), *rest)) if ours else fault

    try:
        yield
    except ConfigError as error:
        raise ConfigError(list(map(named, error.faults))) from None


@contextmanager
def needs_bokeh(what: str) -> Iterator[None]:
    """Make a missing Bokeh a fault that tells how to install it."""
    try:
        yield
    except ModuleNotFoundError as error:
        if error.name not in ("bokeh", "tornado"):
            raise
        refuse(what, "needs Bokeh, which is not installed: pip install 'rattleback-sweep[explore]'")


@contextmanager
def about(file: Path) -> Iterator[None]:
    """Make any error in reading a dataset of another program a fault of that file."""
    from sweep.results.store import StoreError

    try:
        yield
    except (StoreError, OSError):
        raise
    except Exception as error:
        known = isinstance(error, ValueError) and "allowed" in str(error)
        reason = str(error) if known else f"not a dataset of sweep: {type(error).__name__}: {error}"
        raise StoreError(f"{file}: {reason}".splitlines()[0]) from None


class Explained:
    """Turns errors that the user can mend into lines on stderr and exit code 2."""

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        if error is None:
            return
        if isinstance(error, KeyboardInterrupt):
            click.echo("interrupted", err=True)
            sys.exit(INTERRUPTED)
        if isinstance(error, BrokenPipeError):
            # What is left in the buffers when Python ends goes nowhere.
            for stream in (sys.stdout, sys.stderr):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
            sys.exit(CLOSED_PIPE)
        from sweep.config.faults import ConfigError
        from sweep.results.store import StoreError

        if isinstance(error, ConfigError | StoreError):
            say(str(error), err=True)
            sys.exit(WRONG_INPUT)
        if isinstance(error, OSError):
            say(f"{error.filename or 'a file'}: {error.strerror or error}", err=True)
            sys.exit(WRONG_INPUT)
