"""The margin of a count: the distance in spin of a trajectory from one more reversal, and from one fewer.

After its last reversal the averaged spin makes one more arc: away from zero, and then perhaps back.  Its largest size
in this arc, the *overshoot*, is the margin to one reversal fewer; its smallest size after that, the *nearest approach*,
is the margin to one more.  Where a count begins, the overshoot of the cells above and the nearest approach of the cells
below fall to zero, nearly along one straight line: the overshoot above, and below the nearest approach with the sign
changed, are a smooth function of the parameters, whose root is the boundary.

For a trajectory that settles, the slow equations give the further course of its spin (`resting_spin`).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sweep.jit import inline
from sweep.kernels.layout import Layout, Table
from sweep.kernels.measures.decay import WOUND
from sweep.kernels.measures.measurement import Measurement, measured
from sweep.kernels.measures.resting_spin import ends_as_predicted, only
from sweep.kernels.status import SETTLED
from sweep.models.model import Array, Offer
from sweep.models.slow.estimate import Ending
from sweep.units import SPIN

EXTREMES = ("overshoot", "nearest_approach")
"""The quantities that hold the margins, as far as the trajectory has come."""


class Margin(Measurement):
    name = "margin"
    summary = "distance in spin of each trajectory from one more reversal, and from one fewer"
    asks = Offer.COUNT
    needs = ("reversals",)
    by_default = True
    exact = False
    quantities = (
        *EXTREMES, "counted", "window_time", "window_size", "window_time_before", "window_size_before",
    )  # fmt: skip

    variables = {
        "margin_more": measured(
            "float64", SPIN, "margin to one reversal more",
            "Distance, in spin, to one more reversal: the smallest averaged spin after the largest since the last "
            "reversal.  It is missing where the count is not final.",
        ),
        "margin_fewer": measured(
            "float64", SPIN, "margin to one reversal fewer",
            "Distance, in spin, to one reversal fewer: the largest averaged spin since the last reversal.  It is "
            "missing without a reversal.",
        ),
    }  # fmt: skip

    def make_check(self, layout: Layout):
        OVERSHOOT, NEAREST, COUNTED, TIME, SIZE, TIME_BEFORE, SIZE_BEFORE = map(layout.at, self.quantities)
        CLOSED, PERIOD, COUNT = map(layout.at, ("closed_window", "period", "reversals"))
        DONE, STEP, PHASE, SHIFTED = map(layout.at, ("done", "step", "phase", "shifted"))

        @inline
        def check(group, lane, seen):
            period, count = group[PERIOD + lane], group[COUNT + lane]
            size = abs(group[CLOSED + lane]) / period
            # When the window closed; if half a window has closed since then, `shifted` is 0.
            since = group[PHASE + lane] + (0.0 if group[SHIFTED + lane] != 0.0 else 0.5 * period)
            time = group[DONE + lane] * group[STEP + lane] - since
            first, middle, size1, size2 = group[TIME_BEFORE + lane], group[TIME + lane], size, group[SIZE + lane]
            size3 = group[SIZE_BEFORE + lane]
            # The first window counts however early the check: a run may settle there, with no other.
            if seen.running & (size > 0.0) & ((time > middle + 0.5 * period) | (size2 == 0.0)):
                new = count != group[COUNTED + lane]
                overshoot, nearest = group[OVERSHOOT + lane], group[NEAREST + lane]
                # The vertex of the parabola through the last three, if the middle one is an extreme.
                turns = (not new) & (first > 0.0) & ((size1 - size2) * (size2 - size3) < 0.0)
                vertex = _vertex(time - middle, size1 - size2, first - middle, size3 - size2) if turns else 0.0
                extreme = size2 + vertex
                overshoot = extreme if turns & (extreme > overshoot) else overshoot
                nearest = extreme if turns & (extreme < nearest) & (extreme > 0.0) else nearest
                further = new | (size >= overshoot)
                group[OVERSHOOT + lane] = size if further else overshoot
                group[NEAREST + lane] = size if further | (size < nearest) else nearest
                group[TIME_BEFORE + lane], group[SIZE_BEFORE + lane] = (0.0, 0.0) if new else (middle, size2)
                group[TIME + lane], group[SIZE + lane], group[COUNTED + lane] = time, size, count

        return check

    def read(self, table: Table, times: Array, left: Ending) -> Mapping[str, Array]:
        return dict(zip(self.variables, margins(table, left), strict=True))


def margins(table: Table, left: Ending) -> tuple[Array, Array]:
    """Return the margins to one reversal more and to one fewer, as `Margin.read` does, each of shape (cells,)."""
    arc = last_arc(table, only(ends_as_predicted(table, left), left))
    nearest = arc.nearest_approach
    if WOUND in table.layout:
        nearest = np.where(table[WOUND] > 0, np.fmin(nearest, table[WOUND]), nearest)
    more = np.where(table["status"] == SETTLED, nearest, np.nan)
    return more, np.where(table["reversals"] > 0, arc.overshoot, np.nan)


def last_arc(table: Table, left: Ending) -> Ending:
    """Find the last arcs of the spins: as recorded, and as the slow equations continue them, which is what is `left`.

    Where these do not apply, the spin hardly changes any more.  The reversals are all those of the trajectory.
    """
    unknown = np.full(len(table.rows), np.nan)
    overshoot, nearest = (table[name] if name in table.layout else unknown for name in EXTREMES)
    further = (left.reversals > 0) | (left.overshoot > overshoot)
    return left._replace(
        reversals=table["reversals"] + np.nan_to_num(left.reversals),
        overshoot=np.where(further, left.overshoot, overshoot),
        nearest_approach=np.where(further, left.nearest_approach, np.fmin(nearest, left.nearest_approach)),
    )


@inline
def _vertex(t1, v1, t2, v2):
    """The extreme of the parabola through (0, 0), (t1, v1) and (t2, v2)."""
    a = (v1 / t1 - v2 / t2) / (t1 - t2)
    b = v1 / t1 - a * t1
    return -b * b / (4.0 * a)
