"""Reads YAML documents as plain values, with the line and column of every part.

Documents are YAML 1.2, in which 1e-3 is a number and `no` a word. Only plain data is accepted: tags, anchors and
duplicate keys are refused, so that a file cannot run code, expand without end, or silently override an earlier line.
"""

from __future__ import annotations

import os
import re
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import timedelta
from io import StringIO
from itertools import accumulate, pairwise
from math import inf, nan
from pathlib import Path as FilePath
from typing import Any, TypeGuard

import numpy as np
from ruamel.yaml import YAML
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from sweep.faults import Fault, InputError, Path, brief, fault_of
from sweep.units import NUMERAL
from sweep.units import number as number

_RANGE = re.compile(rf"({NUMERAL}[^.:]*)\.\.({NUMERAL}[^.:]*):({NUMERAL})")
_WORDS = {"true": True, "false": False, "null": None, "~": None, "": None, ".inf": inf, "-.inf": -inf, ".nan": nan}

_IN_WORDS = {"but found another document": "a file holds one configuration; remove what follows the line ---"}
"""Messages of ruamel that need other words."""

_DEEPEST = 100
"""Deepest nesting of brackets that is accepted."""

Place = tuple[int, int]
"""Line and column, counted from one."""


@dataclass
class Document:
    """The values of a configuration, and where each comes from: a line and column of a file, or an argument."""

    file: str
    """Name of the file; "" for a mapping."""
    values: Any = None
    places: dict[Path, tuple[Place, Place]] = field(default_factory=dict)
    """Where the key of each value stands, and where the value stands; an item of a list is its own key."""
    arguments: dict[Path, tuple[str, Path]] = field(default_factory=dict)
    """For each value or section set by an argument: the argument, and the path that it set."""
    known: dict[tuple[str, str], Any] = field(default_factory=dict)
    """Contents of the files named in the document (a table of cases, a model), by key and name, once read."""

    def once(self, key: str, name: str, read: Callable[[], Any]) -> Any:
        """Return the contents of the file `name`, read once for everything made from this document."""
        if (key, name) not in self.known:
            self.known[key, name] = read()
        return self.known[key, name]

    def read_beside(self, key: str, name: str) -> tuple[FilePath, str]:
        """Return path and text of the file `name`, relative to this document's folder, named under `key`.

        Raises
        ------
        InputError
            if the file cannot be read.
        """
        path = FilePath(self.file).parent / name
        return path, text_of(path, lambda reason: InputError([self.fault((key,), f"{brief(str(path))}: {reason}")]))

    def fault(self, path: Path, message: str, *, at_key: bool = False) -> Fault:
        """Return a fault at `path`, placed at the nearest enclosing section if the document lacks that path."""
        known = path
        while known and known not in self.places and known not in self.arguments:
            known = known[:-1]
        if known not in self.arguments:
            line, column = self.places[known][0 if at_key else 1] if known in self.places else (None, None)
            return Fault(self.file, line, column, path, message)
        argument, target = self.arguments[known]
        if path[: len(target)] == target:
            return Fault("", None, None, (argument, *path[len(target) :]), message)
        return Fault(argument, None, None, path, message)

    def set(self, path: Path, value: Any, argument: str) -> None:
        """Put `value` at `path`, and add the sections above it; errors in it name `argument`."""
        section = self.values
        for depth, part in enumerate(path[:-1], start=1):
            if part not in section:
                self.arguments[path[:depth]] = argument, path
            section = section.setdefault(part, {})
            if not isinstance(section, dict):
                raise fault_of(f"{part} is a value, not a section; name a key such as friction.mu", argument)
        section[path[-1]] = value
        for table in (self.places, self.arguments):
            for old in [p for p in table if p[: len(path)] == path]:
                del table[old]
        self.arguments[path] = argument, path


