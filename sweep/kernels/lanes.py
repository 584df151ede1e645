"""The kernel: many trajectories side by side, each to its own end.

A trajectory's whole state is one row of a table, its *image*: states, constants, step, progress,
measurements.  `advance` takes a table and a list of unfinished cells and moves each on by a
number of blocks of steps.  Nothing else remembers anything: writing the table to disk is a
checkpoint, and since every image evolves by itself, block after block, the numbers cannot depend
on which thread, group, lane or call a cell met.

Inside, a thread keeps `LANES` trajectories in one group, transposed so that a quantity's lanes lie
next to each other, and runs whole steps in the loop over lanes, which LLVM turns into vector
instructions.  A lane that ends is written back and takes the next cell.
"""

from __future__ import annotations

from collections.abc import Iterable
from inspect import getfile
from typing import Any

import numba
import numpy as np

from sweep.jit import inline, is_cached, parallel
from sweep.kernels.measures import noise
from sweep.kernels.stepper import make_load, make_rest, make_step, make_store
from sweep.kernels.tableau import Tableau
from sweep.models.model import Array, Columns, Model, stack

# 16: 22.4 ns a step and lane, 8: 24.2, 32: 24.4 on one thread of a Zen 5 (slip model, AVX-512).
LANES = 16

# Steps between two looks at a lane: at 128, looking costs 1 % of a step on the slip model, and a
# trajectory that settles runs on for 64 steps on average, of 10^5.
BLOCK = 128

# Ends of a trajectory; `dataset` gives them their meanings for the user.
RUNNING, SETTLED, TIME_LIMIT, LIFT_OFF, DIVERGED, PARADOX = range(6)

FAILURES = (LIFT_OFF, DIVERGED, PARADOX)

# Not an end: the rattle is so small that the kernel's `carry` may have a shorter way than steps.
QUIET = 6

TOLERANCE = 1e-8
"""Default error in spin, at t = 400."""

MEASURES = ("reversals", "energy_error", "first_reversal", "noise_limited")

# Ranges of spin in which the rattle decays: about zero, and the next to either side.
_STABLE = ("stable_from", "stable_to", "below_from", "below_to", "above_from", "above_to")
_BASE = ("step", "stable_step", "goal", "done", "status", "energy_start", "energy", *_STABLE)
_MEASURED = {
    "reversals": ("step_rate", "period", "phase", "window", "closed_window", "reversals", "last_reversal"),
    "energy_error": ("work", "violation"),
    "first_reversal": ("first_reversal",),
    "noise_limited": noise.ROWS,
}

# A rattle settles when it could not carry the spin across a limit even with this many times its energy.
SETTLE_MARGIN = 4.0

# Beyond this an energy is no number any more.
MAX_ENERGY = 1e300

# Rattle energies (amplitude squared) below this end as exact zeros, where they can only decay: the
# products of such numbers are denormal, and cost up to a hundred times a normal operation.
NEGLIGIBLE = 1e-120


