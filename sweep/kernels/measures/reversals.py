"""Reversals: changes of sign of the spin averaged over successive windows, each as long as one rattle period.

Changes of sign of n itself are too many, because the rattle makes n ripple at twice the frequency of the rattle.  The
time of a reversal is where the straight line between two successive averages, each placed at the centre of its window,
crosses zero.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sweep.jit import inline
from sweep.kernels.layout import Layout, Table
from sweep.kernels.measures.measurement import Measurement, Stretch
from sweep.models.coefficients import rattle_period
from sweep.models.model import COUNT, Array, Columns
from sweep.variables import Variable


@dataclass(frozen=True)
class Reversals(Measurement):
    name = "reversals"
    summary = "number of spin reversals, the time of the last, and the spin averaged over the rattle"
    asks = COUNT
    by_default = True
    rows = (
        "step_rate", "period", "phase", "window", "closed_window", "reversals", "last_reversal",
    )  # fmt: skip

    variables = {
        "reversals": Variable("int16", "1", "spin reversals of the simulated trajectory", of_sound_runs=True),
        "t_last_reversal": Variable("float64", "1", "time of the last spin reversal, in sqrt(c/g)", of_sound_runs=True),
        "spin_mean": Variable(
            "float64", "1", "spin averaged over the last full window before t_stop, in sqrt(g/c)", of_sound_runs=True
        ),
    }

    def start(self, columns: Columns, step: Array, rattle: Array) -> Mapping[str, Array | float]:
        return {"period": rattle_period(columns), "step_rate": 1 / step, "last_reversal": np.nan}

    def make_step(self, layout: Layout, at_reversal: Any) -> Any:
        STEP_RATE, PERIOD, PHASE, WINDOW, CLOSED, REVERSALS, LAST = map(layout.at, self.rows)

        @inline
        def step(
            group: Any, lane: int, accepted: Any, spin: Any, spin_integral: Any, work: Any, h: Any, now: Any
        ) -> None:
            period, previous = group[PERIOD + lane], group[CLOSED + lane]
            phase, window = group[PHASE + lane] + h, group[WINDOW + lane] + spin_integral
            closes = accepted & (phase >= period)
            # The integral over the part of the step beyond the end of the window; the spin is taken to be linear
            # within the step.
            over = phase - period
            rate = group[STEP_RATE + lane]
            after = over * (spin + (spin_integral * rate - spin) * (2.0 - over * rate))
            closed = window - after
            reverses = closes & (closed * previous < 0.0)
            crossing = now - over - period * (0.5 + closed / (closed - previous))
            group[REVERSALS + lane] += 1.0 if reverses else 0.0
            group[LAST + lane] = crossing if reverses else group[LAST + lane]
            at_reversal(group, lane, reverses, group[REVERSALS + lane], crossing)
            group[CLOSED + lane] = closed if closes else previous
            group[PHASE + lane] = (over if closes else phase) if accepted else group[PHASE + lane]
            group[WINDOW + lane] = (after if closes else window) if accepted else group[WINDOW + lane]

        return step

    def make_may_settle(self, layout: Layout) -> Any:
        CLOSED = layout.at("closed_window")

        @inline
        def may_settle(group: Any, lane: int, spin: Any, at_rest: Any) -> Any:
            # If the signs differ, a reversal is still to come: the average over a window has yet to follow the spin
            # through zero.
            return (spin * group[CLOSED + lane] > 0.0) | at_rest

        return may_settle

    def skip(self, table: Table, stretch: Stretch) -> None:
        period, phase = table["period"], table["phase"] + stretch.time
        closes, rest = phase >= period, phase % period
        window = table["window"] + stretch.mean_spin * stretch.time
        table["closed_window"] = np.where(closes, stretch.mean_spin * period, table["closed_window"])
        table["window"] = np.where(closes, stretch.mean_spin * rest, window)
        table["phase"] = rest

    def read(self, table: Table, times: Array) -> Mapping[str, Array]:
        closed = times >= table["period"]
        return {
            "reversals": table["reversals"],
            "t_last_reversal": table["last_reversal"],
            "spin_mean": np.where(closed, table["closed_window"] / table["period"], np.nan),
        }
