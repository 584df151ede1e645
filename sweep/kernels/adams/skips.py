"""Skips intervals of small rattle by its modes (`sweep.models.stiff.modes`), without steps.

While one mode, A, grows and reverses the spin, the other, B, decays, often to less than the round-off of A.  B would
then grow again from noise, and the reversal that it causes would come too early (by 5 % at μ = 200).  Therefore:

* Where A is small, the trajectory *skips* to the time at which A leaves the linear range.
* Until A has reversed the spin, B has no influence, and is *rescaled*: the state holds it e^s times too large, and the
  state row keeps s.  The next skip, during which B grows, takes the factor back.  So B loses no digit, however small it
  becomes.

A skip or a new scale changes the spin at second order in the sizes α of the modes; this change is applied to M3.  With
d the distance of the spin from the critical spin of the mode, an error of the order of d α⁴ in spin is left, and for a
rescaled mode d α²/2 for as long as it is rescaled; both are kept below `tolerance`.

When a growing mode is read off the state, less than tolerance/n of it comes from the other mode: from its *products*,
that is through the nonlinear terms, and from its round-off.  Products make up less than 1e-5 of a rescaled mode.
scripts/LOG.md has figures, and lists what else was tried.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from sweep.kernels.adams.step import HISTORY, SLIPS, SLOPES
from sweep.kernels.kernel import Kernel
from sweep.kernels.layout import BLOCK, Table
from sweep.kernels.measures.measurement import Stretch
from sweep.kernels.status import QUIET, RUNNING
from sweep.models.model import Array, Columns, Model
from sweep.models.stiff.form import STATES, StiffForm
from sweep.models.stiff.modes import RATTLE, Rattle, fastest_growth

# Largest size of the modes of a rattle that is skipped, which is where a skip ends, and of a rescaled mode.  The second
# value of each pair is for rattles whose faster mode decays far more quickly than the slower one grows: the ratio of
# their d Re λ/dn is at least _RATIO.  The limit for a rescaled mode has to be below that for a skip, or a rescaled mode
# acts on the spin before its factor is taken back.  The error of a skip grows with the fourth power of the size, to
# 8e-9 in spin at 1e-2 (wide cells with little friction); so for tolerances below _LOOSE all sizes are smaller, by its
# fourth root.
_RATIO = 2.6
_LARGEST, _LARGEST_RESCALED = (3e-3, 1e-2), (1e-3, 3e-3)
_LOOSE = 1e-7

# A mode is rescaled only if it always exceeds what the other mode excites in it by this factor, because that would be
# divided by the same factor.
_CLEAR = 1e3

# What mode j contributes to the other: by its products, in units of α_j³; by its round-off, in units of α_j.
_PRODUCTS, _ROUND_OFF = 0.3, 1e-14

# A rescaled mode that exceeds the largest size for a skip by this factor has kept its factor for too long.
_LATE = 1.5

# Number of steps above which a skip is worthwhile: resolving a rattle into its modes takes as long as two thousand
# steps, and most looks find nothing to do.
WORTHWHILE = 20_000

# Largest share of a mode that may be products or round-off of the other if there is no time to wait for less.
_AT_WORST = 0.1

# Stands for a size of zero where the logarithm is taken.
_ZERO = 1e-300

SCALES = ("scale0", "scale1")
"""Quantities of a state row that hold s for each mode."""

POWERS = ("power0", "power1", "power2")
"""Quantities of a state row that hold the power of friction at the last three points, newest first; they exist only if
a measurement needs the work of friction."""

_RATTLE = tuple(STATES[i] for i in RATTLE)


@dataclass(frozen=True)
class Skip:
    """A decision for each cell; arrays of shape (cells,) unless stated otherwise."""

    now: Array
    """True where it skips now."""
    steps: Array
    """Length of the skip, in steps."""
    scales: Array
    """s after the skip, shape (cells, 2)."""
    wait: Array
    """Time after which to look again, counted from the end of the skip, or from now if there is none."""


def quiet_energy(reach: Array) -> Array:
    """2 E / I3 below which a rattle is examined, shape (cells,).

    It is large enough for a look to notice any rescaled mode that has kept its factor for too long.  `reach` is the
    largest spin that the energy allows, shape (cells,).
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
    """Return whether the rest of the run is too short for looks: for a skip to pay, and for a mode to sink and come
    back.

    Sinking is defined in `_sinks`.  `rate` is the fastest rate of the modes, `lowest` the logarithm of the size of the
    smaller one; `share` is a logarithm too.
    """
    below = np.log(_ROUND_OFF) - share
    return np.asarray((steps < WORTHWHILE) & (rate * time < -2 * below + np.minimum(lowest, 0)))


