"""Ends commands with an exit code, and reports errors as lines that a user can act on."""

from __future__ import annotations

import errno
import os
import sys
from dataclasses import replace
from pathlib import Path
from traceback import walk_tb
from typing import Any, NoReturn

import click

from sweep.faults import CompileError, Error, Fault, InputError, fault_of, printable, refusing
from sweep.interrupt import INTERRUPTED

DONE, ROWS_FAILED, WRONG_INPUT, TOO_MANY_FAILED = range(4)
CLOSED_PIPE = 141
"""Exit code that shells report for a command ended by SIGPIPE, as when `head` has read enough of its output."""


def say(text: str, *, err: bool = False) -> None:
    """Print lines that may quote files and their names, with control characters escaped."""
    click.echo("\n".join(map(printable, text.split("\n"))), err=err)


def refuse(option: str | Path, message: str) -> NoReturn:
    """Raise an `InputError` about an option or a file."""
    raise fault_of(message, file=str(option))


def _in_options(error: InputError, command: click.Command) -> InputError:
    """Put the option in the place of an argument that begins a fault's path, unless the fault lies in a file."""
    options: dict[Any, str] = {name: each.opts[0] for each in command.params if isinstance(each, click.Option)
                               for name in (each.name, each.opts[0].lstrip("-"))}  # fmt: skip

    def named(fault: Fault) -> Fault:
        first, *rest = fault.path or ("",)
        if fault.file or first not in options:
            return fault
        if rest and isinstance(rest[0], str):  # of an option that takes NAME=VALUE
            return replace(fault, path=(f"{options[first]} {rest[0]}", *rest[1:]))
        return replace(fault, path=(options[first], *rest))

    return InputError(map(named, error.faults))


_PACKAGE = Path(__file__).parents[1]
_FULL = {errno.ENOSPC, errno.EDQUOT}


def _of_user(error: OSError) -> bool:
    """Return whether the user can fix a system error: it names a file outside the package, or a disk is full."""
    if error.filename is None:
        return error.errno in _FULL
    return not Path(str(error.filename)).is_relative_to(_PACKAGE)


class Commands(click.Group):
    """A group of commands that prints errors the user can fix as lines on stderr, and sets the exit code.

    All other errors are bugs and show their traceback.
    """

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            click.echo("interrupted", err=True)
            sys.exit(INTERRUPTED)
        except BrokenPipeError:
            # Discard what is left in the buffers when Python ends.
            for stream in (sys.stdout, sys.stderr):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
            sys.exit(CLOSED_PIPE)
        except OSError as error:
            if not _of_user(error):
                raise
            say(f"{error.filename or 'standard output'}: {error.strerror or error}", err=True)
        except InputError as error:
            say(str(_in_options(error, self.commands[ctx.invoked_subcommand or ""])), err=True)
        except Error as error:
            say(str(error), err=True)
        except CompileError as error:  # of whoever edits the code: the place says more than a traceback
            say(str(error), err=True)
            sys.exit(1)
        except TypeError as error:
            file, line = refusing(error) or ("", 0)
            if not any(Path(file).is_relative_to(_PACKAGE / each) for each in ("models", "kernels")):
                raise
            *_, (frame, at) = walk_tb(error.__traceback__)  # a hook of whoever edits the code
            say(f"{file}:{line}: {error}\n  called at {frame.f_code.co_filename}:{at}", err=True)
            sys.exit(1)
        sys.exit(WRONG_INPUT)
