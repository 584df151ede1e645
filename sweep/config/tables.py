"""Reads tables of numbers as spreadsheets, phones and trackers write them: tables of cases, and films."""

from __future__ import annotations

import csv
import io
import re
from dataclasses import dataclass, replace

from sweep.faults import Fault, InputError, brief, counted, either, fault_of
from sweep.units import WRITTEN, Unit, factor, number, unit_of

SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs"}
"""Permitted separators between columns."""

GAPS = frozenset({"", "-", "nan", "na", "n/a", "null", "none"})
"""Contents of cells without a number, in lower case."""

_ENOUGH = 100_000
"""Number of characters of a line in which separators are looked for."""

_COMMA = re.compile(r"[-+−]?[0-9]*(?:,[0-9]+)+(?:[eE][-+−]?[0-9]+)?")
_THOUSANDS = re.compile(r"[-+−]?[1-9][0-9]{0,2}(?:,[0-9]{3})+")


@dataclass(frozen=True)
class Table:
    """The text of the cells of a table; all rows have as many cells as the header."""

    file: str
    separator: str
    top: int
    """Line number of the header."""
    names: list[str]
    """Names of the columns, without the unit in brackets after or within them."""
    units: list[str]
    """Units of the columns, from the header or the row below it; "" where there is none."""
    under: int
    """Line number of the row of units, or of the header if there is none."""
    lines: list[int]
    """Line number of each row."""
    rows: list[list[str]]

    def fault(self, message: str, column: int, row: int | None = None) -> Fault:
        """Return a fault of a column or of one of its cells; both are counted from zero."""
        line = self.top if row is None else self.lines[row]
        return Fault(self.file, line, column + 1, (self.names[column],), message)

    def scale(self, column: int, units: Unit | str) -> float:
        """Return the factor that converts a column to SI; one if the table gives no unit.

        Raises
        ------
        InputError
            if the table gives a unit of another quantity.
        """
        if not (written := self.units[column]):
            return 1.0
        unit = unit_of(units)
        found = factor(written, unit) if unit else 1.0 if written == units else None
        if found is None:
            known = either(WRITTEN.get(unit, ()) if unit else [str(units)] if units else ())
            words = f"its unit must be {known}" if known else "it is a pure number; leave the unit out"
            fault = self.fault(f"is in '{brief(written, 20)}'; {words}", column)
            raise InputError([replace(fault, line=self.under)])
        return found

    def numbers(self, column: int) -> list[float | str]:
        """Return the numbers of a column, and the texts of cells that do not hold a number.

        Raises
        ------
        InputError
            if commas may be decimal commas or thousands separators: a column is read as a whole or not at all.
        """
        cells = [row[column] for row in self.rows]
        if commas := [cell for cell in cells if _COMMA.fullmatch(cell)]:
            if pointed := [cell for cell in cells if "." in cell and number(cell.replace(",", "")) is not None]:
                words = f"has {commas[0]!r} and {pointed[0]!r}; use decimal points only, and no thousands separators"
                raise InputError([self.fault(words, column)])
            if self.separator != ";" and all(map(_THOUSANDS.fullmatch, commas)):
                small, large = commas[0].replace(",", ".", 1), commas[0].replace(",", "")
                words = f"{commas[0]!r} may be {small} or {large}; write one of these, or semicolons between columns"
                raise InputError([self.fault(words, column, cells.index(commas[0]))])
            cells = [cell.replace(",", ".") if _COMMA.fullmatch(cell) else cell for cell in cells]
        return [cell if (value := number(cell)) is None else value for cell in cells]


_BRACKETS = re.compile(r"\s*[(\[]([^)\]]*)[)\]]\s*")

Lines = list[tuple[int, list[str]]]
"""Return the cells of lines, each with its line number."""


def read(file: str, text: str) -> Table:
    """Parse a table: a line of names, optionally a line of units, and rows with a cell for each name.

    Raises
    ------
    InputError
        if a line has a different number of cells from the first, or a column has two units.
    """
    separator, ((top, header), *rows) = _lines(file, text)
    _require_even(file, (top, header), rows, separator)
    names, units = map(list, zip(*map(named, header), strict=True))
    under = top
    if len(rows) > 1 and _is_of_units(rows[0][1]):
        under, below = rows.pop(0)
        units = _united(file, names, (top, units), (under, [cell.strip("()[] ") for cell in below]))
    return Table(file, separator, top, names, units, under, [line for line, _ in rows], [row for _, row in rows])