def skip(form: StiffForm, kernel: Kernel, rows: Array, tolerance: float) -> None:
    """Skip what can be skipped of the state rows that are `QUIET`, and set them running."""
    quiet = np.flatnonzero(kernel.table(rows)["status"] == QUIET)
    if not len(quiet):
        return
    table = kernel.table(rows[quiet])
    states, constants = kernel.unpack(table.rows)
    rattle = Rattle.of(form, states, constants)
    sizes = rattle.sizes(table["bending"])
    scales = _given_up(kernel, table, sizes)
    step, done, goal = table["step"], table["done"], table["goal"]
    found = plan(rattle, sizes, scales, table["spin"], step, goal - done, tolerance * form.unit(constants))
    wait = np.ceil(np.minimum(found.wait / step, goal))
    table["quiet_after"] = done + np.where(found.now, found.steps, 0) + wait
    table["status"] = RUNNING
    moved = table.rows[found.now]
    move(kernel, moved, rattle.select(found.now), found.steps[found.now], found.scales[found.now])
    table.rows[found.now] = moved
    rows[quiet] = table.rows


def _given_up(kernel: Kernel, table: Table, sizes: Array) -> Array:
    """The scales in `table`; those of modes that have kept their factor for too long are given up.

    Such a mode has already acted on the spin at the size that the state holds.
    """
    scales = table.columns(SCALES)
    late = (scales > 0) & (sizes > _LATE * _LARGEST[1])
    scales = np.where(late, 0.0, scales)
    table.set_columns(SCALES, scales)
    for each in kernel.measurements:
        each.mode_lost(table, np.asarray(late.any(axis=1)))
    return scales


def plan(rattle: Rattle, sizes: Array, scales: Array, spin: Array, step: Array, left: Array, tolerance: Array) -> Skip:
    """Decide which rattles skip, how far, and which modes are rescaled.

    | the rattle | now | the next look |
    |---|---|---|
    | is small, a skip is of use, and its growing mode is clear | skips | when that mode has reversed the spin |
    | is small, a skip is of use, and its growing mode is hidden by the other | steps | when it is clear |
    | is small, and a skip is of no use | steps | when the growing mode has reversed the spin |
    | is large, and falls | steps | when it is small |
    | is large, and both modes grow | steps | when the growing mode has reversed the spin |
    | has no two modes, or the run is too short for a skip to pay and has no scale | as above | never |

    A skip is of use if the decaying mode sinks in it, if it takes back a factor, or if it is long.

    Parameters
    ----------
    sizes : sizes α of the modes as the state holds them, shape (cells, 2)
    scales : present s of the modes, whose true sizes are α e^-s, shape (cells, 2)
    spin, step, tolerance : of shape (cells,), where the tolerance is in spin
    left : number of steps to the time limit, shape (cells,)
    """
    with np.errstate(all="ignore"):
        outlook = _Outlook.of(rattle, sizes, scales, spin, step, left, tolerance)
        steps, low, sinks = _length(outlook)
        small = (outlook.logs < outlook.largest[:, None]).all(axis=1) & rattle.sound
        use = sinks | (outlook.seen.log_g > outlook.true.log_g) | (steps >= np.minimum(WORTHWHILE, left))
        unclear = _until_clear(outlook)
        now = small & use & (unclear <= 0)
        after = _rescaled(outlook, low, sinks)
        wait = np.where(small & use & ~now, unclear, _until_of_use(outlook, now, small))
        wait = np.where(_too_brief(outlook, np.where(now, steps, 0), now, after), np.inf, wait)
    return Skip(now, steps, after, np.where(rattle.sound, wait, np.inf))


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


