"""YAML documents as plain values, with the line and column of every part.

Documents are YAML 1.2, in which 1e-3 is a number and `no` a word.  Only plain data is accepted: tags,
anchors and duplicate keys are refused, so that nothing in a file can run code, repeat itself without
end, or override an earlier line unseen.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from sweep.config import files
from sweep.config.faults import ConfigError, Fault, Path, brief
from sweep.models.origin import Origin

LIMIT = 1 * files.MIB
"""Largest document, in bytes: reading takes some 20 s per megabyte."""

_NUMBER = r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?"
_FLOAT = re.compile(_NUMBER)
_RANGE = re.compile(rf"(?P<start>{_NUMBER})\.\.(?P<stop>{_NUMBER}):(?P<num>{_NUMBER})")
_SPECIAL = {".inf": float("inf"), "-.inf": float("-inf"), ".nan": float("nan")}
_WORDS: dict[str, bool | None] = {
    "true": True, "True": True, "false": False, "False": False, "null": None, "~": None, "": None,
}  # fmt: skip


@dataclass
class Document:
    """The values of a configuration, and where each comes from: a line and column of a file, or an argument."""

    file: str
    """"" for a mapping, which is no file."""
    values: Any = None
    keys: dict[Path, tuple[int, int]] = field(default_factory=dict)
    """Line and column of each key of a mapping, by the path to its value."""
    places: dict[Path, tuple[int, int]] = field(default_factory=dict)
    """Line and column of each value, by its path."""
    arguments: dict[Path, tuple[str, Path]] = field(default_factory=dict)
    """For each value that an argument gave, and each section that it added: the argument, and the path that it set."""
    table: tuple[str, Any] | None = None
    """Name and columns of the table of cases, once it is read."""
    model: Origin | None = None
    """Where the model comes from that a user brings, once it is read."""

    def read_beside(self, key: str, name: str, limit: int) -> tuple[FilePath, str]:
        """Path and text of the file `name`, relative to this document's folder, that it names by `key`.

        Raises
        ------
        ConfigError
            if the file cannot be read, or is larger than `limit` bytes.
        """
        path = FilePath(self.file).parent / name
        try:
            return path, files.read(path, limit)
        except FileNotFoundError:
            reason = f"no such file in {path.parent}"
        except OSError as error:
            reason = f"cannot be read: {error.strerror}"
        except UnicodeDecodeError as error:
            reason = f"not UTF-8 text: byte {error.start}"
        raise ConfigError([self.fault((key,), f"{brief(name)}: {reason}")])

    def fault(self, path: Path, message: str, *, at_key: bool = False) -> Fault:
        """A fault at `path`; it is placed at the nearest section above if the document lacks that path."""
        table, known = (self.keys if at_key else self.places), path
        while known and known not in table and known not in self.arguments:
            known = known[:-1]
        if known not in self.arguments:
            line, column = table.get(known, (None, None))
            return Fault(self.file, line, column, path, message)
        argument, target = self.arguments[known]
        if path[: len(target)] == target:
            return Fault("", None, None, (argument, *path[len(target) :]), message)
        return Fault(argument, None, None, path, message)

    def set(self, path: Path, value: Any, argument: str) -> None:
        """Put `value` at `path`, and add the sections above it; faults in it name `argument`."""
        section = self.values
        for depth, part in enumerate(path[:-1], start=1):
            if part not in section:
                self.arguments[path[:depth]] = argument, path
            section = section.setdefault(part, {})
            if not isinstance(section, dict):
                message = f"{part} is not a section; allowed: a path through sections to a key"
                raise ConfigError([Fault("", None, None, (argument,), message)])
        section[path[-1]] = value
        for table in (self.keys, self.places, self.arguments):
            for old in [p for p in table if p[: len(path)] == path]:
                del table[old]
        self.arguments[path] = argument, path


def read(path: FilePath) -> Document:
    """Read a YAML file; a `ConfigError` says what is wrong with it and where."""
    document = Document(str(path))
    try:
        text = files.read(path, LIMIT)
    except FileNotFoundError:
        raise ConfigError([Fault(str(path), None, None, (), "no such file")]) from None
    except OSError as error:
        raise ConfigError([Fault(str(path), None, None, (), f"cannot be read: {error.strerror}")]) from None
    except UnicodeDecodeError as error:
        raise ConfigError([Fault(str(path), None, None, (), f"not UTF-8 text: byte {error.start}")]) from None
    node = _compose(text, str(path))
    if not isinstance(node, MappingNode):
        raise ConfigError([Fault(str(path), 1, 1, (), "a configuration is a mapping of keys to values")])
    faults: list[Fault] = []
    document.values = _convert(node, (), document, faults)
    if faults:
        raise ConfigError(faults)
    return document


def parse_value(text: str, source: str) -> Any:
    """The value of a command line's text: START..STOP:NUM as a range, else YAML; a `ConfigError` names `source`."""
    if span := _RANGE.fullmatch(text):
        return {"start": float(span["start"]), "stop": float(span["stop"]), "num": float(span["num"])}
    node = _compose(text, source)
    scratch, faults = Document(source), list[Fault]()
    value = None if node is None else _convert(node, (), scratch, faults)
    if faults:
        raise ConfigError(faults)
    return value


