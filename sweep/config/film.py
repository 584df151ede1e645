"""A film of a body that spins, from a table of numbers: its spin, its heading, or what a gyroscope on it tells."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import get_args

import numpy as np

from sweep.config import tables
from sweep.config.document import text_of
from sweep.config.tables import GAPS, SEPARATORS, Table
from sweep.faults import ConfigError, brief, counted, either, fault_of
from sweep.grid import Array
from sweep.kernels.samples import Seen
from sweep.units import ANGLE, SPIN, TIME, Unit

MOST_ROWS = 20_000
"""Rows of a longer film are left out evenly: they would add time and hardly any knowledge."""

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
    why: str = ""
    """Which these are, in words."""
    clock: str | None = None
    """The unit of time that the table gives, or "" if it gives none; None for a film that is no table."""

    @property
    def omitted(self) -> str:
        """Which rows are left out, in words; "" if none."""
        verb = "is" if self.left_out == 1 else "are"
        return f"{counted(self.left_out, 'row')} of the film {verb} left out: {self.why}" if self.left_out else ""

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
        if there is no such file, or it has no time, nothing that is seen, an unknown unit, a time that goes back, too
        few rows, or text instead of numbers.
    """
    table = tables.read(str(path), text_of(Path(path)))
    found = _columns(table.names)
    what = next((each for each in get_args(Seen) if each in found), None)
    if "time" not in found or not what:
        names = either(f"'{name}'" for name in ("spin (rad/s)", "gyroscope z (rad/s)", "heading (deg)"))
        words = f"needs a column 'time (s)' and one {names}; it has {brief(', '.join(table.names))}"
        words += "" if len(table.names) > 1 else f", with no {either(SEPARATORS.values())} in the line"
        raise fault_of(words, file=str(path), line=table.top)
    if "error" in found and not table.units[found["error"]]:
        table.units[found["error"]] = table.units[found[what]]
    gaps: dict[int, str] = {}
    units = {"time": TIME, "error": ANGLE if what == "heading" else SPIN}
    time, value, error = (
        _column(table, found[name], units.get(name, units["error"]), gaps) if name in found else None
        for name in ("time", what, "error")
    )
    assert time is not None
    assert value is not None
    whole = np.flatnonzero(np.isfinite(time) & np.isfinite(value))
    if len(back := np.flatnonzero(np.diff(time[whole]) < 0)):
        words = "the time goes back; sort the rows by time"
        raise ConfigError([table.fault(words, found["time"], int(whole[back[0] + 1]))])
    if error is not None and len(wrong := whole[~(error[whole] > 0)]):
        raise ConfigError([table.fault("the error must be a number > 0", found["error"], int(wrong[0]))])
    if what == "heading":
        value[whole] = np.unwrap(value[whole])
    every = -(-len(whole) // MOST_ROWS) or 1
    kept = whole[::every]
    if len(kept) < 8 or time[kept[-1]] == time[kept[0]]:
        need = "a fit needs at least 8, not all at one time"
        raise fault_of(f"has {len(kept)} rows with a time and a {what}; {need}", file=str(path))
    return Film(
        time[kept] - time[kept[0]], value[kept], None if error is None else error[kept], what,
        left_out=len(time) - len(kept), why=_why(len(time) - len(whole), gaps, len(whole), every),
        clock=table.units[found["time"]],
    )  # fmt: skip


def _columns(names: Sequence[str]) -> dict[str, int]:
    """The place of each known column."""
    found: dict[str, int] = {}
    for place, written in enumerate(names):
        plain = re.sub(r"[_\s]+", " ", written).lower()
        for what, known in _NAMES.items():
            if plain in known:
                found.setdefault(what, place)
    return found


def _column(table: Table, place: int, unit: Unit, gaps: dict[int, str]) -> Array:
    """A column in SI, with NaN for cells without a number, which are noted in `gaps` by row; shape (rows,).

    A spelling of numbers that is not understood would leave out one half of a motion, such as all that is negative.
    """
    scale, cells = table.scale(place, unit), table.numbers(place)
    texts = {row: cell for row, cell in enumerate(cells) if isinstance(cell, str)}
    gaps |= texts
    odd = [row for row, cell in texts.items() if cell.lower() not in GAPS]
    if strange := [row for row in odd if not re.search("[^\\W\\d_]", texts[row])] or odd[: len(odd) * 10 // len(cells)]:
        words = f"'{brief(texts[strange[0]], 40)}' is no number, as are {len(odd)} of {len(cells)} cells"
        words += "; write numbers alone, with the unit in the header, and leave cells without one empty"
        raise ConfigError([table.fault(words, place, strange[0])])
    return np.array([np.nan if isinstance(cell, str) else cell * scale for cell in cells])


def _why(missing: int, gaps: Mapping[int, str], whole: int, every: int) -> str:
    """Say which rows of a film are left out: those of `gaps`, and all but `every` so-manieth of the `whole` ones."""
    example = next((text for text in gaps.values() if text.lower() not in GAPS), "")
    words = (
        [f"{counted(missing, 'row')} without a number" + (f" (one has '{brief(example, 40)}')" if example else "")]
        if missing
        else []
    )
    words += [f"all but each {every}th of {whole} rows, as more would hardly add knowledge"] if every > 1 else []
    return " and ".join(words)
