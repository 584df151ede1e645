"""The misfit of a trajectory to a film: the sum of squares of (computed - seen) / error over the film's instants.

Steps are of equal length, and instants lie between them.  After each step of all lanes their spins are noted; at a look
a polynomial through the eight nearest tells the spin at each instant that has been passed.  Of 24 wide bodies with
automatic steps its error was a thirtieth of that of the steps at most; with six points it was as large.  Stepping to
the instants would change the steps, and a branch in every step would keep the loop over lanes from being vectorised.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import comb
from typing import Any, Literal

import numpy as np

from sweep.jit import inline
from sweep.kernels.layout import BLOCK, LANES, Layout, Table
from sweep.kernels.measures.measurement import Measurement, measured
from sweep.kernels.status import RUNNING
from sweep.models.model import SPIN, Array, Columns, Model
from sweep.units import NUMBER

POINTS = 8
"""Of a polynomial, half of them on either side of the instant but near the ends of a trajectory."""

_BEFORE = POINTS - 1
"""Spins that are kept from one look to the next."""

_SPINS = tuple(f"spin{k}" for k in range(_BEFORE + BLOCK + 1))

_SLACK = 1e-9
"""Share of a step by which an instant at the end may lie beyond it, by round-off."""

# Barycentric weights of polynomials through 0, 1, …, n - 1, a row for each n.
_WEIGHTS = np.array([[(-1.0) ** k * comb(max(n - 1, 0), k) for k in range(POINTS)] for n in range(POINTS + 1)])


Seen = Literal["spin", "gyroscope", "heading"]
"""What a film can be of."""


@dataclass(frozen=True, eq=False)
class Film:
    """What was seen, from its first instant on; arrays of shape (instants,)."""

    time: Array
    """Since the first instant, in the unit of time of the configuration: s in SI."""
    value: Array
    error: Array | None = None
    """Standard error of each value, if the film tells."""
    what: Seen = "spin"
    """What the values are: the spin; the angular velocity about an axis of the body that points upwards at rest; or the
    angle in radian, without wraps, by which the body's x axis has turned, seen from above."""
    left_out: int = 0
    """Rows that hold no number, or that are too many."""

    @cached_property
    def sha256(self) -> str:
        """Of all numbers that decide a misfit."""
        return hashlib.sha256(self.rows.tobytes() + self.what.encode()).hexdigest()

    @property
    def rows(self) -> Array:
        """Times, values and errors, which are one if the film does not tell them; shape (3, instants)."""
        return np.stack([self.time, self.value, np.ones_like(self.time) if self.error is None else self.error])

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Film) and self.sha256 == other.sha256

    def __hash__(self) -> int:
        return hash(self.sha256)


@dataclass(frozen=True)
class Misfit(Measurement):
    name = spec = "misfit"
    summary = (
        "sum of squares of (spin - film) / error over the instants of a film: {misfit: film.csv}; with dopri5 alone"
    )
    asks = SPIN
    every_step = True
    quantities = ("film_end", "noted_spin", "compared", "next_instant", "misfit", *_SPINS)
    variables = {
        "misfit": measured(
            "float64", NUMBER, "misfit of the film",
            "Sum of squares of (spin - film) / error over the instants of the film.",
        )
    }  # fmt: skip
    film: Film | None = None
    """None where the kernel is only compiled."""

    @property
    def shared(self) -> Array:
        return self.film.rows if self.film else super().shared

    def start(self, model: Model, columns: Columns, rattle: Array) -> Mapping[str, Array | float]:
        return {"film_end": self.film.time[-1] if self.film else 0.0}

    def make_step(self, layout: Layout, at_reversal: Any) -> Any:
        NOTED = layout.at("noted_spin")

        @inline
        def step(group: Any, lane: int, accepted: Any, spin: Any, steady: Any, work: Any, h: Any, now: Any) -> None:
            group[NOTED + lane] = spin

        return step

    def make_note(self, layout: Layout) -> Any:
        NOTED, FIRST, lanes = layout.at("noted_spin"), layout.at(_SPINS[_BEFORE]), LANES

        @inline
        def note(group: Any, number: int) -> None:
            for lane in range(lanes):
                group[FIRST + number * lanes + lane] = group[NOTED + lane]

        return note

    def make_may_settle(self, layout: Layout) -> Any:
        DONE, STEP, END = map(layout.at, ("done", "step", "film_end"))

        @inline
        def may_settle(group: Any, lane: int, spin: Any, at_rest: Any) -> Any:
            return group[DONE + lane] * group[STEP + lane] >= group[END + lane]

        return may_settle

    def make_look(self, layout: Layout) -> Any:
        NOTED = layout.at("noted_spin")

        @inline
        def look(group: Any, lane: int, running: Any, ended: Any, spin: Any, rattle: Any, J: Any, total: Any) -> None:
            group[NOTED + lane] = spin

        return look

    def make_compare(self, layout: Layout) -> Any:
        DONE, STEP, GOAL, STATUS = map(layout.at, ("done", "step", "goal", "status"))
        NOTED, COMPARED, NEXT, MISFIT, FIRST = map(layout.at, (*self.quantities[1:5], _SPINS[0]))
        lanes, before, points, slack, half = LANES, _BEFORE, POINTS, _SLACK, POINTS // 2

        @inline
        def compare(group: Any, lane: int, film: Any) -> None:
            done, compared, h = int(group[DONE + lane]), int(group[COMPARED + lane]), group[STEP + lane]
            if done == compared:
                return
            # Row `before` of the spins holds that of step `compared`.
            origin = FIRST + (before - compared) * lanes + lane
            group[origin + done * lanes] = group[NOTED + lane]
            ends = (group[STATUS + lane] != RUNNING) | (group[DONE + lane] >= group[GOAL + lane])
            last = done + slack if ends else done - half
            k = int(group[NEXT + lane])
            while k < film.shape[1] and film[0, k] <= last * h:
                at = film[0, k] / h
                first = max(min(int(at) - half + 1, done - points + 1), 0)
                spin = _between(group, origin + first * lanes, min(points, done - first + 1), at - first)
                away = (spin - film[1, k]) / film[2, k]
                group[MISFIT + lane] += away * away
                k += 1
            group[NEXT + lane], group[COMPARED + lane] = k, done
            for row in range(before):
                group[FIRST + row * lanes + lane] = group[FIRST + (row + done - compared) * lanes + lane]

        return compare

    def read(self, table: Table, times: Array) -> Mapping[str, Array]:
        seen = len(self.film.time) if self.film else 0
        return {"misfit": np.where(table["next_instant"] == seen, table["misfit"], np.nan)}


@inline
def _between(group: Any, first: int, number: int, at: float) -> Any:
    """The value at `at` of the polynomial through `number` values of a lane, of which the first is that at zero."""
    above = below = 0.0
    for k in range(number):
        if at == k:
            return group[first + k * LANES]
        share = _WEIGHTS[number, k] / (at - k)
        above += share * group[first + k * LANES]
        below += share
    return above / below