def named(text: str) -> tuple[str, str]:
    """Split a name from its unit, which is in brackets at the end, or within the name as in "Spin (deg/s) Run #1"."""
    for each in reversed([*_BRACKETS.finditer(text)]):
        if each.end() == len(text) or any(factor(each[1], unit) for unit in WRITTEN):
            return f"{text[: each.start()]} {text[each.end() :]}".strip(), each[1].strip()
    return text.strip(), ""


def _lines(file: str, text: str) -> tuple[str, Lines]:
    """Split the non-empty lines into cells, and find their separator; raise an `InputError` if there are none."""
    text = _without_title(re.sub("\r\n?", "\n", text))
    try:
        separator = _separator(text)
        reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator, skipinitialspace=True, strict=True)
        lines = [(reader.line_num, [cell.strip() for cell in row]) for row in reader]
    except csv.Error as error:
        raise fault_of(f"not a readable CSV file: {error}", file=file) from None
    if not (found := [(line, row) for line, row in lines if len(row) > 1 or any(row)]):
        raise fault_of("empty; its first line has to name the columns, such as mu,n0", file=file)
    return separator, found


def _without_title(text: str) -> str:
    """`text` with an empty first line if that is one cell above the names of several columns, as Tracker's `mass_A`."""
    first, _, rest = text.partition("\n")
    below = rest.partition("\n")[0]
    marks = [mark for mark in SEPARATORS if mark in below and mark not in first]
    titled = any(all(number(cell) is None for cell in below.split(mark)) for mark in marks)
    return "\n" + rest if titled and first.strip() and not {*SEPARATORS} & {*first} else text


def _require_even(file: str, header: tuple[int, list[str]], rows: Lines, separator: str) -> None:
    """Raise an `InputError` if a row has a different number of cells from the header."""
    top, columns = header[0], len(header[1])
    if not (ragged := [(line, len(row)) for line, row in rows if len(row) != columns]):
        return
    line, values = ragged[0]
    words = f"{counted(values, 'value')}, but {counted(columns, 'column')} in line {top}"
    words += f", with {SEPARATORS[separator]} between them"
    words += f"; {len(ragged)} of {len(rows)} rows are like this" if len(ragged) > 1 else ""
    if separator == "," and values > columns:
        words += "; use semicolons between columns if numbers have decimal commas"
    raise fault_of(words, file=file, line=line)


def _united(file: str, names: list[str], over: tuple[int, list[str]], under: tuple[int, list[str]]) -> list[str]:
    """Return the units in the header (`over`) and in the row below it; raise an `InputError` where they differ."""
    (top, units), (line, below) = over, under
    for column, (unit, own) in enumerate(zip(units, below, strict=True)):
        if unit and own and unit != own:
            words = f"is in '{brief(unit, 20)}' in line {top}, and in '{brief(own, 20)}' here; give one unit"
            raise InputError([Fault(file, line, column + 1, (names[column],), words)])
    return [unit or own for unit, own in zip(units, below, strict=True)]


def _separator(text: str) -> str:
    """Return the column separator: it splits the first line and the next one into the same number of cells."""
    first = [line[:_ENOUGH] for line in text.lstrip().split("\n", 2)[:2] if line.strip()]

    def divided(mark: str) -> tuple[bool, int]:
        header, *below = (len(next(csv.reader([line], delimiter=mark), [])) for line in first)
        return header > 1 and below == [header], header

    return max(SEPARATORS, key=divided) if first else ","


def _is_of_units(row: list[str]) -> bool:
    """Return whether a row holds units: text, and no number."""
    cells = [cell for cell in row if cell.lower() not in GAPS]
    return bool(cells) and not any(re.fullmatch(r"[-+−.,eE0-9]*[0-9][-+−.,eE0-9]*", cell) for cell in cells)
