"""Reversals: changes of sign of the ripple-free spin, averaged over successive windows of one period of the rattle.

The ripple-free spin n* (`sweep.models.theory.ripple`) is the spin without the ripple that the rattle imposes on it.  A
window is as long as a period of the slower rocking, and the first begins at t = 0.  The time of a reversal is where the
straight line between two successive averages, each placed at the centre of its window, crosses zero.  The average
before the first is the spin at the start, so that an odd count means another sign of the spin at the end.

Windows may be long compared with the faster rocking.  If the faster mode turns the spin within a window, only the
slower one can turn it back, which takes longer than its own period.

The same is counted in windows that begin half a period later.  If the two counts differ, that of the trajectory is
marked: it depends on where the windows begin.  Both kinds of window consist of halves, and each half is summed once.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sweep.jit import inline
from sweep.kernels.layout import Layout, Table
from sweep.kernels.measures.measurement import Measurement, Sample, Stretch, measured
from sweep.kernels.status import Doubt
from sweep.models.model import Array, Columns, Model, Offer
from sweep.models.slow.estimate import Ending
from sweep.units import NUMBER, SPIN, TIME
from sweep.variables import Variable


class Reversals(Measurement):
    name = "reversals"
    summary = "number of spin reversals, the time of the last, and the spin averaged over the rattle"
    asks = Offer.COUNT
    by_default = True
    exact = False
    ripple = True
    quantities = (
        "period", "phase", "half", "earlier_half", "shifted", "closed_window", "closed_shifted",
        "reversals", "reversals_shifted", "last_reversal", "first_spin",
    )  # fmt: skip

    variables = {
        "reversals": measured("int16", NUMBER, "spin reversals, simulated"),
        "t_last_reversal": measured("float64", TIME, "time of the last reversal"),
        "spin_mean": measured(
            "float64", SPIN, "final spin n, without ripple",
            "Ripple-free spin averaged over the last full window before t_stop.",
        ),
    }  # fmt: skip
    series = {
        "ripple_free_spin": Variable(
            "float64", SPIN, "spin n without ripple", "Spin without the ripple of the rattle."
        )
    }  # fmt: skip

    def start(self, model: Model, columns: Columns, rattle: Array) -> Mapping[str, Array | float]:
        spin, _, _ = model.energy(model.start(columns), model.constants.of(columns))
        return {
            "period": model.slower_period(columns), "shifted": 1.0, "last_reversal": np.nan, "first_spin": spin,
        }  # fmt: skip

    def make_step(self, layout: Layout, at_reversal):
        PERIOD, PHASE, HALF, EARLIER, SHIFTED, CLOSED, CLOSED_SHIFTED, COUNT, COUNT_SHIFTED, LAST, FIRST = map(
            layout.at, self.quantities
        )

        @inline
        def step(group, lane, taken):
            accepted, steady, h = taken.accepted, taken.steady, taken.h
            period, shifted = group[PERIOD + lane], group[SHIFTED + lane]
            phase, half, earlier = group[PHASE + lane] + h, group[HALF + lane], group[EARLIER + lane]
            over = phase - 0.5 * period
            closes = accepted & (over >= 0.0)
            # The part of the step beyond the end of the half.  The integrand changes little, so that its value before
            # the step holds for the whole step; half a step is taken off the time of the crossing.
            after = over * steady
            half = half + h * steady
            closed = earlier + (half - after)
            main, other = closes & (shifted == 0.0), closes & (shifted != 0.0)
            previous, previous_shifted = group[CLOSED + lane], group[CLOSED_SHIFTED + lane]
            # At the first window the spin at the start stands for the average before it, half a window away.
            before = previous if previous != 0.0 else period * group[FIRST + lane]
            before_shifted = previous_shifted if previous_shifted != 0.0 else group[FIRST + lane]
            reverses = main & (closed * before < 0.0)
            share = closed / (closed - before) * (1.0 if previous != 0.0 else 0.5)
            crossing = taken.now - 0.5 * h - over - period * (0.5 + share)
            group[COUNT + lane] += 1.0 if reverses else 0.0
            group[COUNT_SHIFTED + lane] += 1.0 if other & (closed * before_shifted < 0.0) else 0.0
            group[LAST + lane] = crossing if reverses else group[LAST + lane]
            at_reversal(group, lane, reverses, group[COUNT + lane], crossing)
            group[CLOSED + lane] = closed if main else previous
            group[CLOSED_SHIFTED + lane] = closed if other else previous_shifted
            group[EARLIER + lane] = half - after if closes else earlier
            group[SHIFTED + lane] = 1.0 - shifted if closes else shifted
            group[PHASE + lane] = (over if closes else phase) if accepted else group[PHASE + lane]
            group[HALF + lane] = (after if closes else half) if accepted else group[HALF + lane]

        return step

    def make_may_settle(self, layout: Layout):
        CLOSED, CLOSED_SHIFTED = layout.at("closed_window"), layout.at("closed_shifted")

        @inline
        def may_settle(group, lane, spin, at_rest):
            # If the signs differ, a reversal is still to come: the spin has gone through zero, and the average over a
            # window has yet to do so.
            agree = (spin * group[CLOSED + lane] > 0.0) & (spin * group[CLOSED_SHIFTED + lane] > 0.0)
            return agree | at_rest

        return may_settle

    def skip(self, table: Table, stretch: Stretch) -> None:
        # The spin reverses only with a large rattle, so that no reversal falls into a stretch.
        length, spin = 0.5 * table["period"], stretch.mean_spin
        phase = table["phase"] + stretch.time
        closings, rest = np.floor(phase / length), phase % length
        first = table["half"] + spin * (length - table["phase"])
        last = np.where(closings == 1, first, spin * length)
        before = np.select([closings == 1, closings == 2], [table["earlier_half"], first], spin * length)
        # The last window that closes, and the one half a period before it.
        newest, second = before + last, np.where(closings == 2, table["earlier_half"] + first, 2 * spin * length)
        for name, shifted in (("closed_window", 0), ("closed_shifted", 1)):
            is_newest = (table["shifted"] + closings - 1) % 2 == shifted
            closed = np.where(is_newest, newest, np.where(closings > 1, second, table[name]))
            table[name] = np.where(closings > 0, closed, table[name])
        table["half"] = np.where(closings > 0, spin * rest, table["half"] + spin * stretch.time)
        table["earlier_half"] = np.where(closings > 0, last, table["earlier_half"])
        table["shifted"] = (table["shifted"] + closings) % 2
        table["phase"] = rest

    def sample(self, table: Table, seen: Sample) -> Mapping[str, Array]:
        return {"ripple_free_spin": seen.steady}

    def read(self, table: Table, times: Array, left: Ending) -> Mapping[str, Array]:
        closed = times >= table["period"]
        return {
            "reversals": table["reversals"],
            "t_last_reversal": table["last_reversal"],
            "spin_mean": np.where(closed, table["closed_window"] / table["period"], np.nan),
        }

    def doubts(self, table: Table) -> Array:
        return np.where(table["reversals"] != table["reversals_shifted"], Doubt.WINDOWS, 0)
