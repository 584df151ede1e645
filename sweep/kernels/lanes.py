"""The compiled loop of every kernel: lanes, groups, and the check between two blocks.

Each thread keeps `LANES` trajectories in one group, transposed so that the values of a quantity in all lanes lie next
to each other.  A whole step is taken inside the loop over lanes, which LLVM turns into vector instructions.  When
the trajectory of a lane ends, its state row is written back and the lane takes the next cell.
"""

from __future__ import annotations

import numpy as np

from sweep.jit import exactly_compiled, full_width, inline
from sweep.kernels.codegen import make_access, make_rest, make_stays
from sweep.kernels.layout import BEYOND, LANES, PACK, STABLE, Layout
from sweep.kernels.measures.measurement import Check
from sweep.kernels.status import DIVERGED, LIFT_OFF, PARADOX, QUIET, RUNNING, SETTLED, TIME_LIMIT
from sweep.models.model import Model, Offer, never_decided

# A trajectory settles only if its rattle could not carry the spin across a limit even with this multiple of its
# energy.
SETTLE_MARGIN = 4.0

# A group returns early once at most this share of the lanes that had a cell at first still have one.
_AT_WORK = 0.75

# Energies beyond this count as not finite.
MAX_ENERGY = 1e300

# A rattle that can only decay is set to exactly zero once its energy (amplitude squared) is below this: products of
# such small numbers are denormal, and operations on such numbers take up to a hundred times as long.
NEGLIGIBLE = 1e-120


def make_advance(run_block, check, layout: Layout):
    """Python function to be compiled: (rows, cells, blocks, least, groups, done) -> None, see `Kernel.advance`.

    `run_block`, (group) -> None, and `check`, (group) -> None, are compiled functions; `done`, of shape (groups,), is
    filled with the blocks that each group has taken.
    """
    from numba import prange

    n_rows, lanes, pack, status, wide = len(layout.names), LANES, PACK, layout.at("status"), full_width()

    @exactly_compiled
    def take(rows, cells, position, group, lane, held):
        """Fill a lane with the next cell of this group's share, or leave it idle if there is none."""
        if position < len(cells):
            held[lane] = cells[position]
            for row in range(n_rows):
                group[row * lanes + lane] = rows[held[lane], row]
        else:
            held[lane] = -1
            group[status + lane] = SETTLED
        return position + 1

    @exactly_compiled
    def release(rows, group, lane, held):
        for row in range(n_rows):
            rows[held[lane], row] = group[row * lanes + lane]

    @exactly_compiled
    def run_group(rows, cells, blocks, least):
        wide()
        # An idle lane computes on zeros.  The result is meaningless but harmless: its status keeps it from
        # being stored.
        group = np.zeros(n_rows * lanes)
        held = np.full(lanes, -1)
        position = 0
        for lane in range(lanes):
            position = take(rows, cells, position, group, lane, held)
        at_work = min(lanes, len(cells))
        packs = (at_work + pack - 1) // pack
        block = 0
        while block < blocks:
            run_block(group, packs)
            check(group)
            block += 1
            idle = 0
            for lane in range(lanes):
                if group[status + lane] != RUNNING:
                    if held[lane] >= 0:
                        release(rows, group, lane, held)
                        position = take(rows, cells, position, group, lane, held)
                    idle += held[lane] < 0
            if idle == lanes or (block >= least and idle >= lanes - _AT_WORK * at_work):
                break
        for lane in range(lanes):
            if held[lane] >= 0:
                release(rows, group, lane, held)
        return block

    def advance(rows, cells, blocks, least, groups, done):
        for g in prange(groups):
            wide()
            done[g] = run_group(rows, cells[g::groups].copy(), blocks, least)

    return advance