def plain_data(value: Any) -> Any:
    """Return a Python value as a YAML file could hold it: mappings, lists, text and numbers.

    Tuples, ranges and arrays become lists; an array is whatever NumPy can read as one, such as an `xarray.DataArray` or
    a `pandas.Series`.  A `pandas.DataFrame` becomes a mapping of its columns.  Numbers with a unit (quantities of Pint
    or Astropy, an array whose attributes have `units`, times) become texts such as "3.0 cm", and masked numbers None.
    Values of any other type are returned unchanged; the schema refuses them.
    """
    if isinstance(value, Mapping):
        return {str(key): plain_data(item) for key, item in value.items()}
    if isinstance(value, list | tuple | range):
        return [plain_data(item) for item in value]
    if hasattr(value, "columns") and hasattr(value, "to_dict"):  # a pandas DataFrame
        return plain_data(value.to_dict("list"))
    kind = "m" if isinstance(value, timedelta) else getattr(getattr(value, "dtype", None), "kind", "")
    if kind == "m":
        return _with_unit((np.asarray(value, "m8") / np.timedelta64(1, "s")).tolist(), "s")
    if kind == "M":  # whose numbers are nanoseconds since 1970
        return np.asarray(value).astype(str).tolist()
    if hasattr(value, "magnitude") and hasattr(value, "units"):  # of Pint
        return _with_unit(plain_data(value.magnitude), f"{value.units:~C}")
    if hasattr(value, "value") and hasattr(value, "unit"):  # of Astropy
        return _with_unit(plain_data(value.value), str(value.unit))
    if isinstance(attributes := getattr(value, "attrs", None), Mapping):
        inside = value.data if hasattr(value, "data") else np.asarray(value)  # xarray may hold quantities
        return _with_unit(plain_data(inside), attributes.get("units", ""))
    if hasattr(value, "__array__"):
        return np.ma.asarray(value).tolist()
    return os.fspath(value) if isinstance(value, os.PathLike) else value


def _with_unit(plain: Any, unit: object) -> Any:
    """Add a unit to the numbers of a value; "", "1" and "dimensionless" add nothing."""
    if isinstance(plain, list):
        return [_with_unit(item, unit) for item in plain]
    return f"{plain!r} {unit}" if is_number(plain) and unit not in ("", "1", "dimensionless") else plain


def read(path: FilePath) -> Document:
    """Read a YAML file; raise an `InputError` that says what is wrong with it and where."""
    text = text_of(path)
    node = _compose(text, str(path))
    if not isinstance(node, MappingNode):
        raise InputError([Fault(str(path), 1, 1, (), "a configuration is a mapping of keys to values")])
    document = Document(str(path))
    document.values = _values(node, document)
    return document


def dump(values: Mapping[str, Any]) -> str:
    """Return plain values as the text of a YAML file, in their order."""
    stream = StringIO()
    yaml = YAML(typ="safe", pure=True)
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    yaml.dump(values, stream)
    return stream.getvalue()


def parse_value(text: str, source: str) -> Any:
    """Return the value of a command-line text: START..STOP:NUM as a range, otherwise YAML; errors name `source`."""
    if span := _RANGE.fullmatch(text):
        start, stop, num = (text.strip() if (value := number(text)) is None else value for text in span.groups())
        return {"start": start, "stop": stop, "num": num}
    node = _compose(text, source)
    return None if node is None else _values(node, Document(source))


def is_number(value: Any) -> TypeGuard[float]:
    """Return whether a value is a number; booleans are not."""
    return isinstance(value, int | float) and not isinstance(value, bool)


_OTHER_FILES = {
    b"\x89HDF": "a dataset, not text; its attribute `config` holds the configuration, and `sweep info` describes it",
    b"CDF": "a dataset, not text; its attribute `config` holds the configuration, and `sweep info` describes it",
    b"PK": "a spreadsheet or another archive, not text; save it as CSV (UTF-8)",
}
"""What a file is whose first bytes are these, and what to do about it."""


def text_of(path: FilePath, error_of: Callable[[str], InputError] | None = None) -> str:
    """Return the text of a file in UTF-8, or in UTF-16 if it has that byte order mark.

    Raises
    ------
    InputError
        if the file cannot be read; made by `error_of` from the reason, by default a fault of the file.
    """
    try:
        data = path.read_bytes()
        wide = data.startswith((BOM_UTF16_LE, BOM_UTF16_BE))
        reason = next((words for mark, words in _OTHER_FILES.items() if data.startswith(mark) and b"\0" in data), "")
        if not reason:
            return data.decode("utf-16" if wide else "utf-8-sig")
    except FileNotFoundError:
        reason = "no such file"
    except UnicodeDecodeError as error:
        reason = f"not UTF-8 text: byte {error.start}; save it as UTF-8"
    except (OSError, ValueError) as error:  # a file name may contain a NUL
        reason = f"cannot be read: {getattr(error, 'strerror', None) or error}"
    raise error_of(reason) if error_of else fault_of(reason, file=str(path))


