"""Stretches of small rattle, which the modes of `sweep.models.modes` carry on in place of steps.

While one mode, A, grows and turns the spin, the other, B, decays, often to less than the round-off of A:
it would grow again from noise, and the reversal that B makes come too early (at μ = 200 by 5 %).  So where
A is small the trajectory *leaps* to where A leaves the linear range, and B, passive until A has turned the
spin, is *lifted*: the state carries it e^s times too large, s in a row of its image, and the next leap,
which has B growing, lets it down.  No bit of B is lost however small it becomes.

What a leap or a lift changes in spin at second order in the sizes α of the modes is put into M3.  What is
left is d α⁴/8, for a lifted mode d α²/2 as long as it is there, d being the distance of the spin from its
critical spin; both are kept below `tolerance`, and so is what products and round-off make of the growing mode.
Figures and what else was tried: docs/stiff.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sweep.kernels.lanes import QUIET, RUNNING, Kernel
from sweep.models.model import Array
from sweep.models.modes import RATTLE, Rattle
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

# Resolving a rattle into modes takes about as long as this many steps of it.
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


def carry(kernel: Kernel, images: Array, history: int, tolerance: float) -> None:
    """Carry the images that are `QUIET` on by the modes of their rattle, where that is of use.

    `history` is the number of past steps that an image holds.
    """
    quiet = np.flatnonzero(images[:, kernel.row("status")] == QUIET)
    if not len(quiet):
        return
    part = images[quiet]
    rattle = Rattle.of(*kernel.unpack(part))
    step, done, left = (part[:, kernel.row(name)] for name in ("step", "done", "goal"))
    sizes, lifts = rattle.sizes(part[:, kernel.row("bending")]), part[:, [kernel.row(name) for name in LIFTS]]
    late = (lifts > 0) & (sizes > _LATE * _LARGEST[1])
    # Not let down in time, a lifted mode has turned the spin at its lifted size.
    part[:, [kernel.row(name) for name in LIFTS]] = lifts = np.where(late, 0.0, lifts)
    if "noise_limited" in kernel.measure:
        part[late.any(axis=1), kernel.row("noise_limited")] = 1
    stretch = plan(rattle, sizes, lifts, part[:, kernel.row("spin")], step, left - done, tolerance)
    wait = np.ceil(np.minimum(stretch.wait / step, left))
    part[:, kernel.row("quiet_after")] = done + np.where(stretch.now, stretch.steps, 0) + wait
    part[:, kernel.row("status")] = RUNNING
    moved = part[stretch.now]
    move(kernel, moved, history, rattle.select(stretch.now), stretch.steps[stretch.now], stretch.lifts[stretch.now])
    part[stretch.now] = moved
    images[quiet] = part


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
    rates = rattle.rates.real
    growing = np.argmax(rates, axis=1)

    def of(values: Array, mode: Array) -> Array:
        return np.take_along_axis(values, mode[:, None], axis=1)[:, 0]

    with np.errstate(all="ignore"):
        logs, share = np.log(np.maximum(sizes, _ZERO)), np.log(tolerance / np.abs(spin))
        log_g, log_d, rate_g, rate_d = (of(v, k) for v in (logs, rates) for k in (growing, 1 - growing))
        lift_g, lift_d = of(lifts, growing), of(lifts, 1 - growing)
        hard = np.divide(*(np.abs(rattle.slopes[:, k]) for k in (1, 0))) >= _RATIO
        largest = np.log(np.where(hard, _LARGEST[1], _LARGEST[0]))
        small = (logs < largest[:, None]).all(axis=1) & rattle.sound
        unclear = _until_clear(log_g, log_d, rate_g, rate_d, largest, share)
        # By the true sizes, to where the first mode leaves the linear range.
        true = logs - lifts
        ends = np.where(rates > 0, (largest[:, None] - true) / rates, np.inf).min(axis=1)
        low = log_d - lift_d + rate_d * np.ceil(ends / step) * step
        lowest = low + rate_d / rate_g * (np.log(2) - largest)
        sinks = (lowest < np.log(_ROUND_OFF) - share) & (lowest > np.log(_CLEAR) + _stirred(rattle, rate_g))
        sinks &= (rate_g > 0) & (rate_d < 0) & (np.ceil(ends / step) < left) & (of(sizes, 1 - growing) > 0)
        ends = np.where(sinks, ends, np.minimum(ends, _until_curved(true, rates, growing, share)))
        steps = np.clip(np.where(sinks, np.ceil(ends / step), np.floor(ends / step)), 0, left)
        lifted = np.where(hard, _LARGEST_LIFTED[1], _LARGEST_LIFTED[0])
        lifted = np.log(np.minimum(lifted, np.sqrt(2 * tolerance / rattle.distances().min(axis=1))))
        after = np.zeros_like(lifts)
        np.put_along_axis(after, (1 - growing)[:, None], np.where(sinks, np.maximum(lifted - low, 0), 0)[:, None], 1)
        use = sinks | (lift_g > 0) | (steps >= np.minimum(_WORTHWHILE, left))
        now = small & use & (unclear <= 0)
        # After a leap nothing happens until the growing mode has turned the spin; so too in a rattle
        # that grows out of the linear range.  One that decays into it is looked at when it is there.
        swings = np.where(rate_g > 0, np.maximum(-np.where(now, largest, log_g), 1) / rate_g, np.inf)
        falls = np.where(rates < 0, (logs - largest[:, None]) / -rates, 0).max(axis=1)
        wait = np.where(now | (small & ~use) | (falls <= 0), swings, np.maximum(falls, 0))
        wait = np.where(small & use & ~now, unclear, wait)
    return Stretch(now, steps, after, np.where(rattle.sound, wait, np.inf))


def _stirred(rattle: Rattle, rate: Array) -> Array:
    """Logarithm of what A makes of B while it turns the spin, as a size, shape (cells,).

    A grows and decays as 1/cosh(r t), r its `rate`, and so drives B, off by Δν, by exp(-π Δν / 2 r).
    """
    nu = rattle.rates.imag
    return np.asarray(-np.pi * (nu[:, 1] - nu[:, 0]) / (2 * rate))


def _until_curved(logs: Array, rates: Array, growing: Array, share: Array) -> Array:
    """Time until a growing mode changes itself or the other by more than a `share` (logarithm), shape (cells,)."""
    alone = np.where(rates > 0, ((np.log(4) + share)[:, None] / 2 - logs) / rates, np.inf).min(axis=1)
    cells = np.arange(len(growing))
    log_g, log_d, rate_g, rate_d = (v[cells, k] for v in (logs, rates) for k in (growing, 1 - growing))
    other = (share - np.log(_PRODUCTS) - 3 * log_g + log_d) / (3 * rate_g - rate_d)
    return np.asarray(np.where(rate_g > 0, np.minimum(alone, other), np.inf))


def _until_clear(log_g: Array, log_d: Array, rate_g: Array, rate_d: Array, largest: Array, share: Array) -> Array:
    """Time until neither products of the other nor its round-off make up more than a `share` of the growing mode.

    A share δ moves what the mode will do by δ over its rate in time, and so the spin by about δ n: hence
    δ = tolerance/n.  A mode about to leave the linear range cannot wait for that.  All arguments but
    the rates are logarithms.
    """
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
