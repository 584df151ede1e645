"""Reads a film of a spinning body from a table: its spin, its heading, or the reading of a gyroscope on it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import get_args

import numpy as np

from sweep.config import tables
from sweep.config.document import text_of
from sweep.config.tables import GAPS, SEPARATORS, Table, named
from sweep.faults import InputError, brief, counted, either, fault_of, local_path, suggestion
from sweep.grid import Array
from sweep.kernels.samples import Seen
from sweep.units import ANGLE, SPIN, TIME, Unit, converted, factor

MOST_ROWS = 20_000
"""Most rows of a film; a longer film is thinned evenly, since more rows add time and hardly any information."""

# Patterns of the column names of trackers and phones, without the unit in parentheses: Sensor Logger `seconds_elapsed`
# and `z` (its `time` counts nanoseconds since 1970), SensorLog `motionRotationRateZ`, Physics Toolbox `wz`, and
# Tracker `ω`, `θ` and `θr`. The first match counts.
_NAMES: dict[str, tuple[str, ...]] = {
    "time": ("seconds elapsed", "time", "t"),
    "spin": ("spin", "n", "angular velocity", "omega", "ω"),
    "gyroscope": ("(gyroscope|gyro rotation|(motion )?rotation rate|omega) z", "(gyro|gyr|ω) ?z", "[gw]z"),
    "heading": ("heading", "angle", "theta", "θ", "θr"),
    "error": ("error", "sigma", "uncertainty"),
    **{f"{axis}{point}": (f"{axis} ?{point}",) for point in (1, 2) for axis in "xy"},
}
_POINTS = {"x1", "y1", "x2", "y2"}
"""The columns of two points that a tracker follows: the direction from the first to the second is a heading."""

# phyphox translates its column names, such as "Gyroskop Z" and "Żyroskop - składowa z"; units and the letter stay.
_UPRIGHT = re.compile(r"(.*\W)?z")


@dataclass(frozen=True, eq=False)
class Film:
    """The observed values, from the first instant on; arrays of shape (instants,)."""

    time: Array
    """Time since the first instant, in the time unit of the configuration: s in SI."""
    value: Array
    error: Array | None = None
    """Standard error of each value, if the film gives one."""
    what: Seen = "spin"
    """What the values are: the spin; the angular velocity about the body axis that points upwards at rest; or the angle
    in radian, unwrapped, by which the body's x axis has turned, seen from above."""
    left_out: int = 0
    """Number of rows left out, because they hold no number or because there are too many."""
    why: str = ""
    """A description of these rows."""
    clock: str | None = None
    """The unit of time that the table gives, or "" if it gives none; None for a film that is not from a table."""

    @property
    def omitted(self) -> str:
        """Describe the rows that are left out; return "" if there are none."""
        verb = "is" if self.left_out == 1 else "are"
        return f"{counted(self.left_out, 'row')} of the film {verb} left out: {self.why}" if self.left_out else ""

    @property
    def errors(self) -> Array:
        """Return the standard errors, or ones if the film does not give them."""
        return np.ones_like(self.time) if self.error is None else self.error


