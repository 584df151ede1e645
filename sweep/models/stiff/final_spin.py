"""The spin at which a trajectory comes to rest: what the slow equations make of the rattle that is left.

A mode of energy E_k = I3 e_k / 2 decays at the rate r_k of the linear theory and changes the spin by (ndotab, abdot),

    e_k' = 2 r_k(n) e_k,   n' = -Σ s_k e_k,   r_k(n) = r_k + s_k (n - n_0),

with r_k and s_k of the full model at the spin n_0 from which it decays (`sweep.models.stiff.modes`).
"""

from __future__ import annotations

import numpy as np

from sweep.models.model import Array
from sweep.models.stiff.modes import Rattle, growth_rates
from sweep.models.stiff.slip import Constants

# The first step in units of the fastest decay, the ratio of a step to the one before, and the decay times of the
# slower mode after which nothing is left.
_FIRST, _RATIO, _LAST = 0.02, 1.05, 20.0


def resting_spin(states: Array, constants: Constants) -> Array:
    """The spin that is left when the rattle has decayed, in sqrt(g/c), shape (cells,).

    NaN where the rattle cannot be resolved into two modes, or does not decay at the present spin.

    Parameters
    ----------
    states : of `stiff.slip`, shape (7, cells), with a rattle small enough that it can only decay
    """
    rattle = Rattle.of(states, constants)
    decays = rattle.sound & (rattle.rates.real < 0).all(axis=1)
    result = np.full(len(decays), np.nan)
    if not decays.any():
        return result
    rattle = rattle.select(decays)
    start = -(states[4, decays] - rattle.rippled(rattle.amplitudes)) / rattle.constants.I3
    e = np.abs(rattle.amplitudes) ** 2 * rattle.unit_energies
    end = _decay(start, e, rattle, rattle.slopes)
    # Again, with the change of the rates on the way that the linear theory gives at both ends.
    there = growth_rates(rattle.constants, end)
    way = (end - start)[:, None]
    bends = np.divide(there - rattle.rates.real, way, out=rattle.slopes.copy(), where=np.abs(way) > 1e-9)
    result[decays] = _decay(start, e, rattle, bends)
    return result


def _decay(start: Array, e: Array, rattle: Rattle, bends: Array) -> Array:
    """The spin after the decay, if the rates change by `bends` with the spin; both e and `bends` are (cells, 2)."""
    rates, spin = rattle.rates.real, start
    slowest, fastest = np.abs(rates).min(axis=1), np.abs(rates).max(axis=1)
    # Each cell in steps of its own, so that the others do not matter.
    step, time = _FIRST / fastest, np.zeros_like(start)
    while (left := time < _LAST / slowest).any():
        # Exponentials of the rates at the middle of a step: stable however fast a mode decays.
        middle, _ = _move(spin, e, rates + bends * (spin - start)[:, None], rattle.slopes, step / 2)
        moved, after = _move(spin, e, rates + bends * (middle - start)[:, None], rattle.slopes, step)
        spin, e = np.where(left, moved, spin), np.where(left[:, None], after, e)
        time, step = time + step, step * _RATIO
    return spin


def _move(spin: Array, e: Array, rates: Array, slopes: Array, step: Array) -> tuple[Array, Array]:
    """Spin and e after a step in which the modes decay at constant `rates`."""
    growth = 2 * np.minimum(rates, 0.0) * step[:, None]
    gained = step[:, None] * np.divide(np.expm1(growth), growth, out=np.ones_like(growth), where=growth < 0)
    return spin - (slopes * e * gained).sum(axis=1), e * np.exp(growth)
