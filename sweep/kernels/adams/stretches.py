"""Stretches of small rattle, which the modes of `sweep.models.modes` carry on in place of steps.

While one mode, A, grows and turns the spin, the other, B, decays, often to less than the round-off of A:
it would grow again from noise, and the reversal that B makes come too early (at μ = 200 by 5 %).  So where
A is small the trajectory *leaps* to where A leaves the linear range, and B, passive until A has turned the
spin, is *lifted*: the state carries it e^s times too large, s in a row of its image, and the next leap,
which has B growing, lets it down.  No bit of B is lost however small it becomes.

What a leap or a lift changes in spin at second order in the sizes α of the modes is put into M3.  With d the
distance of the spin from its critical spin, what is left is d α⁴/8 < 1e-10, and for a lifted mode d α²/2
as long as it is there, which is kept below `tolerance`.  Products and round-off make up less than tolerance/n
of a growing mode when it is read off the state, products 1e-5 of one that has been lifted.
Figures and what else was tried: docs/stiff.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sweep.kernels.lanes import QUIET, RUNNING, Kernel
from sweep.models.model import Array, Columns
from sweep.models.modes import RATTLE, Rattle, fastest_growth
from sweep.models.slip_split import SPLIT

# Largest sizes of a rattle that leaps and of a lifted mode, without and with a fast mode that decays
# far quicker than the slow one grows, by the ratio of d Re λ/dn of the two.  The second must be
# below the first, or a lifted mode turns the spin before it is let down.
_RATIO = 2.6
_LARGEST, _LARGEST_LIFTED = (3e-3, 1e-2), (1e-3, 3e-3)

# A lifted mode stands above what the other makes of it by this, or that would be let down with it.
_CLEAR = 1e3

# What mode j makes of the other by its products, in units of α_j³, and by round-off, of α_j.
_PRODUCTS, _ROUND_OFF = 0.3, 1e-14

# A lifted mode of this many times the largest size was let down too late.
_LATE = 1.5

# Steps that are worth a leap: resolving a rattle into modes takes as long as two thousand, and most looks find nothing.
_WORTHWHILE = 20_000

# The share of a mode that may be products or round-off where there is no waiting any more.
_AT_WORST = 0.1

# Stands for a size of zero where its logarithm is asked for.
_ZERO = 1e-300

LIFTS = ("lift0", "lift1")
"""s of each mode."""


@dataclass(frozen=True)
class Stretch:
    """What to do with each cell; arrays over cells."""

    now: Array
    """Whether it leaps."""
    steps: Array
    """How far."""
    lifts: Array
    """s afterwards, shape (cells, 2)."""
    wait: Array
    """Time after which to look again: behind the leap, or from here on."""


def quiet_energy(reach: Array) -> Array:
    """2 E / I3 of a rattle from which on to look, so that none is let down too late unseen.

    `reach` is the largest spin at hand, shape (cells,).
    """
    return np.asarray((2 * _LATE * _LARGEST[1] * reach) ** 2)


def first_look(columns: Columns, reach: Array, time: Array, steps: Array, tolerance: float) -> Array:
    """Steps after which looks are of use in a run of `time` and so many `steps`: 0 or infinity, shape (cells,).

    Takes it that no mode is tiny beside the other at the start.
    """
    with np.errstate(divide="ignore", over="ignore"):
        share = np.log(tolerance / reach)
        return np.where(_brief(fastest_growth(columns, reach), share, 0.0, time, steps), np.inf, 0.0)


def _brief(rate: Array, share: Array, lowest: Array | float, time: Array, steps: Array) -> Array:
    """Whether no leap is worth a look any more, nor a mode has the time to sink (see `_sinks`) and to come back.

    `lowest` is the logarithm of the smaller mode.
    """
    below = np.log(_ROUND_OFF) - share
    return np.asarray((steps < _WORTHWHILE) & (rate * time < -2 * below + np.minimum(lowest, 0)))


def carry(kernel: Kernel, images: Array, history: int, tolerance: float) -> None:
    """Carry the images that are `QUIET` on by the modes of their rattle, where that is of use.

    `history` is the number of past steps that an image holds.
    """
    quiet = np.flatnonzero(images[:, kernel.row("status")] == QUIET)
    if not len(quiet):
        return
    part = images[quiet]
    rattle = Rattle.of(*kernel.unpack(part))
    sizes = rattle.sizes(part[:, kernel.row("bending")])
    lifts = _given_up(kernel, part, sizes)
    step, done, goal = (part[:, kernel.row(name)] for name in ("step", "done", "goal"))
    stretch = plan(rattle, sizes, lifts, part[:, kernel.row("spin")], step, goal - done, tolerance)
    wait = np.ceil(np.minimum(stretch.wait / step, goal))
    part[:, kernel.row("quiet_after")] = done + np.where(stretch.now, stretch.steps, 0) + wait
    part[:, kernel.row("status")] = RUNNING
    moved = part[stretch.now]
    move(kernel, moved, history, rattle.select(stretch.now), stretch.steps[stretch.now], stretch.lifts[stretch.now])
    part[stretch.now] = moved
    images[quiet] = part


def _given_up(kernel: Kernel, images: Array, sizes: Array) -> Array:
    """The lifts in `images`, less those of modes not let down in time: these turned the spin at their lifted size."""
    rows = [kernel.row(name) for name in LIFTS]
    late = (images[:, rows] > 0) & (sizes > _LATE * _LARGEST[1])
    images[:, rows] = lifts = np.where(late, 0.0, images[:, rows])
    if "noise_limited" in kernel.measure:
        images[late.any(axis=1), kernel.row("noise_limited")] = 1
    return lifts


def plan(
    rattle: Rattle, sizes: Array, lifts: Array, spin: Array, step: Array, left: Array, tolerance: float
) -> Stretch:
    """Decide on rattles of modes `sizes` α in the state, `lifts` s of which are not true.

    Parameters
    ----------
    sizes, lifts : shape (cells, 2)
    spin, step : shape (cells,)
    left : steps to the time limit, shape (cells,)
    """
    with np.errstate(all="ignore"):
        logs, rates, share = np.log(np.maximum(sizes, _ZERO)), rattle.rates.real, np.log(tolerance / np.abs(spin))
        growing = np.argmax(rates, axis=1)
        seen, true = _Modes.of(logs, rates, growing), _Modes.of(logs - lifts, rates, growing)
        hard = np.divide(*(np.abs(rattle.slopes[:, k]) for k in (1, 0))) >= _RATIO
        largest = np.log(np.where(hard, _LARGEST[1], _LARGEST[0]))
        # By the true sizes, to where the first mode leaves the linear range.
        ends = np.where(rates > 0, (largest[:, None] - (logs - lifts)) / rates, np.inf).min(axis=1)
        low = true.log_d + true.rate_d * np.ceil(ends / step) * step
        sinks = _sinks(true, low, largest, share, _stirred(rattle, true.rate_g)) & (np.ceil(ends / step) < left)
        sinks &= np.isfinite(low) & (seen.log_d > np.log(_ZERO))
        strict = np.floor(np.minimum(ends, _until_curved(true, share)) / step)
        steps = np.clip(np.where(sinks, np.ceil(ends / step), strict), 0, left)

        small = (logs < largest[:, None]).all(axis=1) & rattle.sound
        unclear = _until_clear(seen, largest, share)
        use = sinks | (seen.log_g > true.log_g) | (steps >= np.minimum(_WORTHWHILE, left))
        now = small & use & (unclear <= 0)

        cap = np.where(hard, _LARGEST_LIFTED[1], _LARGEST_LIFTED[0])
        cap = np.log(np.minimum(cap, np.sqrt(2 * tolerance / rattle.distances().min(axis=1))))
        after = np.zeros_like(lifts)
        np.put_along_axis(after, (1 - growing)[:, None], np.where(sinks, np.maximum(cap - low, 0), 0)[:, None], 1)

        # After a leap nothing happens until the growing mode has turned the spin; so too in a rattle
        # that grows out of the linear range.  One that decays into it is looked at when it is there.
        swings = np.where(seen.rate_g > 0, np.maximum(-np.where(now, largest, seen.log_g), 1) / seen.rate_g, np.inf)
        falls = np.where(rates < 0, (logs - largest[:, None]) / -rates, 0).max(axis=1)
        wait = np.where(small & use & ~now, unclear, np.where(small | (falls <= 0), swings, falls))
        left = left - np.where(now, steps, 0)
        fastest = np.abs(np.stack([rates, rates - 2 * rattle.slopes * spin[:, None]])).max(axis=(0, 2))
        over = _brief(fastest, share, logs.min(axis=1), left * step, left)
        over &= (after == 0).all(axis=1) & (now | (lifts == 0).all(axis=1))
        wait = np.where(over, np.inf, wait)
    return Stretch(now, steps, after, np.where(rattle.sound, wait, np.inf))


class _Modes(NamedTuple):
    """Logarithms of the sizes, and rates, of the mode that grows and of the one that decays; shape (cells,)."""

    log_g: Array
    log_d: Array
    rate_g: Array
    rate_d: Array

    @classmethod
    def of(cls, logs: Array, rates: Array, growing: Array) -> _Modes:
        cells = np.arange(len(growing))
        return cls(*(values[cells, mode] for values in (logs, rates) for mode in (growing, 1 - growing)))


def _sinks(true: _Modes, low: Array, largest: Array, share: Array, stirred: Array) -> Array:
    """Whether the mode that is `low` after a leap falls to where round-off would make up a `share` of it.

    Where what the other makes of it (`stirred`) comes near, that is more than it had, and would be let down with it.
    """
    lowest = low + true.rate_d / true.rate_g * (np.log(2) - largest)
    deep = (lowest < np.log(_ROUND_OFF) - share) & (lowest > np.log(_CLEAR) + stirred)
    return np.asarray(deep & (true.rate_g > 0) & (true.rate_d < 0))


def _stirred(rattle: Rattle, rate: Array) -> Array:
    """Logarithm of what A makes of B while it turns the spin, as a size, shape (cells,).

    A grows and decays as 1/cosh(r t), r its `rate`, and so drives B, off by Δν, by exp(-π Δν / 2 r).
    """
    nu = rattle.rates.imag
    return np.asarray(-np.pi * (nu[:, 1] - nu[:, 0]) / (2 * rate))


def _until_curved(modes: _Modes, share: Array) -> Array:
    """Time until a growing mode changes itself or the other by more than a `share` (logarithm), shape (cells,)."""
    alone = (np.log(4) + share) / 2
    each = [np.where(rate > 0, (alone - log) / rate, np.inf) for log, rate in zip(modes[:2], modes[2:], strict=True)]
    other = (share - np.log(_PRODUCTS) - 3 * modes.log_g + modes.log_d) / (3 * modes.rate_g - modes.rate_d)
    return np.asarray(np.where(modes.rate_g > 0, np.minimum(np.minimum(*each), other), np.inf))


def _until_clear(modes: _Modes, largest: Array, share: Array) -> Array:
    """Time until neither products of the other nor its round-off make up more than a `share` of the growing mode.

    A share δ moves what the mode will do by δ over its rate in time, and so the spin by about δ n: hence
    δ = tolerance/n.  A mode about to leave the linear range cannot wait for that.  `largest` and `share`
    are logarithms.
    """
    log_g, log_d, rate_g, rate_d = modes
    waits = []
    for allowed in (share, np.full_like(share, np.log(_AT_WORST))):
        hidden = (
            (np.log(_PRODUCTS) + 3 * log_d - log_g, rate_g - 3 * rate_d),
            (np.log(_ROUND_OFF) + log_d - log_g, rate_g - rate_d),
            (2 * log_d - np.log(4), -2 * rate_d),  # the other still turns the spin, and with it the rate
        )
        each = [np.where(x > allowed, np.where(r > 0, (x - allowed) / r, np.inf), 0.0) for x, r in hidden]
        waits.append(np.max(each, axis=0))
    leaves = np.maximum((largest - np.log(3) - log_g) / rate_g, 0)
    # Where both decay the smaller one is of no account.
    return np.asarray(np.where(rate_g > 0, np.minimum(waits[0], np.maximum(waits[1], leaves)), 0.0))


def move(kernel: Kernel, images: Array, history: int, rattle: Rattle, steps: Array, lifts: Array) -> None:
    """Write to `images` what `steps` steps of a linear rattle leave, with its modes lifted by `lifts` afterwards."""
    time, rows = steps * images[:, kernel.row("step")], [kernel.row(name) for name in LIFTS]
    with np.errstate(over="ignore", invalid="ignore"):
        factors = np.exp(rattle.rates * time[:, None] + lifts - images[:, rows])
    # What is exactly zero stays so, however far a growing exponential overflows.
    factors[rattle.amplitudes == 0] = 1
    images[:, rows] = lifts
    images[:, kernel.row("done")] += steps
    after = factors * rattle.amplitudes
    images[:, RATTLE] += rattle.changes(factors, rattle.amplitudes)
    images[:, 4] += rattle.turned(after) - rattle.turned(rattle.amplitudes)
    _move_history(kernel, images, history, rattle, factors)
    _move_measures(kernel, images, history, rattle, after, time)


def _move_history(kernel: Kernel, images: Array, history: int, rattle: Rattle, factors: Array) -> None:
    """The slopes and slips of past steps; their modes are read off the slopes, λ z."""
    for slot in range(history):
        first = kernel.row(f"f{slot}_0")
        slopes = (rattle.readings @ images[:, first : first + 4, None])[..., 0]
        images[:, first : first + 4] += rattle.changes(factors, slopes)[:, :4]
        images[:, first + 5 : first + 7] += rattle.changes(factors, slopes / rattle.rates)[:, 4:]
        images[:, first + 4] = rattle.turn(factors * slopes / rattle.rates)


def _move_measures(kernel: Kernel, images: Array, history: int, rattle: Rattle, amplitudes: Array, time: Array) -> None:
    spin, rattling, inertia = SPLIT.energy(*kernel.unpack(images))
    images[:, kernel.row("spin")] = spin
    before = images[:, kernel.row("energy")].copy()
    images[:, kernel.row("energy")] = rattling + 0.5 * inertia * spin**2
    if "reversals" in kernel.measure:
        period, phase = images[:, kernel.row("period")], images[:, kernel.row("phase")] + time
        closes, rest = phase >= period, phase % period
        images[:, kernel.row("closed_window")] = np.where(closes, spin * period, images[:, kernel.row("closed_window")])
        window = images[:, kernel.row("window")] + spin * time
        images[:, kernel.row("window")] = np.where(closes, spin * rest, window)
        images[:, kernel.row("phase")] = rest
    if "noise_limited" in kernel.measure:
        # The state is what round-off sees: a lifted mode at its lifted size.
        energies = 0.5 * inertia[:, None] * rattle.unit_energies * np.abs(amplitudes) ** 2
        for k in (0, 1):
            images[:, kernel.row(f"log_amplitude{k}")] = 0.5 * np.log(np.maximum(energies[:, k], _ZERO))
        images[:, kernel.row("tracked")] = images[:, kernel.row("done")]
        images[:, kernel.row("tracked_spin")] = spin
    if "energy_error" in kernel.measure:
        images[:, kernel.row("work")] += before - images[:, kernel.row("energy")]
        friction = images[:, kernel.row("constant13")]
        for j in range(3):
            slip = kernel.row(f"v{(-1 - j) % history}_0")
            images[:, kernel.row(f"power{j}")] = friction * (images[:, slip : slip + 2] ** 2).sum(axis=1)