class Kernel:
    """`advance` for one model, method and choice of measurements, and the layout of its images."""

    # Friction only takes energy away, so a body that gains this share from one look to the next is an
    # integration gone wrong.  Over 40 bodies at 0.3 to 2 times the stability limit, 1e-5 (with the check
    # of failures below) caught each spin that was off by more than 1e-4 and none that was right to 1e-6.
    energy_gain = 1e-5

    def __init__(self, model: Model, tableau: Tableau, measure: Iterable[str], block: int = BLOCK) -> None:
        self.tableau = tableau
        self._lay_out(model, measure)
        run_block = _make_run_block(model, tableau, self.rows, self.measure, block)
        self._advance = self._make_advance(run_block, f"{tableau.name}-{block}")

    def _lay_out(self, model: Model, measure: Iterable[str], more: Iterable[str] = ()) -> None:
        self.model = model
        self.measure = tuple(name for name in MEASURES if name in measure)
        measured = [row for name in self.measure for row in _MEASURED[name]]
        constants = [f"constant{i}" for i in range(count_constants(model))]
        self.rows = (*model.states, *constants, *_BASE, *measured, *more)

    def _make_advance(self, run_block: Any, method: str) -> Any:
        advance = make_advance(
            run_block, make_inspect(self.model, self.rows, self.measure, self.energy_gain), self.rows
        )
        name = f"{self.model.name}-{method}-{'+'.join(self.measure)}"
        return parallel(advance, name, getfile(self.model.rhs))

    def row(self, name: str) -> int:
        return self.rows.index(name)

    def images(self, columns: Columns, step: Array, t_end: float | Array, stable: Array, period: Array) -> Array:
        """Images of trajectories at t = 0, shape (cells, rows).

        Parameters
        ----------
        columns : physical parameters by name, each of shape (cells,)
        step : the longest step wanted, shape (cells,), in sqrt(c/g); the step taken divides `t_end`
        t_end : time limit in sqrt(c/g), one for all or of shape (cells,)
        stable : ranges of spin in which a rattle decays, as rows from, to: about zero, the next
            below and the next above, shape (6, cells); NaN where there is none
        period : length of the window over which the spin is averaged, shape (cells,)
        """
        goal = np.ceil(t_end / step)
        stable_step = t_end / goal * self.model.fastest_decay(columns) <= self.tableau.real_stability
        return self._start(columns, t_end / goal, goal, stable_step, stable, period)

    def _start(
        self, columns: Columns, step: Array, goal: Array, stable_step: Array, stable: Array, period: Array
    ) -> Array:
        states, constants = stack(self.model.start(columns)), stack(self.model.constants(columns))
        images = np.zeros((len(step), len(self.rows)))
        images[:, : len(states)] = states.T
        images[:, len(states) : len(states) + len(constants)] = constants.T
        spin, rattle, inertia = self.model.energy(states, constants)
        for name, value in {
            "goal": goal,
            "stable_step": stable_step,
            "step": step,
            "energy_start": rattle + 0.5 * inertia * spin**2,
            "energy": rattle + 0.5 * inertia * spin**2,
            **dict(zip(_STABLE, stable, strict=True)),
        }.items():
            images[:, self.row(name)] = value
        if "reversals" in self.measure:
            images[:, self.row("period")] = period
            images[:, self.row("step_rate")] = 1 / step
            images[:, self.row("last_reversal")] = np.nan
        if "first_reversal" in self.measure:
            images[:, self.row("first_reversal")] = np.nan
        if "noise_limited" in self.measure:
            for name, value in noise.start_rows(columns, rattle).items():
                images[:, self.row(name)] = value
        return images

    def advance(self, images: Array, cells: Array, blocks: int, stop_when_settled: bool) -> None:
        """Move the trajectories `cells` (indices into `images`) on, in place.

        Returns after `blocks` blocks of steps in every lane, or when all cells have ended.
        """
        self._advance(images, cells, blocks, stop_when_settled, numba.get_num_threads())

    def carry(self, images: Array) -> None:
        """Carry the images that are `QUIET` to where steps are needed again; this method's never are."""

    def unpack(self, images: Array) -> tuple[Array, Array]:
        """States and constants of images, of shapes (states, cells) and (constants, cells)."""
        n = len(self.model.states)
        return images[:, :n].T, images[:, n : self.row("step")].T

    def times(self, images: Array, t_end: float | Array) -> Array:
        """Times that the images have reached, shape (cells,)."""
        return np.asarray(images[:, self.row("done")] / images[:, self.row("goal")] * t_end)

    def is_compiled(self) -> bool:
        """Whether the first call of `advance` finds machine code, in memory or on disk."""
        return bool(self._advance.signatures) or is_cached(self._advance, _SIGNATURE)

    def compile(self) -> None:
        """Compile `advance`, or load it from disk, so that no run's time has it in."""
        self._advance.compile(_SIGNATURE)


_SIGNATURE = (
    numba.float64[:, ::1],
    numba.int64[::1],
    numba.int64,
    numba.boolean,
    numba.int64,
)


def count_constants(model: Model) -> int:
    return len(model.constants({name: np.ones(1) for name in model.parameters}))


def make_advance(run_block: Any, inspect: Any, rows: tuple[str, ...]) -> Any:
    """The kernel proper (see the module) around a compiled block of steps and a look between two."""
    n_rows, lanes, status = len(rows), LANES, rows.index("status") * LANES

    @numba.njit
    def take(images: Any, cells: Any, position: int, group: Any, lane: int, held: Any) -> int:
        """Fill a lane with the next cell of this group's share, or with none."""
        if position < len(cells):
            held[lane] = cells[position]
            for row in range(n_rows):
                group[row * lanes + lane] = images[held[lane], row]
        else:
            held[lane] = -1
            group[status + lane] = SETTLED
        return position + 1

    @numba.njit
    def release(images: Any, group: Any, lane: int, held: Any) -> None:
        for row in range(n_rows):
            images[held[lane], row] = group[row * lanes + lane]

    @numba.njit
    def run_group(images: Any, cells: Any, blocks: int, stop_when_settled: bool) -> None:
        # Zeroed, an idle lane computes garbage harmlessly: its status keeps it from being stored.
        group = np.zeros(n_rows * lanes)
        held = np.full(lanes, -1)
        position = 0
        for lane in range(lanes):
            position = take(images, cells, position, group, lane, held)
        for _ in range(blocks):
            run_block(group)
            inspect(group, stop_when_settled)
            idle = 0
            for lane in range(lanes):
                if group[status + lane] != RUNNING:
                    if held[lane] >= 0:
                        release(images, group, lane, held)
                        position = take(images, cells, position, group, lane, held)
                    idle += held[lane] < 0
            if idle == lanes:
                break
        for lane in range(lanes):
            if held[lane] >= 0:
                release(images, group, lane, held)

    def advance(images: Any, cells: Any, blocks: int, stop_when_settled: bool, groups: int) -> None:
        for g in numba.prange(groups):
            run_group(images, cells[g::groups].copy(), blocks, stop_when_settled)

    return advance


