"""Faults of a configuration, each with the place where the user can correct it."""

from __future__ import annotations

import reprlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches

Path = tuple[str | int, ...]
"""Keys and list indices from the top of a document."""


def spell(path: Path) -> str:
    """A path as text: body.b[2] for ("body", "b", 2)."""
    text = ""
    for part in (brief(part, 60) if isinstance(part, str) else part for part in path):
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


_MAX_LINES = 100

_REPR = reprlib.Repr()
_REPR.maxstring = _REPR.maxother = _REPR.maxlong = 60


def quote(value: object) -> str:
    """A value as YAML has it; only its beginning and end if it is long."""
    if value is None or isinstance(value, bool):
        return "nothing" if value is None else str(value).lower()
    try:
        return _REPR.repr(value).removesuffix(".0") if isinstance(value, float) else _REPR.repr(value)
    except ValueError:  # Python refuses to spell integers of more than 4300 digits
        return "a number with thousands of digits"


def brief(text: str, limit: int = 200) -> str:
    """`text`; without its middle if it is long."""
    return text if len(text) <= limit else f"{text[: limit // 2]}…{text[-limit // 2 :]}"


def printable(text: str) -> str:
    """`text` on one line, with characters that cannot be printed, or could control a terminal, escaped."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def suggestion(word: object, names: Iterable[str], paths: Mapping[str, str] | None = None) -> str:
    """The one of `names` that may be meant by a misspelt `word`, as words to add to a message; "" if none is close.

    Parameters
    ----------
    paths : what to write for a name, where that is not the name itself
    """
    spelled = {name.lower(): name for name in names}
    close = get_close_matches(word.lower()[:100], spelled, n=1) if isinstance(word, str) else []
    return f" (did you mean {(paths or {}).get(spelled[close[0]], spelled[close[0]])}?)" if close else ""


@dataclass(frozen=True)
class Fault:
    """What is wrong, where, and what is allowed; `line` and `column` count from one."""

    file: str
    """The file, or "" for a value that comes from no file; `path` then begins with the argument that gave it."""
    line: int | None
    column: int | None
    path: Path
    message: str

    def __str__(self) -> str:
        place = ":".join(str(part) for part in (self.file, self.line, self.column) if part is not None)
        return printable(": ".join(part for part in (place, spell(self.path), self.message) if part))


class ConfigError(Exception):
    """A configuration that cannot be run; `faults` has an entry for each thing to correct."""

    def __init__(self, faults: list[Fault]) -> None:
        """`faults` in any order; those of a file are told in the order of its lines."""
        faults = sorted(faults, key=lambda fault: (fault.line or 0, fault.column or 0))
        lines = [str(fault) for fault in faults[:_MAX_LINES]]
        if more := len(faults) - len(lines):
            lines.append(str(Fault(faults[0].file, None, None, (), f"and {more} more")))
        super().__init__("\n".join(lines))
        self.faults = faults
