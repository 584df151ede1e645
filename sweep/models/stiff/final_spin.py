"""The slow equations, which give the further course of a small rattle that is left to itself.

A mode of energy E_k = J33 e_k / 2 grows at the rate r_k of the linear theory and changes the spin by (ndotab, abdot),

    e_k' = 2 r_k(n) e_k,   n' = -Σ s_k(n) e_k,

with r_k and s_k of the full model (`sweep.models.stiff.modes`) at five spins, and polynomials between them.  A couple
adds -d n to n'.  The neglected terms are of the order of `bending` times n² + Σ e_k, and grow where the two modes meet,
as in nearly round bodies.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from sweep.jit import Cached, called, inline, serial
from sweep.models.model import Array, take
from sweep.models.stiff.form import StiffForm
from sweep.models.stiff.modes import Rattle, slow_rates, slowing
from sweep.models.theory.linear import NODES, through_nodes

# The fastest spin within reach, in units of the spin whose energy is there.
_REACH = 1.02

# Ratio of the difference of the two frequencies to the rates, below which the modes do not act independently: of
# settled cells of the wide domain above it, none was off by more than 1 % of the spin.
_APART = 5.0

# A step lasts half of what a mode takes to change by e, and turns the spin by no more than this share of what it can.
# A mode that turns the spin by less than a share `_FAINT` of what the other does sets no step.  A couple slows the spin
# by no more than a share `_SLOWED` in a step.
_RATE, _TURN, _FAINT, _SLOWED = 0.5, 0.02, 1e-4, 0.1

# Divides where there may be a zero.
_TINY = 1e-300

# It is over when both modes decay, and can change the spin by no more than this share.  With a couple, the spin is a
# sum of three decaying terms, its own and one of each mode: it is over when the slowest exceeds the others that much.
# That takes 100 to 1000 steps.
_OVER, _MOST_STEPS = 1e-3, 5000


class Ending(NamedTuple):
    """How trajectories end; arrays of shape (cells,), NaN where the slow equations do not apply."""

    spin: Array
    """The spin that remains, in sqrt(g/c); with a couple, the spin when it can no longer reverse."""
    reversals: Array
    """Number of reversals until then."""
    overshoot: Array
    """Largest |spin| since the last reversal, or since the beginning."""
    nearest_approach: Array
    """Smallest |spin| after that.  With a couple, which slows all spins, it is the smallest share that |spin| has in
    the sum of |spin| and of what both modes can still do to it, times the fastest spin within reach."""


def ending(form: StiffForm, states: Array, constants: Any) -> Ending:
    """Find how a small rattle ends; the spin is taken without its ripple.

    Parameters
    ----------
    states : of `form`, shape (7, cells)
    """
    rattle = Rattle.of(form, states, constants)
    spin = -(states[4] - rattle.rippled(rattle.amplitudes)) / constants.J33
    e = np.abs(rattle.amplitudes) ** 2 * rattle.unit_energies
    reach = _REACH * np.sqrt(spin**2 + e.sum(axis=1))
    result = Ending(*np.full((4, len(spin)), np.nan))
    known = np.flatnonzero(rattle.sound & np.isfinite(reach) & (reach > 0))
    if not len(known):
        return result
    theirs = take(constants, known)
    rates, slopes, apart = _fits(form, theirs, reach[known])
    upright = -theirs.J33 * reach[known]
    slowed = -slowing(form, upright, theirs) / upright
    known = known[apart]
    unit = reach[known]
    n, log_e = spin[known] / unit, np.log(np.maximum(e[known] / unit[:, None] ** 2, _TINY))
    found = np.empty((len(known), 4))
    compiled_following()(n, log_e, rates[apart], slopes[apart] * unit[:, None, None], slowed[apart], found)
    for whole, part, scale in zip(result, found.T, (unit, 1.0, unit, unit), strict=True):
        whole[known] = part * scale
    return result


def _fits(form: StiffForm, constants: Any, reach: Array) -> tuple[Array, Array, Array]:
    """Coefficients of r_k and s_k, shape (cells, powers of n / `reach`, 2), and whether the modes are apart."""
    cells = np.tile(np.arange(len(reach)), len(NODES))
    rates, slopes, sound = slow_rates(form, take(constants, cells), np.outer(NODES, reach).ravel())
    gap = np.abs(np.diff(rates.imag, axis=1))[:, 0]
    apart = (sound & (gap > _APART * np.abs(rates.real).max(axis=1))).reshape(len(NODES), -1).all(axis=0)
    nodes = (values.reshape(len(NODES), -1, 2) for values in (rates.real, slopes))
    fits = [np.ascontiguousarray(through_nodes(values).swapaxes(0, 1)) for values in nodes]
    return fits[0], fits[1], apart


@called
def _at(coefficients, n):
    """The polynomials of both modes at a spin."""
    first, second = 0.0, 0.0
    for k in range(len(coefficients) - 1, -1, -1):
        first, second = first * n + coefficients[k, 0], second * n + coefficients[k, 1]
    return first, second


@called
def _change(e, r, s, d, step):
    """How much a mode lowers the spin in a step in which it grows at a constant rate, before a couple slows both."""
    rate = 2.0 * r + d
    growth = rate * step
    return s * e * (step if growth == 0.0 else np.expm1(growth) / rate)


@inline
def lasts(n, r, d, left0, left1):
    """Sizes of the most slowly decaying term of the spin, and of the others together."""
    if d < min(-2.0 * r[0], -2.0 * r[1]):
        return abs(n), abs(left0) + abs(left1)
    rest = abs(n + left0 + left1)
    return (abs(left1), rest + abs(left0)) if r[1] > r[0] else (abs(left0), rest + abs(left1))


@called
def _step(r, s, d, e):
    """Length of the next step."""
    turn0, turn1 = abs(s[0]) * e[0], abs(s[1]) * e[1]
    turn, least = turn0 + turn1, _FAINT * (turn0 + turn1)
    way = np.sqrt(e[0]) + np.sqrt(e[1]) + min(abs(r[0]), abs(r[1])) / max(abs(s[0]), abs(s[1]), _TINY)
    fastest = max(abs(r[0]) if turn0 > least else 0.0, abs(r[1]) if turn1 > least else 0.0)
    by_turn: float = _TURN * way / max(turn, _TINY)
    return min(_RATE / max(fastest, _TINY), by_turn, _SLOWED / max(d, _TINY))


def _follow(spin: Array, log_e: Array, rates: Array, slopes: Array, slowing: Array, endings: Array) -> None:
    """Follow the slow equations to their end, which is written to `endings`, of shape (cells, 4): NaN without one.

    Spins are in units of the fastest within reach, and e in its square: its logarithm, because a mode may grow again
    from less than a number can be.  The coefficients are of shape (cells, 5, 2), and the rates d at which a couple
    slows the spin of shape (cells,).
    """
    for i in range(len(spin)):
        endings[i] = np.nan
        n, log0, log1, d = spin[i], log_e[i, 0], log_e[i, 1], slowing[i]
        reversals, overshoot, nearest = 0, abs(n), abs(n)
        for _ in range(_MOST_STEPS):
            r, s, e0, e1 = _at(rates[i], n), _at(slopes[i], n), np.exp(log0), np.exp(log1)
            left0 = s[0] * e0 / (2.0 * r[0] + d) if s[0] * e0 != 0.0 else 0.0
            left1 = s[1] * e1 / (2.0 * r[1] + d) if s[1] * e1 != 0.0 else 0.0
            lasting, others = lasts(n, r, d, left0, left1)
            over = (r[0] < 0.0) & (r[1] < 0.0) & (others < _OVER * lasting)
            if over:
                after = n + left0 + left1 if d == 0.0 else n
            else:
                step = _step(r, s, d, (e0, e1))
                half = 0.5 * step
                middle = n - _change(e0, r[0], s[0], d, half) - _change(e1, r[1], s[1], d, half)
                middle *= np.exp(-d * half)
                r, s = _at(rates[i], middle), _at(slopes[i], middle)
                after = n - _change(e0, r[0], s[0], d, step) - _change(e1, r[1], s[1], d, step)
                after *= np.exp(-d * step)
                log0, log1 = log0 + 2.0 * r[0] * step, log1 + 2.0 * r[1] * step
            size, reverses = abs(after), n * after < 0.0
            further = reverses | (size >= overshoot)
            reversals += reverses
            overshoot = size if further else overshoot
            if d > 0.0:
                size /= size + abs(s[0]) * e0 / (2.0 * abs(r[0]) + d) + abs(s[1]) * e1 / (2.0 * abs(r[1]) + d)
            nearest = size if further | (size < nearest) else nearest
            n = after
            if over:
                endings[i, 0], endings[i, 1], endings[i, 2], endings[i, 3] = n, reversals, overshoot, nearest
                break


@cache
def compiled_following() -> Cached:
    """`_follow`, compiled."""
    return serial(_follow, "(f8[::1], f8[:, ::1], f8[:, :, ::1], f8[:, :, ::1], f8[::1], f8[:, ::1])", "slow-equations")
