"""A film of a body that spins, from a table of numbers: its spin, its heading, or what a gyroscope on it tells."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import get_args

import numpy as np

from sweep.faults import ConfigError, Fault, brief, either
from sweep.grid import Array
from sweep.kernels.samples import Seen
from sweep.units import ANGLE, SPIN, TIME, WRITTEN, Unit, factor

MOST_ROWS = 20_000
"""Rows of a longer film are left out evenly: they would add time and hardly any knowledge."""

_NO_TABLE = "no table; the first line must name all columns, with semicolons between them if numbers have commas"

# What trackers and phones (phyphox) call their columns, without the unit in parentheses.
_NAMES: dict[str, tuple[str, ...]] = {
    "time": ("time", "t"),
    "spin": ("spin", "n", "angular velocity"),
    "gyroscope": ("gyroscope z", "gyro z", "omega z", "wz"),
    "heading": ("heading", "angle", "theta"),
    "error": ("error", "sigma", "uncertainty"),
}


@dataclass(frozen=True, eq=False)
class Film:
    """What was seen, from its first instant on; arrays of shape (instants,)."""

    time: Array
    """Since the first instant, in the unit of time of the configuration: s in SI."""
    value: Array
    error: Array | None = None
    """Standard error of each value, if the film gives it."""
    what: Seen = "spin"
    """What the values are: the spin; the angular velocity about the axis of the body that points upwards at rest; or
    the angle in radian, without wraps, by which the body's x axis has turned, seen from above."""
    left_out: int = 0
    """Rows that hold no number, or that are too many."""

    @property
    def errors(self) -> Array:
        """The standard errors, which are one if the film does not give them."""
        return np.ones_like(self.time) if self.error is None else self.error

    @cached_property
    def sha256(self) -> str:
        """Hash of everything that determines a misfit."""
        rows = np.stack([self.time, self.value, self.errors])
        return hashlib.sha256(rows.tobytes() + self.what.encode()).hexdigest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Film) and self.sha256 == other.sha256


def read(path: str | Path) -> Film:
    """Read a film from a table with a header, columns apart by commas, semicolons or tabs.

    Raises
    ------
    ConfigError
        if there is no such file, or it has no time, nothing that is seen, an unknown unit, a time that goes back, or
        too few rows.
    """
    path = Path(path)
    header, rows = _rows(path)
    found = _columns(header)
    what = next((each for each in get_args(Seen) if each in found), None)
    if "time" not in found or not what:
        names = either(f"'{name}'" for name in ("spin (rad/s)", "gyroscope z (rad/s)", "heading (deg)"))
        raise _fault(path, 1, f"needs a column 'time (s)' and one {names}; it has {brief(', '.join(header))}")

    def column(name: str, unit: Unit) -> Array:
        """The column in SI; without a unit it is in SI already, and an error in the unit of what is seen."""
        place, written = found[name]
        written = written or (found[what][1] if name == "error" else "")
        if (scale := factor(written, unit) if written else 1.0) is None:
            raise _fault(path, 1, f"{name} is in '{brief(written, 20)}'; its unit must be {either(WRITTEN[unit])}")
        return np.asarray(rows[:, place] * scale)

    unit = ANGLE if what == "heading" else SPIN
    time, value = column("time", TIME), column(what, unit)
    error = column("error", unit) if "error" in found else None
    whole = np.isfinite(time) & np.isfinite(value)
    back = np.flatnonzero(np.diff(time[whole]) < 0)
    if len(back):
        raise _fault(path, int(np.flatnonzero(whole)[back[0] + 1]) + 2, "the time goes back; sort the rows by time")
    if error is not None and not np.all(error[whole] > 0):
        raise _fault(path, int(np.flatnonzero(whole & ~(error > 0))[0]) + 2, "the error must be a number > 0")
    kept = np.flatnonzero(whole)
    if what == "heading":
        value[kept] = np.unwrap(value[kept])
    kept = kept[:: -(-len(kept) // MOST_ROWS)] if len(kept) else kept
    if len(kept) < 8 or time[kept[-1]] == time[kept[0]]:
        need = "a fit needs at least 8, not all at one time"
        raise _fault(path, None, f"has {len(kept)} rows with a time and a {what}; {need}")
    error = None if error is None else error[kept]
    return Film(time[kept] - time[kept[0]], value[kept], error, what, len(rows) - len(kept))


def _rows(path: Path) -> tuple[list[str], Array]:
    """The header, and the numbers below it; NaN where there is none."""
    import pandas

    try:
        with path.open(encoding="utf-8-sig") as stream:
            first = stream.readline()
        mark = max(",;\t", key=first.count)
        table = pandas.read_csv(
            path, sep=mark, encoding="utf-8-sig", dtype=str, keep_default_na=False, skip_blank_lines=False
        )
    except (OSError, ValueError) as error:
        reason = "not UTF-8 text" if isinstance(error, UnicodeDecodeError) else getattr(error, "strerror", _NO_TABLE)
        raise _fault(path, None, f"cannot be read: {reason}") from None
    if not isinstance(table.index, pandas.RangeIndex):  # of columns without a name, to their left for pandas
        raise _fault(path, 2, _NO_TABLE)
    points = table.apply(lambda column: column.str.replace(",", "."))  # of numbers with decimal commas
    return list(map(str.strip, table)), points.apply(pandas.to_numeric, errors="coerce").to_numpy(float)


def _columns(header: list[str]) -> dict[str, tuple[int, str]]:
    """The place and the unit of each known column."""
    found: dict[str, tuple[int, str]] = {}
    for place, written in enumerate(header):
        name, _, unit = (part.strip() for part in re.sub(r"[)\]]\s*$", "", written).replace("[", "(").partition("("))
        plain = re.sub(r"[_\s]+", " ", name).lower()
        for what, names in _NAMES.items():
            if plain in names:
                found.setdefault(what, (place, unit))
    return found


def _fault(path: Path, line: int | None, message: str) -> ConfigError:
    return ConfigError([Fault(str(path), line, None, (), message)])