def _make_run_block(model: Model, tableau: Tableau, rows: tuple[str, ...], measure: tuple[str, ...], block: int) -> Any:
    """Compiled group -> None: `block` steps of all lanes, with what is measured in every step."""
    n, n_constants = len(model.states), count_constants(model)
    load_states, load_constants = make_load(0, n, LANES), make_load(n, n_constants, LANES)
    store_states = make_store(0, n, LANES)
    step = make_step(tableau, model.rhs, n)
    count_reversals, add_work = "reversals" in measure, "energy_error" in measure
    watch_spin = make_watch_spin(rows) if count_reversals else watch_nothing
    STEP, GOAL, DONE, STATUS = (rows.index(name) * LANES for name in ("step", "goal", "done", "status"))
    WORK = rows.index("work") * LANES if add_work else 0
    lanes = LANES

    @numba.njit(error_model="numpy")
    def run_block(group: Any) -> None:
        for _ in range(block):
            for lane in range(lanes):
                y = load_states(group, lane)
                p = load_constants(group, lane)
                h, done, status = group[STEP + lane], group[DONE + lane], group[STATUS + lane]
                new, spin, spin_integral, work, sound, airborne, jammed = step(y, p, h)
                active = (status == RUNNING) & (done < group[GOAL + lane])
                accepted = active & sound
                store_states(group, lane, accepted, new, y)
                group[DONE + lane] = done + (1.0 if accepted else 0.0)
                failure = PARADOX if jammed else (LIFT_OFF if airborne else DIVERGED)
                group[STATUS + lane] = failure if active & (not sound) else status
                if add_work:
                    group[WORK + lane] += work if accepted else 0.0
                watch_spin(group, lane, accepted, spin, spin_integral, h, (done + 1.0) * h)

    return run_block


@inline
def watch_nothing(*_: Any) -> None:
    """In the place of what is not asked for; leaves no instruction."""


def make_watch_spin(rows: tuple[str, ...]) -> Any:
    """Compiled: add a step to the running window of the spin, count where its sign changes.

    A reversal is a change of sign between the spin averaged over one window of the rattle's
    period and over the next (raw signs of n over-count, for the rattle ripples n).  Its time is
    where the line between the two averages, each put at its window's centre, crosses zero.
    """
    STEP_RATE, PERIOD, PHASE, WINDOW, CLOSED, COUNT, LAST = (
        rows.index(name) * LANES
        for name in ("step_rate", "period", "phase", "window", "closed_window", "reversals", "last_reversal")
    )

    keep_first = "first_reversal" in rows
    FIRST = rows.index("first_reversal") * LANES if keep_first else 0

    @inline
    def watch_spin(group: Any, lane: int, accepted: Any, spin: Any, spin_integral: Any, h: Any, now: Any) -> None:
        period, previous = group[PERIOD + lane], group[CLOSED + lane]
        phase, window = group[PHASE + lane] + h, group[WINDOW + lane] + spin_integral
        closes = accepted & (phase >= period)
        # The part of the step behind the window's end, with the spin linear in the step.
        over = phase - period
        rate = group[STEP_RATE + lane]
        after = over * (spin + (spin_integral * rate - spin) * (2.0 - over * rate))
        closed = window - after
        reverses = closes & (closed * previous < 0.0)
        crossing = now - over - period * (0.5 + closed / (closed - previous))
        group[COUNT + lane] += 1.0 if reverses else 0.0
        group[LAST + lane] = crossing if reverses else group[LAST + lane]
        if keep_first:
            first = reverses & (group[COUNT + lane] == 1.0)
            group[FIRST + lane] = crossing if first else group[FIRST + lane]
        group[CLOSED + lane] = closed if closes else previous
        group[PHASE + lane] = (over if closes else phase) if accepted else group[PHASE + lane]
        group[WINDOW + lane] = (after if closes else window) if accepted else group[WINDOW + lane]

    return watch_spin


