"""Tables of cases: CSV files with a column per parameter and a row per trajectory.

A configuration may name any file, even a private one, so messages quote little of a file that is not
such a table: if no column is a parameter, only the first cell, shortened; otherwise the wrong cells.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping
from itertools import islice
from math import isfinite, nan

from sweep.config import files
from sweep.config.document import Document, number
from sweep.config.faults import ConfigError, Fault, brief, quote
from sweep.config.values import MAX_AXIS
from sweep.parameters import Parameter

LIMIT = 32 * files.MIB
_MAX_FAULTS = 20


def read(source: Document, name: str, known: Mapping[str, Parameter]) -> dict[str, tuple[float, ...]]:
    """Columns of the table `name`, a path relative to the configuration's folder, checked cell by cell.

    `known` are the parameters that it may have, by name.

    Raises
    ------
    ConfigError
        if the file cannot be read, or with a `Fault` for each cell that is wrong, up to some twenty.
    """
    path, text = source.read_beside("cases", name, LIMIT)
    try:
        return _columns(str(path), text, known)
    except csv.Error as error:
        reason = f"not a readable CSV file: {error}"
    raise ConfigError([source.fault(("cases",), f"{brief(name)}: {reason}")])


def _columns(file: str, text: str, known: Mapping[str, Parameter]) -> dict[str, tuple[float, ...]]:
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    header = [cell.strip() for cell in next(reader, [])]
    faults = _header_faults(file, header, known)
    table: list[list[float]] = []
    for row in reader:
        if faults[_MAX_FAULTS:]:
            break
        if not row:
            continue
        line = reader.line_num
        if len(row) != len(header):
            faults.append(Fault(file, line, None, (), f"{len(row)} values; allowed: {len(header)}, as in line 1"))
        elif len(table) == MAX_AXIS:
            faults.append(Fault(file, line, None, (), f"too many rows; allowed: at most {MAX_AXIS}"))
            break
        elif not faults:
            named = zip(header, row, strict=True)
            table.append([_number(file, line, i, known[key], text, faults) for i, (key, text) in enumerate(named, 1)])
    if not faults and not table:
        faults.append(Fault(file, None, None, (), "no cases; allowed: a row or more under the header"))
    if faults:
        raise ConfigError(faults)
    return {key: tuple(row[i] for row in table) for i, key in enumerate(header)}


def _header_faults(file: str, header: list[str], known: Mapping[str, Parameter]) -> list[Fault]:
    allowed = ", ".join(known)
    if not header:
        return [Fault(file, None, None, (), f"empty; line 1 names the columns: {allowed}")]
    if not set(header) & set(known):
        return [Fault(file, 1, 1, (), f"{quote(header[0])}: unknown parameter; allowed: {allowed}")]
    return list(islice(_misnamed(file, header, known), _MAX_FAULTS))


def _misnamed(file: str, header: list[str], known: Mapping[str, Parameter]) -> Iterator[Fault]:
    seen = set()
    for column, name in enumerate(header, start=1):
        if name not in known:
            yield Fault(file, 1, column, (name,), f"unknown parameter; allowed: {', '.join(known)}")
        elif name in seen:
            yield Fault(file, 1, column, (name,), "a column twice; allowed: each once")
        seen.add(name)


def _number(file: str, line: int, column: int, parameter: Parameter, text: str, faults: list[Fault]) -> float:
    text = text.strip()
    value = number(text)
    if value is None or not isfinite(value) or not parameter.allows(value):
        faults.append(Fault(file, line, column, (parameter.name,), f"{quote(text)}; allowed: {parameter.allowed}"))
        return nan
    return value