class _Outlook(NamedTuple):
    """What decides about a skip.  Sizes and shares are logarithms; arrays of shape (cells,) unless stated otherwise."""

    rattle: Rattle
    logs: Array
    """Sizes of the modes as the state holds them, shape (cells, 2)."""
    scales: Array
    """Present s of the modes, shape (cells, 2)."""
    growing: Array
    """Index of the mode that grows, or decays more slowly."""
    seen: _Modes
    """Sizes as the state holds them."""
    true: _Modes
    """True sizes."""
    largest: Array
    """Size at which a mode leaves the linear range."""
    most_rescaled: Array
    """Largest size of a rescaled mode."""
    share: Array
    """tolerance/n, the share of a mode that may come from the other one."""
    spin: Array
    step: Array
    left: Array
    """Number of steps to the time limit."""

    @classmethod
    def of(
        cls, rattle: Rattle, sizes: Array, scales: Array, spin: Array, step: Array, left: Array, tolerance: Array
    ) -> _Outlook:
        logs, rates = np.log(np.maximum(sizes, _ZERO)), rattle.rates.real
        growing = np.argmax(rates, axis=1)
        seen, true = _Modes.of(logs, rates, growing), _Modes.of(logs - scales, rates, growing)
        hard = np.divide(*(np.abs(rattle.slopes[:, k]) for k in (1, 0))) >= _RATIO
        smaller = np.minimum(1.0, (tolerance / rattle.form.unit(rattle.modes.constants) / _LOOSE) ** 0.25)
        largest, cap = (smaller * np.where(hard, *pair[::-1]) for pair in (_LARGEST, _LARGEST_RESCALED))
        cap = np.minimum(cap, np.sqrt(2 * tolerance / rattle.distances().min(axis=1)))
        share = np.log(tolerance / np.abs(spin))
        return cls(
            rattle, logs, scales, growing, seen, true, np.log(largest), np.log(cap), share, spin, step, left
        )  # fmt: skip


def _length(outlook: _Outlook) -> tuple[Array, Array, Array]:
    """Length of a skip in steps, the size of the decaying mode after it, and whether that mode sinks; shape (cells,).

    If it sinks, the skip ends where the first mode leaves the linear range, by the true sizes; otherwise also where
    nonlinear terms would change the spin by more than the tolerance.
    """
    rattle, true, left, largest = outlook.rattle, outlook.true, outlook.left, outlook.largest
    rates, logs = rattle.rates.real, outlook.logs - outlook.scales
    ends = np.where(rates > 0, (largest[:, None] - logs) / rates, np.inf).min(axis=1)
    whole = np.ceil(ends / outlook.step)
    low = true.log_d + true.rate_d * whole * outlook.step
    sinks = _sinks(true, low, largest, outlook.share, _stirred(rattle, true.rate_g)) & (whole < left)
    sinks &= np.isfinite(low) & (outlook.seen.log_d > np.log(_ZERO))
    strict = np.floor(np.minimum(ends, _until_curved(true, outlook.share)) / outlook.step)
    steps = np.clip(np.where(sinks, whole, strict), 0, left)
    # Whole blocks, so that a run can pause at the end of one.
    return np.where(steps < left, steps - steps % BLOCK, left), low, sinks


def _rescaled(outlook: _Outlook, low: Array, sinks: Array) -> Array:
    """s of the modes after a skip, shape (cells, 2): a mode that sinks gets the largest size allowed."""
    after = np.zeros_like(outlook.scales)
    s = np.where(sinks, np.maximum(outlook.most_rescaled - low, 0), 0)
    np.put_along_axis(after, (1 - outlook.growing)[:, None], s[:, None], 1)
    return after


def _until_of_use(outlook: _Outlook, now: Array, small: Array) -> Array:
    """Time until a look is of use, from the end of a skip where there is one `now`, shape (cells,).

    After a skip there is nothing to do until the growing mode has reversed the spin; likewise for a rattle that grows
    out of the linear range.  A rattle that decays into it is examined when it gets there.
    """
    seen, largest, rates = outlook.seen, outlook.largest, outlook.rattle.rates.real
    swings = np.where(seen.rate_g > 0, np.maximum(-np.where(now, largest, seen.log_g), 1) / seen.rate_g, np.inf)
    falls = np.where(rates < 0, (outlook.logs - largest[:, None]) / -rates, 0).max(axis=1)
    return np.asarray(np.where(small | (falls <= 0), swings, falls))