def read(path: str | Path, time_column: str = "", spin_column: str = "", run: str = "") -> Film:
    """Read a film from a table with a header and columns separated by commas, semicolons or tabs.

    Parameters
    ----------
    time_column, spin_column : names of the time and data columns, with the unit in parentheses if the table gives none
        or a wrong one, such as "omega (deg/s)"; by default columns with known names are used
    run : the run of a table of several: what the names of its columns end in, or the word in its column "run"

    Raises
    ------
    InputError
        if the file does not exist, or has no time or data column, an unknown unit, decreasing times, too few rows, or
        text instead of numbers.
    """
    table = _run(tables.read(str(path), text_of(local_path(path, "film", "a Film or the path of a table"))), run)
    found, asked = _columns(table), _asked(table, time_column, spin_column)
    if spin_column:
        found = {name: place for name, place in found.items() if name not in get_args(Seen)}
    found |= asked
    what: Seen | None = next((each for each in get_args(Seen) if each in found), None)
    if not what and found.keys() >= _POINTS:
        what = "heading"
    if "time" not in found or not what:
        known = ("spin (rad/s)", "gyroscope z (rad/s)", "heading (deg)", "x1, y1, x2, y2")
        names = either(f"'{name}'" for name in known)
        words = f"needs a column 'time (s)' and one {names}; it has {brief(', '.join(table.names))}"
        words += "" if len(table.names) > 1 else f", with no {either(SEPARATORS.values())} in the line"
        raise fault_of(words, file=str(path), line=table.top)
    if "error" in found and not table.units[found["error"]]:
        table.units[found["error"]] = table.units[found[what]] if what in found else ""
    gaps: dict[int, str] = {}
    units = {"time": TIME, "error": ANGLE if what == "heading" else SPIN}
    time, value, error = (
        _column(table, found[name], units.get(name, units["error"]), gaps) if name in found else None
        for name in ("time", what, "error")
    )
    if what not in found:
        x1, y1, x2, y2 = (_column(table, found[name], None, gaps) for name in sorted(_POINTS, key=lambda n: n[::-1]))
        value = np.arctan2(y2 - y1, x2 - x1)
    assert time is not None
    assert value is not None
    whole = np.flatnonzero(np.isfinite(time) & np.isfinite(value))
    if len(back := np.flatnonzero(np.diff(time[whole]) < 0)):
        words = "the time decreases; sort the rows by time"
        raise InputError([table.fault(words, found["time"], int(whole[back[0] + 1]))])
    if error is not None and len(wrong := whole[~(error[whole] > 0)]):
        raise InputError([table.fault("the error must be a number > 0", found["error"], int(wrong[0]))])
    if what == "heading":
        value[whole] = np.unwrap(value[whole])
    every = -(-len(whole) // MOST_ROWS) or 1
    kept = whole[::every]
    if len(kept) < 8 or time[kept[-1]] == time[kept[0]]:
        need = "a fit needs at least 8 rows, at different times"
        raise fault_of(f"has {len(kept)} rows with a time and a {what}; {need}", file=str(path))
    return Film(
        time[kept] - time[kept[0]], value[kept], None if error is None else error[kept], what,
        left_out=len(time) - len(kept), why=_why(len(time) - len(whole), gaps, len(whole), every),
        clock=table.units[found["time"]],
    )  # fmt: skip


def _run(table: Table, run: str) -> Table:
    """Return the part of a table that holds a run; raise an `InputError` if the run is not there or has to be named."""
    column = next((i for i, name in enumerate(table.names) if name.casefold() == "run"), None)
    runs = [] if column is None else [*dict.fromkeys(row[column] for row in table.rows)]
    if run in runs:
        kept = [i for i, row in enumerate(table.rows) if row[column or 0] == run]
        return replace(table, lines=[table.lines[i] for i in kept], rows=[table.rows[i] for i in kept])
    clocks = _NAMES["time"]  # one clock may serve all runs
    places = [i for i, name in enumerate(table.names) if name.endswith(run) or name.casefold() in clocks]
    if (run and not any(table.names[i].endswith(run) for i in places)) or (not run and len(runs) > 1):
        words = f"there is no run {brief(run)}{suggestion(run, runs)}" if run else "has several runs; name one"
        raise fault_of(f"{words}; it has {brief(', '.join(runs or table.names))}", "--run", file=table.file)
    if not run:
        return table
    names = [table.names[i].removesuffix(run).strip() for i in places]
    rows = [[row[i] for i in places] for row in table.rows]
    return replace(table, names=names, units=[table.units[i] for i in places], rows=rows)


def _columns(table: Table) -> dict[str, int]:
    """Return the index of each known column, found by its name or else by its unit."""
    plain = [_plain(name) for name in table.names]
    found = {}
    for what, known in _NAMES.items():
        if places := [i for pattern in known for i, name in enumerate(plain) if re.fullmatch(pattern, name)]:
            found[what] = places[0]
    clocks = [place for place, unit in enumerate(table.units) if factor(unit, TIME)]
    upright = [place for place, name in enumerate(plain) if _UPRIGHT.fullmatch(name) and _turns(table, place)]
    if "time" not in found and clocks:
        found["time"] = clocks[0]
    if not {*get_args(Seen)} & found.keys() and len(upright) == 1:
        found["gyroscope"] = upright[0]
    return found


def _turns(table: Table, place: int) -> bool:
    """Return whether a column holds angular velocities: by its unit, or because it is Sensor Logger's table of the
    gyroscope."""
    of_logger = "gyro" in Path(table.file).name.lower() and "seconds_elapsed" in table.names
    return bool(factor(table.units[place], SPIN)) or (of_logger and not table.units[place])


def _asked(table: Table, time_column: str, spin_column: str) -> dict[str, int]:
    """Return the indices of the columns asked for by name; units in the names are applied to the columns."""
    found = {}
    for option, text in (("--time-column", time_column), ("--spin-column", spin_column)):
        if not text:
            continue
        name, unit = named(text)
        if name not in table.names:
            words = f"there is no column {brief(text)}{suggestion(name, table.names)}; "
            raise fault_of(f"{words}it has {brief(', '.join(table.names))}", option, file=table.file, line=table.top)
        place = table.names.index(name)
        table.units[place] = unit or table.units[place]
        found["time" if option == "--time-column" else _kind(_plain(name), table.units[place])] = place
    return found


def _kind(name: str, unit: str) -> str:
    """Return what a column shows, by its name, or else by its unit."""
    usual = "heading" if factor(unit, ANGLE) else "gyroscope" if _UPRIGHT.fullmatch(name) else "spin"
    return next((what for what in get_args(Seen) if re.fullmatch("|".join(_NAMES[what]), name)), usual)


def _plain(name: str) -> str:
    """Return a name for comparison: "gyro z" for "GyroZ", and "spin" for "Spin Run #1", as Capstone writes it."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", re.sub(r"[_\s]+", " ", name)).casefold()
    return re.sub(r" run #\d+$", "", spaced)


def _column(table: Table, place: int, unit: Unit | None, gaps: dict[int, str]) -> Array:
    """Return a column in SI, with NaN for cells without a number, which are noted in `gaps` by row; shape (rows,).

    Without a `unit`, it stays in the unit of the table.

    If a spelling of numbers is not understood, half of the motion could be lost, such as all negative values.
    """
    scale, cells = table.scale(place, unit) if unit else 1.0, table.numbers(place)
    texts = {row: cell for row, cell in enumerate(cells) if isinstance(cell, str)}
    gaps |= texts
    odd = [row for row, cell in texts.items() if cell.lower() not in GAPS]
    if strange := [row for row in odd if not re.search("[^\\W\\d_]", texts[row])] or odd[: len(odd) * 10 // len(cells)]:
        words = f"'{brief(texts[strange[0]], 40)}' is not a number ({len(odd)} of {len(cells)} cells)"
        words += "; write numbers only, put the unit in the header, and leave missing cells empty"
        raise InputError([table.fault(words, place, strange[0])])
    return np.array([np.nan if isinstance(cell, str) else converted(cell, scale) for cell in cells])


def _why(missing: int, gaps: Mapping[int, str], whole: int, every: int) -> str:
    """Describe the rows of a film left out: those in `gaps`, and all but every `every`-th of the `whole` ones."""
    example = next((f" (one has '{brief(text, 40)}')" for text in gaps.values() if text.lower() not in GAPS), "")
    words = [f"{counted(missing, 'row')} without a number{example}"] if missing else []
    words += [f"all but one in {every} of {whole} rows, as more would hardly add information"] if every > 1 else []
    return " and ".join(words)