def make_inspect(model: Model, rows: tuple[str, ...], measure: tuple[str, ...], energy_gain: float) -> Any:
    """Compiled (group, stop_when_settled): look at all lanes between two blocks, decide who ends."""
    n = len(model.states)
    load_states, load_constants = make_load(0, n, LANES), make_load(n, count_constants(model), LANES)
    store_states = make_store(0, n, LANES)
    energy, rest = model.energy, make_rest(n, model.spin_state)
    will_settle = _make_will_settle(rows, "reversals" in measure)
    track = noise.make_track(rows, LANES) if "noise_limited" in measure else watch_nothing
    watch_energy = "energy_error" in measure
    WORK = rows.index("work") * LANES if watch_energy else 0
    VIOLATION = rows.index("violation") * LANES if watch_energy else 0
    GOAL, DONE, STATUS, START, ENERGY, STABLE_STEP = (
        rows.index(name) * LANES for name in ("goal", "done", "status", "energy_start", "energy", "stable_step")
    )
    lanes, allowed, conserved = LANES, 1.0 + energy_gain, "energy_error" in model.measures
    pauses = "quiet_energy" in rows
    QUIET_ENERGY, QUIET_AFTER = (rows.index(f"quiet_{name}") * LANES if pauses else 0 for name in ("energy", "after"))

    @numba.njit(error_model="numpy")
    def inspect(group: Any, stop_when_settled: bool) -> None:
        for lane in range(lanes):
            y = load_states(group, lane)
            spin, rattle, inertia = energy(y, load_constants(group, lane))
            total, before = rattle + 0.5 * inertia * spin * spin, group[ENERGY + lane]
            group[ENERGY + lane] = total
            status = group[STATUS + lane]
            running = status == RUNNING
            if watch_energy:
                violation = abs(total + group[WORK + lane] - group[START + lane])
                worst = group[VIOLATION + lane]
                group[VIOLATION + lane] = violation if violation > worst else worst

            energy_ratio = 2.0 * rattle / inertia
            bounded, settled = will_settle(group, lane, spin, energy_ratio)
            ends = SETTLED if settled & stop_when_settled else RUNNING
            if pauses:
                small = (energy_ratio < group[QUIET_ENERGY + lane]) & (group[DONE + lane] >= group[QUIET_AFTER + lane])
                ends = QUIET if small & (not (bounded & stop_when_settled)) else ends
            ends = TIME_LIMIT if (group[DONE + lane] >= group[GOAL + lane]) & (ends != SETTLED) else ends
            status = ends if running else status
            failed = (status == LIFT_OFF) | (status == PARADOX)
            # A step beyond the stability limit shows as energy from nowhere, or lets the slip swing
            # up until it feigns one of these ends.
            finite = abs(total) <= MAX_ENERGY
            false = (
                (not finite) | (conserved & (total > before * allowed)) | (failed & (group[STABLE_STEP + lane] == 0.0))
            )
            group[STATUS + lane] = DIVERGED if (running | failed) & false else status
            ended = (status != RUNNING) & (status != QUIET)
            track(group, lane, running, ended & (energy_ratio > noise.SEEN * spin * spin), rattle, spin)
            store_states(group, lane, bounded & (rattle < NEGLIGIBLE), rest(y), y)

    return inspect


def _make_will_settle(rows: tuple[str, ...], count_reversals: bool) -> Any:
    """Compiled: is upright spin stable here (`bounded`), and will spin and count stay as they are?

    A mode of energy I3 e/2 that decays carries the spin by sqrt(d² + e) - d, d being the distance from its
    critical spin (averaged equations, ndotab, abdot): by sqrt(e) at the most, however near that is.
    Settled is what this cannot carry out of the stable range, nor through zero, where another
    reversal would have to be counted.  With the n_c1 of the eigenvalues for d, nearly round bodies settled
    ahead of a last reversal (3 of 500 cells, b = 8.3 to 8.9), for their growth is far from linear in n.
    """
    FROM, TO, BELOW_FROM, BELOW_TO, ABOVE_FROM, ABOVE_TO = (rows.index(name) * LANES for name in _STABLE)
    CLOSED = rows.index("closed_window") * LANES if count_reversals else 0

    @inline
    def will_settle(group: Any, lane: int, spin: Any, energy_ratio: Any) -> Any:
        e = SETTLE_MARGIN * energy_ratio
        low, high = group[FROM + lane], group[TO + lane]
        under, over = spin < low, spin > high
        low = group[BELOW_FROM + lane] if under else (group[ABOVE_FROM + lane] if over else low)
        high = group[BELOW_TO + lane] if under else (group[ABOVE_TO + lane] if over else high)
        reach = np.sqrt(e)
        lowest, highest = spin - reach, spin + reach
        bounded = (spin > low) & (spin < high)
        inside = (lowest > low) & (highest < high)
        at_rest = (spin == 0.0) & (e == 0.0)
        signed = (lowest > 0.0) | (highest < 0.0) | at_rest
        if count_reversals:
            signed = signed & ((spin * group[CLOSED + lane] > 0.0) | at_rest)
        return bounded, bounded & inside & signed

    return will_settle
