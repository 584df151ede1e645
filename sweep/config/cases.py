"""Tables of cases, with a column per parameter and a row per trajectory: CSV files, or lists by column."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from sweep import faults
from sweep.config.document import Document, is_number, number
from sweep.config.values import MAX_AXIS
from sweep.faults import ConfigError, Fault, brief, refusal, suggestion
from sweep.parameters import Parameter

Columns = dict[str, tuple[float, ...]]
"""The numbers of each parameter, by name."""

Place = Callable[[faults.Path, str], Fault]
"""Makes a fault of its path in a table, such as the name of a column and the number of a row, and of its words."""

_Table = tuple[dict[str, list[Any]], Place, list[Fault]]
"""The columns of a file, what makes faults in it, and those of its shape."""


def read(source: Document, name: str, known: Mapping[str, Parameter]) -> Columns:
    """Read the table `name`, a path relative to the configuration's folder, and check it cell by cell.

    Parameters
    ----------
    known : the parameters of which it may have columns, by name

    Returns
    -------
    The columns by name.

    Raises
    ------
    ConfigError
        if the file cannot be read, or with a `Fault` for each cell that is wrong.
    """
    if name.endswith(".parquet"):
        words = "Parquet files have ended; read it with pandas and pass the DataFrame, or save it as CSV"
        raise ConfigError([source.fault(("cases",), f"{brief(name)}: {words}")])
    return _checked(*_of_csv(source, name), known)


def of_columns(source: Document, table: Mapping[str, Any], known: Mapping[str, Parameter]) -> Columns:
    """Check a table that the configuration itself gives, by column; result and errors are as of `read`."""
    return _checked(table, lambda path, words: source.fault(("cases", *path), words), [], known)


def _of_csv(source: Document, name: str) -> _Table:
    """The columns of a CSV file, of numbers where its cells spell such."""
    path, text = source.read_beside("cases", name)
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        lines = [(reader.line_num, [cell.strip() for cell in row]) for row in reader if row]
    except csv.Error as error:
        reason = f"{brief(str(path))}: not a readable CSV file: {error}"
        raise ConfigError([source.fault(("cases",), reason)]) from None
    (top, header), *rows = lines or [(1, [])]
    misshapen = list(_misshapen(str(path), top, header, rows))
    rows = [(line, row) for line, row in rows if len(row) == len(header)]
    if not 0 < len(rows) <= MAX_AXIS:
        raise ConfigError(misshapen)
    cells = [[text if (value := number(text)) is None else value for text in row] for _, row in rows]

    def place(at: faults.Path, words: str) -> Fault:
        name, *row = at
        line = rows[int(row[0])][0] if row else top
        return Fault(str(path), line, header.index(str(name)) + 1, (name,), words)

    return {name: [row[i] for row in cells] for i, name in enumerate(header)}, place, misshapen


def _misshapen(file: str, top: int, header: list[str], rows: list[tuple[int, list[str]]]) -> Iterator[Fault]:
    if not header:
        yield Fault(file, None, None, (), "empty; its first line has to name the columns, such as mu,n0")
    elif not 0 < len(rows) <= MAX_AXIS:
        yield Fault(file, None, None, (), f"must have 1 to {MAX_AXIS} rows under its first line, not {len(rows)}")
    first: dict[str, int] = {}
    for column, name in enumerate(header, start=1):
        if first.setdefault(name, column) != column:
            yield Fault(file, top, column, (name,), "a second column of this name; remove one of the two")
    for line, row in rows:
        if len(row) != len(header):
            yield Fault(file, line, None, (), f"{len(row)} values, but {len(header)} columns in line {top}")


def _checked(table: Mapping[str, Any], place: Place, misshapen: list[Fault], known: Mapping[str, Parameter]) -> Columns:
    if found := [*misshapen, *(place(path, words) for path, words in _wrong(table, known))]:
        raise ConfigError(found)
    return {name: tuple(map(float, column)) for name, column in table.items()}


def _wrong(table: Mapping[str, Any], known: Mapping[str, Parameter]) -> Iterator[tuple[faults.Path, str]]:
    lengths = {len(column) for column in table.values() if isinstance(column, list)}
    if len(lengths) != 1 or not 0 < max(lengths) <= MAX_AXIS:
        yield (), f"its columns must be lists of the same length, 1 to {MAX_AXIS} numbers"
        return
    for name, column in table.items():
        if name not in known:
            yield (name,), f"unknown parameter{suggestion(name, known)}; the parameters are {', '.join(known)}"
        elif not isinstance(column, list):
            yield (name,), refusal(column, "a list of numbers")
        else:
            for i, each in enumerate(column):
                if not is_number(each) or not known[name].allows(each):
                    yield (name, i), refusal(each, known[name].allowed)
