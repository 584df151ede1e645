"""Watch circular rattles, as in nearly round bodies, so that a run can end early: no slow equations hold for them.

It cannot be requested: every kernel that counts the reversals of a model with two rocking modes has it.

At regular checks it takes M·u/J33, to which the spin tends while the rattle decays (`sweep.models.stiff.precession`),
and finds the slope with which that changes with the energy, by least squares over all checks of a window (Welford 1962,
Technometrics 4, 419).  If `STEEPER` times this slope and all the energy left carry the spin neither through zero nor to
where a rattle grows, no reversal will come.  Of 423 cells of `configs/mu_b.yaml` that no other rule ends by
t = 30 000, this holds for 334; none of these reverses by t = 10⁶, while 27 of the others do.
"""

from __future__ import annotations

from collections.abc import Mapping

from sweep.jit import inline
from sweep.kernels.codegen import make_load, make_stays
from sweep.kernels.layout import BEYOND, Layout, constants_of
from sweep.kernels.measures.measurement import Measurement
from sweep.models.model import Array, Columns, Model, Offer
from sweep.models.stiff.form import STATES
from sweep.models.stiff.precession import vertical_spin
from sweep.models.stiff.slip import form_of

NEXT, EVERY = "watch_next", "watch_every"
"""The step of the next check, infinite if there is none, and the steps between two."""

WOUND, LEFT = "spin_when_wound_down", "windows_left"
"""Results of the last window: the least spin that remains when the rattle has decayed, 0 unless no reversal can come;
and the number of further windows that it takes to decay at this rate, negative if it grows at the expense of the spin,
and 0 if no energy was lost."""

CHECKS = 256
"""Checks in a window, less one.  Of the roundest bodies of `mu_b` a rattle loses 0.03 % of its energy in a tenth of the
first leg, so that a few checks could not distinguish this from the ripple of M·u/J33, which is 3e-6."""

STEEPER = 8.0
"""The slope of M·u/J33 over the energy grows as the rattle decays, in nearly round bodies about as the sixth power of
1/spin.  Then the spin stays away from zero if it would with seven times the slope."""

# A rattle that loses a larger share of its energy in a window is soon small enough for others.  One that gains energy
# by more than the inverse has taken it from the spin, and the slope does not show how the spin ends.
_KEPT = 0.5

_WINDOW = ("checks", "first_spin", "first_total", "mean_spin", "mean_total", "sum_squares", "sum_products")
"""For the present window: the number of checks; M·u/J33 and the square of the spin that would have all the energy, at
the first check and on average; the sum of the squares of the latter's deviations from its average, and that of the
products."""


class Decay(Measurement):
    name = "decay"
    summary = "effect of the rattle on the spin after the run"
    asks = Offer.MODES
    needs = ("reversals",)
    quantities = (NEXT, EVERY, WOUND, LEFT, *_WINDOW)

    def start(self, model: Model, columns: Columns, rattle: Array) -> Mapping[str, Array | float]:
        return {NEXT: float("inf")}

    def make_settled(self, layout: Layout):
        AFTER = layout.at(WOUND)

        @inline
        def settled(group, lane):
            return group[AFTER + lane] > 0.0

        return settled

    def make_check(self, layout: Layout):
        WATCHED, BETWEEN, AFTER, TO_COME = map(layout.at, (NEXT, EVERY, WOUND, LEFT))
        COUNT, SPIN0, TOTAL0, SPIN, TOTAL, SQUARES, PRODUCTS = map(layout.at, _WINDOW)
        DONE, states, stays = layout.at("done"), _make_states(layout), make_stays(layout, BEYOND)

        @inline
        def check(group, lane, seen):
            due = seen.running & (group[DONE + lane] >= group[WATCHED + lane])
            spin, total = vertical_spin(states(group, lane), seen.spin, seen.rattle, seen.J)
            checks = group[COUNT + lane] + 1.0
            first, over = checks == 1.0, checks > CHECKS
            spin0, total0 = spin if first else group[SPIN0 + lane], total if first else group[TOTAL0 + lane]
            of_spin, of_total = spin - group[SPIN + lane], total - group[TOTAL + lane]
            off = of_total - of_total / checks
            squares, products = group[SQUARES + lane] + of_total * off, group[PRODUCTS + lane] + of_spin * off
            energy, energy0, slope = total - spin * spin, total0 - spin0 * spin0, products / squares
            end = spin - STEEPER * slope / (1.0 - 2.0 * spin * slope) * energy
            falls = total < total0
            steady = (energy > _KEPT * energy0) & (_KEPT * energy < energy0)
            final = falls & steady & (spin * end > 0.0)
            final = final & stays(group, lane, spin if spin < end else end, end if spin < end else spin)
            if due:
                group[WATCHED + lane] += group[BETWEEN + lane]
                group[COUNT + lane] = 0.0 if over else checks
                group[SPIN0 + lane], group[TOTAL0 + lane] = spin0, total0
                group[SPIN + lane] = 0.0 if over else group[SPIN + lane] + of_spin / checks
                group[TOTAL + lane] = 0.0 if over else group[TOTAL + lane] + of_total / checks
                group[SQUARES + lane], group[PRODUCTS + lane] = (0.0, 0.0) if over else (squares, products)
                group[AFTER + lane] = (abs(end) if final else 0.0) if over else group[AFTER + lane]
                left = energy / (energy0 - energy) if falls else 0.0
                group[TO_COME + lane] = left if over else group[TO_COME + lane]

        return check


def _make_states(layout: Layout):
    """Inline (group, lane) -> the states of the stiff form, for a lane with either set of variables."""
    model = layout.model
    load, constants = make_load(model.states, layout), make_load(constants_of(model), layout, model.constants)
    if model.states == STATES:
        return load
    momentum = form_of(model).momentum

    @inline
    def states(group, lane):
        return momentum(load(group, lane), constants(group, lane))

    return states
