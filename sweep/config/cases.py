"""Tables of cases: a CSV file with a column a parameter and a row a trajectory."""

from __future__ import annotations

import csv
from pathlib import Path

from sweep.config.document import Document
from sweep.config.faults import ConfigError, Fault
from sweep.parameters import PARAMETERS

_MAX_FAULTS = 20


def read(source: Document, name: str) -> dict[str, tuple[float, ...]]:
    """Columns of the table `name` (relative to the configuration's folder), checked cell by cell."""
    path = Path(source.file).parent / name
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            rows = list(csv.reader(stream, strict=True))
    except FileNotFoundError:
        raise ConfigError([source.fault(("cases",), f"{name}: no such file in {path.parent}")]) from None
    except (OSError, UnicodeDecodeError, csv.Error, ValueError) as error:
        raise ConfigError([source.fault(("cases",), f"{name}: not a readable CSV file: {error}")]) from None
    header = [cell.strip() for cell in rows[0]] if rows else []
    faults = _header_faults(str(path), header)
    table: list[list[float]] = []
    for line, row in enumerate(rows[1:], start=2):
        if not row or faults[_MAX_FAULTS:]:
            continue
        if len(row) != len(header):
            faults.append(Fault(str(path), line, None, (), f"{len(row)} values; allowed: {len(header)}, as in line 1"))
            continue
        if not faults:
            table.append([_number(str(path), line, column, header, row, faults) for column in range(len(row))])
    if not faults and not table:
        faults.append(Fault(str(path), None, None, (), "no cases; allowed: a row or more under the header"))
    if faults:
        raise ConfigError(faults)
    return {key: tuple(row[i] for row in table) for i, key in enumerate(header)}


def _header_faults(file: str, header: list[str]) -> list[Fault]:
    faults = []
    if not header:
        return [Fault(file, None, None, (), f"empty; line 1 names the columns: {', '.join(PARAMETERS)}")]
    for column, name in enumerate(header, start=1):
        if name not in PARAMETERS:
            faults.append(Fault(file, 1, column, (name,), f"unknown parameter; allowed: {', '.join(PARAMETERS)}"))
        elif name in header[: column - 1]:
            faults.append(Fault(file, 1, column, (name,), "a column twice; allowed: each once"))
    return faults


def _number(file: str, line: int, column: int, header: list[str], row: list[str], faults: list[Fault]) -> float:
    parameter = PARAMETERS[header[column]]
    try:
        value = float(row[column])
    except ValueError:
        value = float("nan")
    if not parameter.allows(value) or value in (float("inf"), float("-inf")):
        message = f"{row[column].strip()!r}; allowed: {parameter.allowed}"
        faults.append(Fault(file, line, column + 1, (parameter.name,), message))
    return value
