"""Carries trajectories across stretches of small rattle by its modes (`sweep.models.stiff.modes`), without steps.

While one mode, A, grows and reverses the spin, the other, B, decays, often to less than the round-off of A.  B would
then grow again from noise, and the reversal that it causes would come too early (by 5 % at μ = 200).  Therefore:

* Where A is small, the trajectory *leaps* to the time at which A leaves the linear range.
* Until A has reversed the spin, B has no influence, and is *lifted*: the state holds it e^s times too large, and the
  image keeps s.  The next leap, during which B grows, lowers it again.  So B loses no digit, however small it becomes.

A leap or a lift changes the spin at second order in the sizes α of the modes; this change is applied to M3.  With d the
distance of the spin from the critical spin of the mode, an error of the order of d α⁴ in spin is left, and for a lifted
mode d α²/2 for as long as it is lifted; both are kept below `tolerance`.

When a growing mode is read off the state, less than tolerance/n of it comes from the other mode: from its *products*,
that is through the nonlinear terms, and from its round-off.  Products make up less than 1e-5 of a lifted mode.
scripts/LOG.md has figures, and lists what else was tried.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from sweep.kernels.adams.step import HISTORY, SLIPS, SLOPES
from sweep.kernels.kernel import Kernel
from sweep.kernels.layout import BLOCK, Table
from sweep.kernels.measures.measurement import WORK, Stretch
from sweep.kernels.status import QUIET, RUNNING
from sweep.models.model import Array, Columns, Model
from sweep.models.stiff.form import STATES, StiffForm
from sweep.models.stiff.modes import RATTLE, Rattle, fastest_growth

# Largest size of the modes of a rattle that leaps, which is where a leap ends, and of a lifted mode.  The second value
# of each pair is for rattles whose fast mode decays far more quickly than the slow one grows: the ratio of their
# d Re λ/dn is at least _RATIO.  The limit for a lifted mode has to be below that for a leap, or a lifted mode acts on
# the spin before it is lowered again.  The error of a leap grows with the fourth power of the size, to 8e-9 in spin at
# 1e-2 (wide cells with little friction); so for tolerances below _LOOSE all sizes are smaller, by its fourth root.
_RATIO = 2.6
_LARGEST, _LARGEST_LIFTED = (3e-3, 1e-2), (1e-3, 3e-3)
_LOOSE = 1e-7

# A mode is lifted only if it always exceeds what the other mode excites in it by this factor, because that would be
# lowered with it.
_CLEAR = 1e3

# What mode j contributes to the other: by its products, in units of α_j³; by its round-off, in units of α_j.
_PRODUCTS, _ROUND_OFF = 0.3, 1e-14

# A lifted mode that exceeds the largest size for a leap by this factor has not been lowered in time.
_LATE = 1.5

# Number of steps above which a leap is worthwhile: resolving a rattle into its modes takes as long as two thousand
# steps, and most looks find nothing to do.
WORTHWHILE = 20_000

# Largest share of a mode that may be products or round-off of the other if there is no time to wait for less.
_AT_WORST = 0.1

# Stands for a size of zero where the logarithm is taken.
_ZERO = 1e-300

LIFTS = ("lift0", "lift1")
"""Quantities of an image that hold s for each mode."""

POWERS = ("power0", "power1", "power2")
"""Quantities of an image that hold the power of friction at the last three points, newest first; they exist only if a
measurement needs the work of friction."""

_RATTLE = tuple(STATES[i] for i in RATTLE)


@dataclass(frozen=True)
class Leap:
    """A decision for each cell; arrays of shape (cells,) unless stated otherwise."""

    now: Array
    """True where it leaps now."""
    steps: Array
    """Length of the leap, in steps."""
    lifts: Array
    """s after the leap, shape (cells, 2)."""
    wait: Array
    """Time after which to look again, counted from the end of the leap, or from now if there is none."""


def quiet_energy(reach: Array) -> Array:
    """2 E / I3 below which a rattle is examined, shape (cells,).

    It is large enough for a look to notice any lifted mode that has not been lowered in time.  `reach` is the largest
    spin that the energy allows, shape (cells,).
    """
    return np.asarray((2 * _LATE * _LARGEST[1] * reach) ** 2)


def first_look(model: Model, columns: Columns, reach: Array, time: Array, steps: Array, tolerance: Array) -> Array:
    """The step after which looks are of use in a run of length `time` and `steps` steps: 0 or infinity, shape (cells,).

    Assumes that at the start neither mode is tiny compared with the other.
    """
    with np.errstate(divide="ignore", over="ignore"):
        share = np.log(tolerance / reach)
        return np.where(_brief(fastest_growth(model, columns, reach), share, 0.0, time, steps), np.inf, 0.0)


def _brief(rate: Array, share: Array, lowest: Array | float, time: Array, steps: Array) -> Array:
    """Return whether the rest of the run is too short for looks: for a leap to pay, and for a mode to sink and come
    back.

    Sinking is defined in `_sinks`.  `rate` is the fastest rate of the modes, `lowest` the logarithm of the size of the
    smaller one; `share` is a logarithm too.
    """
    below = np.log(_ROUND_OFF) - share
    return np.asarray((steps < WORTHWHILE) & (rate * time < -2 * below + np.minimum(lowest, 0)))


def carry(form: StiffForm, kernel: Kernel, images: Array, tolerance: float) -> None:
    """Advance the images that are `QUIET` by the modes of their rattle, where that is of use, and set them running."""
    quiet = np.flatnonzero(kernel.table(images)["status"] == QUIET)
    if not len(quiet):
        return
    table = kernel.table(images[quiet])
    states, constants = kernel.unpack(table.images)
    rattle = Rattle.of(form, states, constants)
    sizes = rattle.sizes(table["bending"])
    lifts = _given_up(kernel, table, sizes)
    step, done, goal = table["step"], table["done"], table["goal"]
    leap = plan(rattle, sizes, lifts, table["spin"], step, goal - done, tolerance * form.unit(constants))
    wait = np.ceil(np.minimum(leap.wait / step, goal))
    table["quiet_after"] = done + np.where(leap.now, leap.steps, 0) + wait
    table["status"] = RUNNING
    moved = table.images[leap.now]
    move(kernel, moved, rattle.select(leap.now), leap.steps[leap.now], leap.lifts[leap.now])
    table.images[leap.now] = moved
    images[quiet] = table.images


def _given_up(kernel: Kernel, table: Table, sizes: Array) -> Array:
    """The lifts in `table`; those of modes not lowered in time are given up.

    Such a mode has already acted on the spin at its lifted size.
    """
    lifts = table.columns(LIFTS)
    late = (lifts > 0) & (sizes > _LATE * _LARGEST[1])
    lifts = np.where(late, 0.0, lifts)
    table.set_columns(LIFTS, lifts)
    for each in kernel.measurements:
        each.mode_lost(table, np.asarray(late.any(axis=1)))
    return lifts


def plan(rattle: Rattle, sizes: Array, lifts: Array, spin: Array, step: Array, left: Array, tolerance: Array) -> Leap:
    """Decide which rattles leap, how far, and which modes are lifted.

    Parameters
    ----------
    sizes : sizes α of the modes as the state holds them, shape (cells, 2)
    lifts : present s of the modes, whose true sizes are α e^-s, shape (cells, 2)
    spin, step, tolerance : of shape (cells,), where the tolerance is in spin
    left : number of steps to the time limit, shape (cells,)
    """
    with np.errstate(all="ignore"):
        logs, rates, share = np.log(np.maximum(sizes, _ZERO)), rattle.rates.real, np.log(tolerance / np.abs(spin))
        growing = np.argmax(rates, axis=1)
        seen, true = _Modes.of(logs, rates, growing), _Modes.of(logs - lifts, rates, growing)
        hard = np.divide(*(np.abs(rattle.slopes[:, k]) for k in (1, 0))) >= _RATIO
        smaller = np.minimum(1.0, (tolerance / rattle.form.unit(rattle.constants) / _LOOSE) ** 0.25)
        largest = np.log(smaller * np.where(hard, _LARGEST[1], _LARGEST[0]))
        # The time at which the first mode leaves the linear range, by the true sizes.
        ends = np.where(rates > 0, (largest[:, None] - (logs - lifts)) / rates, np.inf).min(axis=1)
        low = true.log_d + true.rate_d * np.ceil(ends / step) * step
        sinks = _sinks(true, low, largest, share, _stirred(rattle, true.rate_g)) & (np.ceil(ends / step) < left)
        sinks &= np.isfinite(low) & (seen.log_d > np.log(_ZERO))
        strict = np.floor(np.minimum(ends, _until_curved(true, share)) / step)
        steps = np.clip(np.where(sinks, np.ceil(ends / step), strict), 0, left)
        # Whole blocks, so that a run can pause at the end of one.
        steps = np.where(steps < left, steps - steps % BLOCK, left)

        small = (logs < largest[:, None]).all(axis=1) & rattle.sound
        unclear = _until_clear(seen, largest, share)
        use = sinks | (seen.log_g > true.log_g) | (steps >= np.minimum(WORTHWHILE, left))
        now = small & use & (unclear <= 0)

        cap = smaller * np.where(hard, _LARGEST_LIFTED[1], _LARGEST_LIFTED[0])
        cap = np.log(np.minimum(cap, np.sqrt(2 * tolerance / rattle.distances().min(axis=1))))
        after = np.zeros_like(lifts)
        np.put_along_axis(after, (1 - growing)[:, None], np.where(sinks, np.maximum(cap - low, 0), 0)[:, None], 1)

        # After a leap there is nothing to do until the growing mode has reversed the spin; likewise for a rattle that
        # grows out of the linear range.  A rattle that decays into it is examined when it gets there.
        swings = np.where(seen.rate_g > 0, np.maximum(-np.where(now, largest, seen.log_g), 1) / seen.rate_g, np.inf)
        falls = np.where(rates < 0, (logs - largest[:, None]) / -rates, 0).max(axis=1)
        wait = np.where(small & use & ~now, unclear, np.where(small | (falls <= 0), swings, falls))
        left = left - np.where(now, steps, 0)
        fastest = np.abs(np.stack([rates, rates - 2 * rattle.slopes * spin[:, None]])).max(axis=(0, 2))
        over = _brief(fastest, share, logs.min(axis=1), left * step, left)
        over &= (after == 0).all(axis=1) & (now | (lifts == 0).all(axis=1))
        wait = np.where(over, np.inf, wait)
    return Leap(now, steps, after, np.where(rattle.sound, wait, np.inf))


class _Modes(NamedTuple):
    """Logarithms of the sizes, and rates, of the growing mode (g) and of the decaying one (d); shape (cells,)."""

    log_g: Array
    log_d: Array
    rate_g: Array
    rate_d: Array

    @classmethod
    def of(cls, logs: Array, rates: Array, growing: Array) -> _Modes:
        cells = np.arange(len(growing))
        return cls(*(values[cells, mode] for values in (logs, rates) for mode in (growing, 1 - growing)))


def _sinks(true: _Modes, low: Array, largest: Array, share: Array, stirred: Array) -> Array:
    """Return whether the decaying mode, of size `low` after a leap, sinks to where round-off makes up a `share` of it.

    It does not count as sinking if what the other mode excites in it (`stirred`) comes near its lowest size: that would
    be lowered with it.  All arguments except `true` are logarithms.
    """
    lowest = low + true.rate_d / true.rate_g * (np.log(2) - largest)
    deep = (lowest < np.log(_ROUND_OFF) - share) & (lowest > np.log(_CLEAR) + stirred)
    return np.asarray(deep & (true.rate_g > 0) & (true.rate_d < 0))


def _stirred(rattle: Rattle, rate: Array) -> Array:
    """Logarithm of the size that A excites in B while it reverses the spin, shape (cells,).

    A grows and decays as 1/cosh(r t), where r is its `rate`, and so excites B, whose frequency differs by Δν, to
    the size exp(-π Δν / 2 r).
    """
    nu = rattle.rates.imag
    return np.asarray(-np.pi * (nu[:, 1] - nu[:, 0]) / (2 * rate))


def _until_curved(modes: _Modes, share: Array) -> Array:
    """Time until a growing mode changes itself or the other by more than a `share`, a logarithm; shape (cells,)."""
    alone = (np.log(4) + share) / 2
    each = [np.where(rate > 0, (alone - log) / rate, np.inf) for log, rate in zip(modes[:2], modes[2:], strict=True)]
    other = (share - np.log(_PRODUCTS) - 3 * modes.log_g + modes.log_d) / (3 * modes.rate_g - modes.rate_d)
    return np.asarray(np.where(modes.rate_g > 0, np.minimum(np.minimum(*each), other), np.inf))


def _until_clear(modes: _Modes, largest: Array, share: Array) -> Array:
    """Time until neither products nor round-off of the other mode make up more than a `share` of the growing mode.

    A share δ shifts what the mode will do by δ divided by its rate in time, and so changes the spin by about δ n: hence
    δ = tolerance/n.  A mode that is about to leave the linear range cannot wait for that.  `largest` and `share`
    are logarithms; the result is of shape (cells,).
    """
    log_g, log_d, rate_g, rate_d = modes
    waits = []
    for allowed in (share, np.full_like(share, np.log(_AT_WORST))):
        hidden = (
            (np.log(_PRODUCTS) + 3 * log_d - log_g, rate_g - 3 * rate_d),
            (np.log(_ROUND_OFF) + log_d - log_g, rate_g - rate_d),
            (2 * log_d - np.log(4), -2 * rate_d),  # the other mode still changes the spin, and so the rate
        )
        each = [np.where(x > allowed, np.where(r > 0, (x - allowed) / r, np.inf), 0.0) for x, r in hidden]
        waits.append(np.max(each, axis=0))
    leaves = np.maximum((largest - np.log(3) - log_g) / rate_g, 0)
    # Where both modes decay the smaller one does not matter.
    return np.asarray(np.where(rate_g > 0, np.minimum(waits[0], np.maximum(waits[1], leaves)), 0.0))


def move(kernel: Kernel, images: Array, rattle: Rattle, steps: Array, lifts: Array) -> None:
    """Write to `images` the state after `steps` steps of a linear rattle, with its modes lifted by `lifts` from then.

    Parameters
    ----------
    rattle : the rattles of the images
    steps : shape (cells,)
    lifts : s of the modes, shape (cells, 2)
    """
    table = kernel.table(images)
    time = steps * table["step"]
    with np.errstate(over="ignore", invalid="ignore"):
        factors = np.exp(rattle.rates * time[:, None] + lifts - table.columns(LIFTS))
    # An amplitude that is exactly zero remains so, even where a growing exponential overflows.
    factors[rattle.amplitudes == 0] = 1
    table.set_columns(LIFTS, lifts)
    table["done"] += steps
    after = factors * rattle.amplitudes
    table.set_columns(_RATTLE, table.columns(_RATTLE) + rattle.changes(factors, rattle.amplitudes))
    table["M3"] += rattle.turned(after) - rattle.turned(rattle.amplitudes)
    _move_history(table, rattle, factors)
    if WORK in kernel.follows:
        _move_powers(rattle.form, table, kernel.unpack(images)[1])
    spin, energy, inertia = kernel.model.energy(*kernel.unpack(images))
    table["spin"] = spin
    before = table["energy"].copy()
    table["energy"] = energy + 0.5 * inertia * spin**2
    # Energies of the modes as the state holds them, because round-off acts on the state: a lifted mode counts at its
    # lifted size.
    mode_energies = 0.5 * inertia[:, None] * rattle.unit_energies * np.abs(after) ** 2
    stretch = Stretch(time, spin, spin, before - table["energy"], mode_energies)
    for each in kernel.measurements:
        each.skip(table, stretch)


def _move_history(table: Table, rattle: Rattle, factors: Array) -> None:
    """Advance the slopes and slips of past steps.  Their modes are read off the slopes, where they are λ z."""
    for slot in range(HISTORY):
        rocking, turn = [name.format(slot) for name in SLOPES[:4]], SLOPES[4].format(slot)
        slips = [name.format(slot) for name in SLIPS]
        slopes = (rattle.readings @ table.columns(rocking)[:, :, None])[..., 0]
        table.set_columns(rocking, table.columns(rocking) + rattle.changes(factors, slopes)[:, :4])
        table.set_columns(slips, table.columns(slips) + rattle.changes(factors, slopes / rattle.rates)[:, 4:])
        table[turn] = rattle.turn(factors * slopes / rattle.rates)


def _move_powers(form: StiffForm, table: Table, constants: Any) -> None:
    """Set the power of friction at the last points, using the attitude and the normal force of the last state."""
    y = table.columns(STATES).T
    _, geometry = form.slow(*y, constants)
    _, _, numerator, denominator = form.newton(*y[[0, 1, 5, 6]], geometry, 0.0, 0.0, 0.0, constants)
    for j, name in enumerate(POWERS):
        v1, v2 = (table[slip.format((-1 - j) % HISTORY)] for slip in SLIPS)
        table[name] = form.power(numerator / denominator, v1, v2, geometry, constants)
