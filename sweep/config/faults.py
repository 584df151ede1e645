"""Faults of a configuration, each with the place where the user can mend it."""

from __future__ import annotations

from dataclasses import dataclass

Path = tuple[str | int, ...]
"""Keys and list indices from the top of a document."""


def spell(path: Path) -> str:
    """body.b[2] for ("body", "b", 2)."""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


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
        return ": ".join(part for part in (place, spell(self.path), self.message) if part)


class ConfigError(Exception):
    """A configuration that cannot be run; `faults` has one entry per thing to mend."""

    def __init__(self, faults: list[Fault]) -> None:
        super().__init__("\n".join(map(str, faults)))
        self.faults = faults