def _compose(text: str, file: str) -> Node | None:
    # The time ruamel takes grows with the square of the depth: a minute for a few thousand brackets.
    depths = accumulate((character in "[{") - (character in "]}") for character in text)
    if max(depths, default=0) > _DEEPEST:
        raise InputError([Fault(file, None, None, (), "not YAML: nested too deeply")])
    try:
        return YAML(pure=True).compose(text)  # type: ignore[no-any-return]
    except Exception as error:  # ruamel lets errors of chr(), its own recursion errors and others escape
        mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
        words = getattr(error, "problem", None) or getattr(error, "context", None) or str(error)
        problem = "nested too deeply" if isinstance(error, RecursionError) else words.split("\n")[0]
        problem = _IN_WORDS.get(problem, problem)
        line, column = (mark.line + 1, mark.column + 1) if mark else (None, None)
        raise InputError([Fault(file, line, column, (), f"not YAML: {problem}")]) from None


def _values(root: Node, document: Document) -> Any:
    """Return the values of a tree of nodes, and note their places in `document`."""
    faults: list[Fault] = []

    def convert(node: Node, path: Path, key: Place | None = None) -> Any:
        document.places[path] = key or _place(node), _place(node)
        # An alias refers to a node with an anchor; as anchors are refused, no alias is ever followed. A tag stands at
        # the start of its node. Types that ruamel infers without a tag, such as timestamps, do not matter: `_scalar`
        # reads the text itself.
        if node.anchor or node.start_mark.buffer[node.start_mark.pointer] == "!":
            faults.append(document.fault(path, "a YAML tag or anchor; write the plain value"))
            return None
        if isinstance(node, ScalarNode):
            return _scalar(node)
        if isinstance(node, SequenceNode):
            for before, item in pairwise(node.value):
                if (whole := _cut(before, item)) and number(whole) is None:
                    words = f"a comma ends an item of a list; write {whole}, or put a space after the comma"
                    faults.append(document.fault(path, words))
            return [convert(item, (*path, i)) for i, item in enumerate(node.value)]
        result: dict[str, Any] = {}
        last, at = node, path
        for name, value in node.value:
            inner = (*path, name.value) if isinstance(name, ScalarNode) else path
            if inner == path:
                faults.append(Fault(document.file, *_place(name), path, "a key must be a word"))
            elif (whole := _cut(last, name)) and value.value == "":
                words = f"a comma ends a value in braces; write {whole} for one number, [{last.value}, …] for a list"
                faults.append(Fault(document.file, *_place(last), at, words))
            elif name.value in result:
                (line, _), _ = document.places[inner]
                faults.append(Fault(document.file, *_place(name), inner, f"duplicate key, first on line {line}"))
            else:
                result[name.value] = convert(value, inner, _place(name))
            last, at = value, inner
        return result

    values = convert(root, ())
    if faults:
        raise InputError(faults)
    return values


def _cut(before: Node, after: Node) -> str:
    """Return the number, possibly with a unit, that a decimal comma has split into two nodes; "" otherwise."""
    texts = [node.value if isinstance(node, ScalarNode) and node.style is None else "" for node in (before, after)]
    close = after.start_mark.index == before.end_mark.index + 1
    return ".".join(texts) if close and re.fullmatch(r"[-+−]?[0-9]+,[0-9]+[^0-9]*", ",".join(texts)) else ""


def _place(node: Node) -> Place:
    return node.start_mark.line + 1, node.start_mark.column + 1


def _scalar(node: ScalarNode) -> str | float | bool | None:
    text: str = node.value
    if node.style is not None:  # the value was quoted
        return text
    value = number(text)
    return value if value is not None else _WORDS.get(text.lower(), text)
