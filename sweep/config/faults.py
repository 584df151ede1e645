"""Faults of a configuration, each with the place where the user can correct it."""

from __future__ import annotations

import reprlib
from dataclasses import dataclass

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
    """A value as it was given; only its beginning and end if it is long."""
    try:
        return _REPR.repr(value)
    except ValueError:  # Python refuses to spell integers of more than 4300 digits
        return "a number with thousands of digits"


def brief(text: str, limit: int = 200) -> str:
    """`text`; without its middle if it is long."""
    return text if len(text) <= limit else f"{text[: limit // 2]}…{text[-limit // 2 :]}"


def printable(text: str) -> str:
    """`text` on one line, with characters that cannot be printed, or could control a terminal, escaped."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


@dataclass(frozen=True)
class Fault:
    """What is wrong, where, and what is allowed; `line` and `column` count from one."""

    file: str
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
        lines = [str(fault) for fault in faults[:_MAX_LINES]]
        if more := len(faults) - len(lines):
            lines.append(f"{printable(faults[0].file)}: and {more} more")
        super().__init__("\n".join(lines))
        self.faults = faults