def _too_brief(outlook: _Outlook, skipped: Array, now: Array, after: Array) -> Array:
    """Return whether the run is too short for another look after `skipped` steps, and no factor is to be taken back."""
    rattle, left = outlook.rattle, outlook.left - skipped
    rates, turned = rattle.rates.real, 2 * rattle.slopes * outlook.spin[:, None]
    fastest = np.abs(np.stack([rates, rates - turned])).max(axis=(0, 2))
    over = _brief(fastest, outlook.share, outlook.logs.min(axis=1), left * outlook.step, left)
    return np.asarray(over & (after == 0).all(axis=1) & (now | (outlook.scales == 0).all(axis=1)))


def _sinks(true: _Modes, low: Array, largest: Array, share: Array, stirred: Array) -> Array:
    """Return whether the decaying mode, of size `low` after a skip, sinks to where round-off makes up a `share` of it.

    It does not count as sinking if what the other mode excites in it (`stirred`) comes near its lowest size: that would
    be divided by the same factor.  All arguments except `true` are logarithms.
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


def _until_clear(outlook: _Outlook) -> Array:
    """Time until neither products nor round-off of the other mode make up more than a `share` of the growing mode.

    A share δ shifts what the mode will do by δ divided by its rate in time, and so changes the spin by about δ n: hence
    δ = tolerance/n.  A mode that is about to leave the linear range cannot wait for that.  The result is of shape
    (cells,).
    """
    log_g, log_d, rate_g, rate_d = outlook.seen
    waits = []
    for allowed in (outlook.share, np.full_like(outlook.share, np.log(_AT_WORST))):
        hidden = (
            (np.log(_PRODUCTS) + 3 * log_d - log_g, rate_g - 3 * rate_d),
            (np.log(_ROUND_OFF) + log_d - log_g, rate_g - rate_d),
            (2 * log_d - np.log(4), -2 * rate_d),  # the other mode still changes the spin, and so the rate
        )
        each = [np.where(x > allowed, np.where(r > 0, (x - allowed) / r, np.inf), 0.0) for x, r in hidden]
        waits.append(np.max(each, axis=0))
    leaves = np.maximum((outlook.largest - np.log(3) - log_g) / rate_g, 0)
    # Where both modes decay the smaller one does not matter.
    return np.asarray(np.where(rate_g > 0, np.minimum(waits[0], np.maximum(waits[1], leaves)), 0.0))


def move(kernel: Kernel, rows: Array, rattle: Rattle, steps: Array, scales: Array) -> None:
    """Write to state rows the state after `steps` steps of a linear rattle, with its modes at new scales from then.

    Parameters
    ----------
    rattle : the rattles of the state rows
    steps : shape (cells,)
    scales : s of the modes, shape (cells, 2)
    """
    table = kernel.table(rows)
    time = steps * table["step"]
    with np.errstate(over="ignore", invalid="ignore"):
        factors = np.exp(rattle.rates * time[:, None] + scales - table.columns(SCALES))
    # An amplitude that is exactly zero remains so, even where a growing exponential overflows.
    factors[rattle.amplitudes == 0] = 1
    table.set_columns(SCALES, scales)
    table["done"] += steps
    after = factors * rattle.amplitudes
    table.set_columns(_RATTLE, table.columns(_RATTLE) + rattle.changes(factors, rattle.amplitudes))
    table["M3"] += rattle.turned(after) - rattle.turned(rattle.amplitudes)
    _move_history(table, rattle, factors)
    if kernel.work:
        _move_powers(rattle.form, table, kernel.unpack(rows)[1])
    spin, energy, inertia = kernel.model.energy(*kernel.unpack(rows))
    table["spin"] = spin
    before = table["energy"].copy()
    table["energy"] = energy + 0.5 * inertia * spin**2
    # Energies of the modes as the state holds them, because round-off acts on the state: a rescaled mode counts
    # with its factor.
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
    _, geometry = form.nonstiff(*y, constants)
    _, _, numerator, denominator = form.newton(*y[[0, 1, 5, 6]], geometry, 0.0, 0.0, 0.0, constants)
    for j, name in enumerate(POWERS):
        v1, v2 = (table[slip.format((-1 - j) % HISTORY)] for slip in SLIPS)
        table[name] = form.power(numerator / denominator, v1, v2, geometry, constants)
