"""Tables of cases, with a column per parameter and a row per trajectory: CSV or Parquet files, or lists by column."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from sweep.config.document import Document, number
from sweep.config.faults import ConfigError, Fault, brief, refusal, suggestion
from sweep.config.values import MAX_AXIS
from sweep.parameters import Parameter

Columns = dict[str, tuple[float, ...]]
"""The numbers of each parameter, by name."""


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
        return _of_parquet(source, name, known)
    path, text = source.read_beside("cases", name)
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        lines = [(reader.line_num, [cell.strip() for cell in row]) for row in reader if row]
    except csv.Error as error:
        reason = f"{brief(str(path))}: not a readable CSV file: {error}"
        raise ConfigError([source.fault(("cases",), reason)]) from None
    (_, header), *rows = lines or [(1, [])]
    # The faults of cells mean little where their columns are not known.
    for faults in (_faults_of_header(str(path), header, known), _faults_of_cells(str(path), header, rows, known)):
        if found := list(faults):
            raise ConfigError(found)
    return {name: tuple(float(row[i]) for _, row in rows) for i, name in enumerate(header)}


def of_columns(source: Document, table: Mapping[str, Any], known: Mapping[str, Parameter]) -> Columns:
    """Check a table that the configuration itself gives, by column; result and errors are as of `read`."""
    if faults := list(_faults_of_columns(table, known)):
        raise ConfigError(source.fault(("cases", *path), words) for path, words in faults)
    return {name: tuple(map(float, column)) for name, column in table.items()}


def _of_parquet(source: Document, name: str, known: Mapping[str, Parameter]) -> Columns:
    import pandas

    path = Path(source.file).parent / name
    try:
        with path.open("rb") as stream:
            table: dict[str, Any] = pandas.read_parquet(stream).to_dict("list")
    except ImportError:
        words = "cannot be read without pyarrow; install it (pip install 'rattleback-sweep[parquet]')"
        raise ConfigError([source.fault(("cases",), f"{brief(str(path))}: {words}")]) from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else "not a readable Parquet file"
        raise ConfigError([source.fault(("cases",), f"{brief(str(path))}: {reason}")]) from None
    if faults := list(_faults_of_columns(table, known)):
        raise ConfigError(Fault(str(path), None, None, place, words) for place, words in faults)
    return {column: tuple(map(float, numbers)) for column, numbers in table.items()}


def _faults_of_columns(
    table: Mapping[str, Any], known: Mapping[str, Parameter]
) -> Iterator[tuple[tuple[str | int, ...], str]]:
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
                if isinstance(each, bool) or not isinstance(each, int | float) or not known[name].allows(each):
                    yield (name, i), refusal(each, known[name].allowed)


def _faults_of_header(file: str, header: list[str], known: Mapping[str, Parameter]) -> Iterator[Fault]:
    names = ", ".join(known)
    if not header:
        yield Fault(file, None, None, (), f"empty; its first line has to name the columns, out of {names}")
    for column, name in enumerate(header, start=1):
        if name not in known:
            words = f"unknown parameter{suggestion(name, known)}; the parameters are {names}"
            yield Fault(file, 1, column, (name,), words)
        elif header.index(name) < column - 1:
            yield Fault(file, 1, column, (name,), "a second column of this name; remove one of the two")


def _faults_of_cells(
    file: str, header: list[str], rows: list[tuple[int, list[str]]], known: Mapping[str, Parameter]
) -> Iterator[Fault]:
    if not 0 < len(rows) <= MAX_AXIS:
        yield Fault(file, None, None, (), f"must have 1 to {MAX_AXIS} rows under its first line, not {len(rows)}")
    for line, row in rows:
        if len(row) != len(header):
            yield Fault(file, line, None, (), f"{len(row)} values, but {len(header)} columns in line 1")
            continue
        for column, (name, text) in enumerate(zip(header, row, strict=True), start=1):
            value = number(text)
            if value is None or not known[name].allows(value):
                yield Fault(file, line, column, (name,), refusal(text, known[name].allowed))