def _compose(text: str, file: str) -> Node | None:
    try:
        return YAML(pure=True).compose(text)  # type: ignore[no-any-return]
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line, column = (mark.line + 1, mark.column + 1) if mark else (None, None)
        problem = (error.problem or error.context or "not YAML").split("\n")[0]
        raise ConfigError([Fault(file, line, column, (), f"not YAML: {problem}")]) from None
    except Exception as error:  # ruamel lets errors of chr(), of its own recursion and others escape
        problem = "nested too deeply" if isinstance(error, RecursionError) else str(error).split("\n")[0]
        raise ConfigError([Fault(file, None, None, (), f"not YAML: {problem}")]) from None


def _convert(node: Node, path: Path, document: Document, faults: list[Fault]) -> Any:
    def place(of: Node) -> tuple[int, int]:
        return of.start_mark.line + 1, of.start_mark.column + 1

    def refuse(of: Node, at: Path, message: str) -> None:
        faults.append(Fault(document.file, *place(of), at, message))

    document.places[path] = place(node)
    # An alias leads back to a node with an anchor; as anchors are refused, no alias is ever followed.
    # A tag stands at the start of its node.  Types that ruamel infers without one, such as timestamps,
    # do not matter: `_scalar` reads the text itself.
    if node.anchor or node.start_mark.buffer[node.start_mark.pointer] == "!":
        refuse(node, path, "a YAML tag or anchor; allowed: plain values")
        return None
    if isinstance(node, ScalarNode):
        return _scalar(node)
    if isinstance(node, SequenceNode):
        return [_convert(item, (*path, i), document, faults) for i, item in enumerate(node.value)]
    result: dict[str, Any] = {}
    for key_node, value_node in node.value:
        if not isinstance(key_node, ScalarNode):
            refuse(key_node, path, "a key must be a word")
            continue
        key = key_node.value
        if key in result:
            line, _ = document.keys[(*path, key)]
            refuse(key_node, (*path, key), f"duplicate key, first on line {line}")
            continue
        document.keys[(*path, key)] = place(key_node)
        result[key] = _convert(value_node, (*path, key), document, faults)
    return result


def _scalar(node: ScalarNode) -> str | float | int | bool | None:
    text: str = node.value
    if node.style is not None:  # quoted
        return text
    if text in _WORDS:
        return _WORDS[text]
    if text.lower() in _SPECIAL:
        return _SPECIAL[text.lower()]
    value = number(text)
    if value is None:
        return text
    return int(text) if text.lstrip("+-").isdigit() and len(text) < 19 else value


def number(text: str) -> float | None:
    """The number that `text` spells in decimal digits; None if it does not spell one."""
    return float(text) if _FLOAT.fullmatch(text) else None