def make_check(model: Model, layout: Layout, may_settle, shown, measure, energy_gain: float, real_stability: float):
    """Compiled (group) -> None: checks all lanes between two blocks, and decides which ones end.

    Parameters
    ----------
    may_settle : inline (group, lane, spin, at_rest) -> whether all measurements allow the trajectory to settle
    shown : inline (group, lane) -> whether a measurement has shown that the spin can reverse no more
    measure : inline (group, lane, seen), what the measurements do at a check (see `Measurement.make_check`)
    energy_gain, real_stability : as of `sweep.kernels.kernel.Stepper`
    """
    load_states, load_constants, store_states = make_access(model, layout)
    energy, rest = model.energy, make_rest(len(model.states), model.spin_state)
    saturates = bool(model.faint)
    will_settle = _make_will_settle(layout, may_settle, saturates, damped=model.damped)
    FAINT = layout.at(f"constant.{model.faint}") if saturates else 0
    decides, decided = model.decided is not never_decided, model.decided
    GOAL, DONE, STATUS, ENERGY_ROW, STEP, DECAY, SETTLES = map(
        layout.at, ("goal", "done", "status", "energy", "step", "decay", "settles")
    )  # fmt: skip
    lanes, allowed, conserved = LANES, 1.0 + energy_gain, Offer.ENERGY in model.offers
    wide = full_width()
    pauses = "quiet_energy" in layout
    QUIET_ENERGY, QUIET_AFTER = (layout.at(f"quiet_{name}") if pauses else 0 for name in ("energy", "after"))

    @exactly_compiled
    def check(group):
        wide()
        for lane in range(lanes):
            y = load_states(group, lane)
            spin, rattle, inertia = energy(y, load_constants(group, lane))
            total, before = rattle + 0.5 * inertia * spin * spin, group[ENERGY_ROW + lane]
            group[ENERGY_ROW + lane] = total
            status = group[STATUS + lane]
            running = status == RUNNING

            energy_ratio = 2.0 * rattle / inertia
            bounded, settled, final = will_settle(group, lane, spin, energy_ratio)
            if saturates:
                settled = settled & (rattle < group[FAINT + lane])
            if decides:
                settled = settled | (decided(y, load_constants(group, lane)) & final)
            settled = settled | (shown(group, lane) & final)
            stops = group[SETTLES + lane] != 0.0
            ends = SETTLED if settled & stops else RUNNING
            if pauses:
                small = (energy_ratio < group[QUIET_ENERGY + lane]) & (group[DONE + lane] >= group[QUIET_AFTER + lane])
                # A rattle that can only decay needs no skip: it settles.  No skip begins before the measured values
                # are final, or a reversal just before it would not be counted.
                ends = QUIET if small & final & (not ((bounded | settled) & stops)) else ends
            ends = TIME_LIMIT if (group[DONE + lane] >= group[GOAL + lane]) & (ends != SETTLED) else ends
            status = ends if running else status
            failed = (status == LIFT_OFF) | (status == PARADOX)
            # With a step beyond the stability limit energy appears from nowhere, or the slip oscillates more and
            # more strongly until it looks like one of these failures.
            finite = abs(total) <= MAX_ENERGY
            false = (
                (not finite)
                | (conserved & (total > before * allowed))
                | (failed & (group[STEP + lane] * group[DECAY + lane] > real_stability))
            )
            group[STATUS + lane] = DIVERGED if (running | failed) & false else status
            ended = (status != RUNNING) & (status != QUIET)
            measure(group, lane, Check(running, ended, spin, rattle, inertia, total))
            # The energy of the rattle may be negative: that of the spin is what it would be without rattle.
            store_states(group, lane, bounded & (abs(rattle) < NEGLIGIBLE), rest(y), y)

    return check


def _make_will_settle(layout: Layout, may_settle, saturates: bool, *, damped: bool):
    """Inline (group, lane, spin, 2 E / I3) -> (bounded, settled, final).

    `bounded` says whether upright spin is stable at this spin; `settled`, whether in addition the spin can reverse no
    more and the measured values are final; `final`, whether these are.

    By the averaged equations (ndotab, abdot), a mode of energy I3 e/2 moves the spin on a circle about the critical
    spin n_c of the mode: (n - n_c)² + e is constant.  While the mode decays the spin changes by sqrt(d² + e) - d with
    d = |n - n_c|, which is sqrt(e) at most.  So a trajectory has settled if a change of sqrt(e) carries the spin
    neither out of a stable range nor through zero, where another reversal would have to be counted.  With d from the
    n_c1 of the eigenvalues, nearly round bodies settled before a last reversal (3 of 500 cells, b = 8.3 to 8.9),
    because their growth rates are far from linear in n.

    Beyond n_c1 the mode grows and turns the spin back, to n_c - sqrt(d² + e) at the farthest.  That is still on the
    same side of zero, as long as n < n_c2 = 2 n_c1 (nrk0); `BEYOND` leaves half of this as a margin.  Such spins
    take longest, because a rattle grows slowly just beyond n_c1.  Of the 6072 cells of `configs/mu_b.yaml`, 516 that
    had not settled by t = 30 000 do now; none of 5429 counts changed.  It does not hold where
    friction `saturates`, since the rattle that grows there leaves the energies at which the law is linear.

    A couple that damps the spin (`damped`) can carry it out of an outer range into one where the rattle grows, or below
    what is left of a rattle that decays more slowly.  With such a couple a trajectory has settled only within the share
    of the inner range in `STABLE` (`sweep.models.theory.stability`), or when no rattle is left.  Without this rule, 35
    of 445 certain counts of a draw with strong couples were false.
    """
    FROM, TO, SHARE = map(layout.at, (STABLE[0], STABLE[1], STABLE[-1]))
    is_stable, stays = make_stays(layout), make_stays(layout, 1.0 if saturates else BEYOND)

    @inline
    def will_settle(group, lane, spin, energy_ratio):
        e = SETTLE_MARGIN * energy_ratio
        reach = np.sqrt(e)
        lowest, highest = spin - reach, spin + reach
        bounded, inside = is_stable(group, lane, spin, spin), stays(group, lane, lowest, highest)
        if damped:
            share = group[SHARE + lane]
            within = (lowest > share * group[FROM + lane]) & (highest < share * group[TO + lane])
            inside = within | (e == 0.0) if share < 1.0 else inside
        at_rest = (spin == 0.0) & (e == 0.0)
        signed = (lowest > 0.0) | (highest < 0.0) | at_rest
        final = may_settle(group, lane, spin, at_rest)
        return bounded, inside & signed & final, final

    return will_settle
