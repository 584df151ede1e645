"""End commands: with exit codes, and with errors as lines that a user can act on."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import click

from sweep.ended import ended
from sweep.faults import ConfigError, Fault, Refused, fault_of, printable
from sweep.interrupt import INTERRUPTED
from sweep.parameters import Parameter

DONE, ROWS_FAILED, WRONG_INPUT, TOO_MANY_FAILED = range(4)
CLOSED_PIPE = 141
"""As the shell reports any command that SIGPIPE ends: what read its output, such as `head`, has enough."""


def say(text: str, *, err: bool = False) -> None:
    """Print lines that may quote files and their names."""
    click.echo("\n".join(map(printable, text.split("\n"))), err=err)


def refuse(option: str | Path, message: str) -> NoReturn:
    """Raise the fault of an option, or of a file."""
    raise fault_of(message, file=str(option))


@contextmanager
def of_option(option: str, known: Mapping[str, Parameter]) -> Iterator[None]:
    """Name `option` in faults of the parameters that it gave."""

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
    try:
        yield
    except (Refused, OSError):
        raise
    except Exception as error:
        refuse(file, f"not a dataset of sweep: {type(error).__name__}: {error}".partition("\n")[0])


class Commands(click.Group):
    """Commands whose errors, where the user can mend them, become lines on stderr and an exit code."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except click.NoSuchOption as error:
            verb = error.ctx.info_name if error.ctx else ""
            if not (words := ended(error.option_name, f"{verb} {error.option_name}")):
                raise
            say(f"{error.option_name}: {words}", err=True)
        except KeyboardInterrupt:
            click.echo("interrupted", err=True)
            sys.exit(INTERRUPTED)
        except BrokenPipeError:
            # What is left in the buffers when Python ends goes nowhere.
            for stream in (sys.stdout, sys.stderr):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
            sys.exit(CLOSED_PIPE)
        except OSError as error:
            say(f"{error.filename or 'a file'}: {error.strerror or error}", err=True)
        except Refused as error:
            say(str(error), err=True)
        sys.exit(WRONG_INPUT)
