"""Reads tables of cases, with a column per parameter and a row per trajectory: CSV files, or lists by column."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from sweep import faults
from sweep.config import tables
from sweep.config.document import Document, is_number
from sweep.config.values import MAX_AXIS, in_si, instead
from sweep.faults import Fault, InputError, brief, fault_of, refusal, suggestion
from sweep.parameters import Parameter
from sweep.units import ANGLE, Unit, converted

Columns = dict[str, tuple[float, ...]]
"""Values of each parameter, by name."""

Units = dict[str, str]
"""Units that the table gives for its columns, by name."""

Place = Callable[[faults.Path, str], Fault]
"""Makes a fault from a path in a table (the name of a column, the number of a row) and a message."""


def read(source: Document, known: Mapping[str, Parameter]) -> tuple[Columns, Units]:
    """Read the table of a configuration, which is a file beside it or lists by column, and check it cell by cell.

    Parameters
    ----------
    known : the parameters of which it may have columns, by name

    Returns
    -------
    The columns, converted to SI where the table gives units, and these units.

    Raises
    ------
    InputError
        if the file cannot be read, or with a `Fault` for each cell that is wrong.
    """
    table = source.values["cases"]
    if isinstance(table, dict):
        return _checked(table, lambda path, message: source.fault(("cases", *path), message), known)
    found: tuple[Columns, Units] = source.once("cases", table, lambda: _of_file(source, table, known))
    return found


def _of_file(source: Document, name: str, known: Mapping[str, Parameter]) -> tuple[Columns, Units]:
    if name.endswith(".parquet"):
        message = "Parquet files are not supported; read it with pandas and pass the DataFrame, or save it as CSV"
        raise InputError([source.fault(("cases",), f"{brief(name)}: {message}")])
    path, text = source.read_beside("cases", name)
    table = tables.read(str(path), text)
    first = {each: i for i, each in reversed([*enumerate(table.names)])}
    if again := [i for i, each in enumerate(table.names) if first[each] != i]:
        raise InputError(table.fault("duplicate column; remove one of the two", i) for i in again)
    if not 0 < len(table.rows) <= MAX_AXIS:
        message = f"must have 1 to {MAX_AXIS} rows under its first line, not {len(table.rows)}"
        raise fault_of(message, file=table.file)
    cells: dict[str, list[Any]] = {each: list(table.numbers(i)) for i, each in enumerate(table.names)}
    units: Units = {}
    for i, each in enumerate(table.names):
        if table.units[i] and each in known:
            scale, of = table.scale(i, known[each].units), known[each].units
            units[each] = table.units[i] if isinstance(of, Unit) and of != ANGLE else ""
            cells[each] = [converted(cell, scale) if is_number(cell) else cell for cell in cells[each]]

    def place(at: faults.Path, message: str) -> Fault:
        name, *row = at
        return table.fault(message, table.names.index(str(name)), *map(int, row))

    columns, more = _checked(cells, place, known)
    return columns, more | units


def _checked(table: Mapping[str, Any], place: Place, known: Mapping[str, Parameter]) -> tuple[Columns, Units]:
    read = {name: in_si(known[name].units if name in known else "", column) for name, column in table.items()}
    columns = {name: column for name, (column, _) in read.items()}
    if found := [place(path, message) for path, message in _wrong(columns, known)]:
        raise InputError(found)
    units = {name: unit for name, (_, unit) in read.items()}
    return {name: tuple(map(float, column)) for name, column in columns.items()}, units


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
                    yield (name, i), refusal(each, known[name].allowed) + instead(each, known[name])
