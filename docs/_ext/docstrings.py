"""Sections of our docstrings as lists.

They look like numpydoc's, but what follows the colon of a parameter is its meaning, not its type, which the signature
has; napoleon would set a meaning of two lines as a type and its explanation.  Bars are those of |λ|.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from sphinx.application import Sphinx

_ENTRY = re.compile(r"\*{0,2}\w+(, \*{0,2}\w+)* : ")
_SECTIONS = ("Parameters", "Returns", "Raises", "Notes")


def _rewrite(_app: Sphinx, _what: str, _name: str, _object: Any, _options: Any, lines: list[str]) -> None:
    lines[:] = list(_sections([line.replace("|", r"\|") for line in lines]))


def _sections(lines: list[str]) -> Iterator[str]:
    section, in_entry = "", False
    for before, line, after in zip(["", *lines], lines, [*lines[1:], ""], strict=False):
        if line in _SECTIONS and set(after) == {"-"}:
            section, in_entry = line, False
            yield from ("", f"**{line}**", "")
        elif before == section and section and set(line) == {"-"}:
            continue
        elif _ENTRY.match(line) or (section == "Raises" and line[:1].strip()):
            in_entry = True
            yield from ("", _entry(line))
        elif in_entry and line.startswith(" "):
            yield f"  {line.strip()}"
        else:
            in_entry = in_entry and not line.strip()
            yield line


def _entry(line: str) -> str:
    """A list's entry for `a, b : meaning`, or for an exception whose meaning is on the next line."""
    names, _, meaning = line.partition(" : ")
    shown = re.sub(r"(\*{0,2}\w+)", r"``\1``", names)
    return f"- {shown}: {meaning}".rstrip()


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("autodoc-process-docstring", _rewrite)
    return {"parallel_read_safe": True}
