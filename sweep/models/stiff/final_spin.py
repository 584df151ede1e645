"""The spin at which a body stays: what the slow equations make of the rattle that is left.

A mode of energy E_k = I3 e_k / 2 grows at the rate r_k of the linear theory and changes the spin by (ndotab, abdot),

    e_k' = 2 r_k(n) e_k,   n' = -Σ s_k e_k,   r_k(n) = r_k + s_k (n - n_0),

with r_k and s_k of the full model at the spin n_0 of the start (`sweep.models.stiff.modes`).  Most rattles decay.
Beyond n_c1 one mode grows at first, until it has turned the spin back to where both decay.
"""

from __future__ import annotations

import numpy as np

from sweep.models.model import Array
from sweep.models.stiff.modes import Rattle, growth_rates
from sweep.models.stiff.slip import Constants

# The first step in units of the fastest decay, the ratio of a step to the one before, and the decay times of the
# slower mode after which nothing is left.
_FIRST, _RATIO, _LAST = 0.02, 1.05, 20.0

# While a mode grows, a step turns the spin by this share of its distance from where the mode decays.  The mode has
# turned the spin when it decays at this share of the rate at which it grew.  That takes 100 to 300 steps.
_TURN, _TURNED, _MOST_STEPS = 0.02, 0.1, 2000


def resting_spin(states: Array, constants: Constants) -> Array:
    """The spin that is left when the rattle has decayed, in sqrt(g/c), shape (cells,).

    NaN where the rattle cannot be resolved into two modes, or grows without turning the spin back.

    Parameters
    ----------
    states : of `stiff.slip`, shape (7, cells), with a rattle so small that the spin can reverse no more
    """
    rattle = Rattle.of(states, constants)
    sound = rattle.sound
    result = np.full(len(sound), np.nan)
    if not sound.any():
        return result
    rattle = rattle.select(sound)
    start = -(states[4, sound] - rattle.rippled(rattle.amplitudes)) / rattle.constants.I3
    end = _end(start, rattle, rattle.slopes)
    # Again, with the change of the rates on the way that the linear theory gives at both ends.
    known = np.isfinite(end)
    there = growth_rates(rattle.constants, np.where(known, end, start))
    way = np.where(known, end - start, 0.0)[:, None]
    bends = np.divide(there - rattle.rates.real, way, out=rattle.slopes.copy(), where=np.abs(way) > 1e-9)
    result[sound] = _end(start, rattle, bends)
    return result


def _end(start: Array, rattle: Rattle, bends: Array) -> Array:
    """The spin that is left, if the rates change by `bends` with the spin; these are (cells, 2)."""
    e = np.abs(rattle.amplitudes) ** 2 * rattle.unit_energies
    return _decay(*_turn_back(start, e, rattle, bends), start, rattle, bends)


def _turn_back(start: Array, e: Array, rattle: Rattle, bends: Array) -> tuple[Array, Array]:
    """Spin and e where no mode grows any more; the spin is NaN if it never gets there."""
    spin, slopes = start, rattle.slopes
    growth = rattle.rates.real.max(axis=1)
    way = np.abs(growth) / np.maximum(np.abs(slopes).max(axis=1), 1e-300) + np.sqrt(e.sum(axis=1))
    for _ in range(_MOST_STEPS):
        rates = rattle.rates.real + bends * (spin - start)[:, None]
        grows = (growth >= 0) & (rates.max(axis=1) >= -_TURNED * growth)
        if not grows.any():
            break
        turn = np.maximum(np.abs(slopes * e).sum(axis=1), 1e-300)
        step = np.minimum(1 / np.abs(rates).max(axis=1), _TURN * way / turn)
        middle, _ = _move(spin, e, rates, slopes, step / 2)
        moved, after = _move(spin, e, rates + bends * (middle - spin)[:, None], slopes, step)
        spin, e = np.where(grows, moved, spin), np.where(grows[:, None], after, e)
    return np.where(grows, np.nan, spin), e


def _decay(spin: Array, e: Array, start: Array, rattle: Rattle, bends: Array) -> Array:
    """The spin after the decay that begins at `spin`; both e and `bends` are (cells, 2)."""
    rates = rattle.rates.real + bends * (spin - start)[:, None]
    begin, slowest, fastest = spin, np.abs(rates).min(axis=1), np.abs(rates).max(axis=1)
    # Each cell in steps of its own, so that the others do not matter.
    step, time = _FIRST / fastest, np.zeros_like(start)
    while (left := time < _LAST / slowest).any():
        # Exponentials of the rates at the middle of a step: stable however fast a mode decays.
        decay = np.minimum(rates + bends * (spin - begin)[:, None], 0.0)
        middle, _ = _move(spin, e, decay, rattle.slopes, step / 2)
        decay = np.minimum(rates + bends * (middle - begin)[:, None], 0.0)
        moved, after = _move(spin, e, decay, rattle.slopes, step)
        spin, e = np.where(left, moved, spin), np.where(left[:, None], after, e)
        time, step = time + step, step * _RATIO
    return spin


def _move(spin: Array, e: Array, rates: Array, slopes: Array, step: Array) -> tuple[Array, Array]:
    """Spin and e after a step in which the modes grow at constant `rates`."""
    growth = 2 * rates * step[:, None]
    gained = step[:, None] * np.divide(np.expm1(growth), growth, out=np.ones_like(growth), where=growth != 0)
    return spin - (slopes * e * gained).sum(axis=1), e * np.exp(growth)
