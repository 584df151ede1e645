"""Defines errors that the user can fix: faults of a configuration, each with its place, and of files."""

from __future__ import annotations

import ast
import linecache
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import islice
from os.path import exists
from pathlib import Path as FilePath

Path = tuple[str | int, ...]
"""Keys and list indices from the top of a document."""

_MAX_LINES = 20


def spell(path: Path) -> str:
    """Return a path as text: body.b[2] for ("body", "b", 2)."""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{brief(part, 60)}" if text else brief(part, 60)
    return text


def quote(value: object) -> str:
    """Return a value as YAML writes it, shortened in the middle if it is long."""
    if value is None or isinstance(value, bool):
        return "nothing" if value is None else str(value).lower()
    return brief(repr(value).removesuffix(".0") if isinstance(value, float) else repr(value), 60)


def brief(text: str, limit: int = 200) -> str:
    """Return `text` in printable form, shortened in the middle if it is long."""
    shown = printable(text)
    return shown if len(shown) <= limit else f"{shown[: limit // 2]}…{shown[-limit // 2 :]}"


def printable(text: str) -> str:
    """Return `text` on one line, escaping characters that cannot be printed or could control a terminal."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def either(names: Iterable[str]) -> str:
    """Join alternatives: "a, b or c"; "" if there are none."""
    *most, last = [*names] or [""]
    return f"{', '.join(most)} or {last}" if most else last


def suggestion(word: object, names: Iterable[str], paths: Mapping[str, str] | None = None) -> str:
    """Return a hint which of `names` a misspelt `word` may mean, to add to a message; "" if none is close.

    `paths` gives the spelling to suggest for a name, if that is not the name itself.
    """
    spelled = {name.lower(): (paths or {}).get(name, name) for name in names}
    close = get_close_matches(word.lower()[:100], spelled, n=1) if isinstance(word, str) else []
    return f" (did you mean {spelled[close[0]]}?)" if close else ""


def counted(number: int, noun: str, plural: str = "") -> str:
    """Return a number and a noun that agree, such as "1 cell" or "3 bodies"."""
    return f"{number} {noun if number == 1 else plural or f'{noun}s'}"


_CLOCK = ((172800, 86400, "days", 3600, "h"), (3600, 3600, "h", 60, "min"), (120, 60, "min", 1, "s"))
"""For each unit of time: seconds above which it is used, its size in seconds, and the next smaller unit."""


def duration(seconds: float) -> str:
    """Return a time as people say it, such as "0.35 s", "57 min", "1 h 20 min" or "120 days"."""
    for start, size, unit, part, smaller in _CLOCK:
        if seconds >= start:
            whole, rest = divmod(round(seconds / part), size // part)
            return f"{round(seconds / size)} {unit}" if whole >= 10 or not rest else f"{whole} {unit} {rest} {smaller}"
    return "under 1 ms" if 0 < seconds < 1e-3 else f"{float(f'{seconds:.2g}'):g} s"


def refusal(given: object, wanted: str, names: Iterable[str] = ()) -> str:
    """Return a message that a value is `given` where it must be `wanted`, with a hint which of `names` may be meant."""
    return f"must be {wanted}, not {quote(given)}{suggestion(given, names)}"


@dataclass(frozen=True)
class Fault:
    """What is wrong and what to do about it, and where; `line` and `column` count from one."""

    file: str
    """The file, or "" for a value that does not come from a file; `path` then begins with the argument that gave it."""
    line: int | None
    column: int | None
    path: Path
    message: str

    def __str__(self) -> str:
        place = ":".join(str(part) for part in (self.file, self.line, self.column) if part is not None)
        return printable(": ".join(part for part in (place, spell(self.path), self.message) if part))


class Error(ValueError):
    """An error that the user can fix, such as an unusable configuration or file; the text says how."""


class FileError(Error):
    """A dataset or a folder cannot be used; the message names it, and says why and what to do."""


class InputError(Error):
    """A configuration, an argument, a film or a table is wrong; `faults` has an entry for each error, by line."""

    def __init__(self, faults: Iterable[Fault]) -> None:
        self.faults = sorted(faults, key=lambda fault: (fault.line or 0, fault.column or 0))
        super().__init__(self.faults)  # pickling passes these to other processes

    def __str__(self) -> str:
        lines = [str(fault) for fault in self.faults[:_MAX_LINES]]
        if more := len(self.faults) - len(lines):
            lines.append(str(Fault(self.faults[0].file, None, None, (), f"{more} more faults")))
        return "\n".join(lines)


def fault_of(message: str, *path: str | int, file: str = "", line: int | None = None) -> InputError:
    """Return the error for one fault that has no column."""
    return InputError([Fault(file, line, None, path, message)])


def local_path(path: object, argument: str = "output", wanted: str = "the path of a file or a folder") -> FilePath:
    """Return the path that an argument gives.

    Raises
    ------
    InputError
        if it is not text or a path, or an address of another place, such as s3://….
    """
    if not (isinstance(path, str | os.PathLike) and isinstance(os.fspath(path), str)):
        raise fault_of(refusal(path, wanted), argument)
    if re.match(r"[A-Za-z][A-Za-z0-9+.-]+://", address := os.fspath(path)):
        raise fault_of("an address, where only files of this machine are read and written; copy it here", file=address)
    return FilePath(path)


def refusing(error: Exception) -> tuple[str, int] | None:
    """Return the file and line of the function that Python did not call, if `error` says that arguments do not fit it.

    The traceback ends where it is called, so that expression is evaluated again, without its arguments.
    """
    last = error.__traceback__
    while last and last.tb_next:
        last = last.tb_next
    if not last or not isinstance(error, TypeError) or "argument" not in str(error):
        return None
    frame, file = last.tb_frame, last.tb_frame.f_code.co_filename
    line, end, column, stop = next(islice(frame.f_code.co_positions(), last.tb_lasti // 2, None))
    with suppress(Exception):  # whatever it is, the error itself is reported
        for node in ast.walk(ast.parse("".join(linecache.getlines(file)))):
            place = [getattr(node, each, None) for each in ("lineno", "end_lineno", "col_offset", "end_col_offset")]
            if isinstance(node, ast.Call) and place == [line, end, column, stop]:
                called = eval(compile(ast.Expression(node.func), file, "eval"), frame.f_globals, frame.f_locals)
                return called.__code__.co_filename, called.__code__.co_firstlineno
    return None


class CompileError(RuntimeError):
    """Code that becomes part of a kernel does not compile; the message names the place in two lines.

    Attributes
    ----------
    places : the files and lines that Numba's message names, from the outermost function inwards
    reason : why compiling failed
    """

    def __init__(self, places: Sequence[tuple[str, int]], reason: str) -> None:
        self.places, self.reason = places, reason
        file, line = next((place for place in reversed(places) if exists(place[0])), ("a kernel", 0))
        super().__init__(
            f"{file}:{line}: does not compile: {reason}\n"
            "  with NUMBA_DISABLE_JIT=1 the same code runs in plain Python, where a debugger stops"
        )
