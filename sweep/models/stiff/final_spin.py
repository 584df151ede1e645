"""What becomes of a small rattle that is left to itself: the slow equations.

A mode of energy E_k = I3 e_k / 2 grows at the rate r_k of the linear theory and changes the spin by (ndotab, abdot),

    e_k' = 2 r_k(n) e_k,   n' = -Σ s_k(n) e_k,

with r_k and s_k of the full model (`sweep.models.stiff.modes`) at five spins, and polynomials between them.  What this
neglects is of the order of `bending` times n² + Σ e_k, and grows where the two modes meet, as in nearly round bodies.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sweep.models.model import Array, take
from sweep.models.stiff.modes import Rattle, slow_rates
from sweep.models.stiff.slip import Constants
from sweep.models.theory.linear import NODES, through_nodes

# The fastest spin within reach, in units of the spin whose energy is there.
_REACH = 1.02

# Ratio of the difference of the two frequencies to the rates, below which the modes do not act each for itself: of
# settled cells of the wide domain above it, none was off by more than 1 % of the spin.
_APART = 5.0

# A step lasts half of what a mode takes to change by e, and turns the spin by no more than this share of what it can.
# A mode that turns the spin by less than a share `_FAINT` of what the other does sets no step.
_RATE, _TURN, _FAINT = 0.5, 0.02, 1e-4

# It is over when both modes decay, and can change the spin by no more than this share.  That takes 100 to 1000 steps.
_OVER, _MOST_STEPS = 1e-3, 5000


class Ending(NamedTuple):
    """How trajectories end; arrays of shape (cells,), NaN where the slow equations do not tell."""

    spin: Array
    """The spin that stays, in sqrt(g/c)."""
    reversals: Array
    """How often the spin reverses on the way."""
    overshoot: Array
    """Largest |spin| since the last reversal, or since the beginning."""
    nearest_approach: Array
    """Smallest |spin| after that."""


def ending(states: Array, constants: Constants) -> Ending:
    """How a small rattle ends; the spin is without its ripple.

    Parameters
    ----------
    states : of `stiff.slip`, shape (7, cells)
    """
    rattle = Rattle.of(states, constants)
    spin = -(states[4] - rattle.rippled(rattle.amplitudes)) / constants.I3
    e = np.abs(rattle.amplitudes) ** 2 * rattle.unit_energies
    reach = _REACH * np.sqrt(spin**2 + e.sum(axis=1))
    result = Ending(*np.full((4, len(spin)), np.nan))
    known = np.flatnonzero(rattle.sound & np.isfinite(reach) & (reach > 0))
    if not len(known):
        return result
    rates, slopes, apart = _fits(take(constants, known), reach[known])
    known = known[apart]
    unit = reach[known]
    found = _follow(spin[known] / unit, e[known] / unit[:, None] ** 2, rates[:, apart], slopes[:, apart], unit)
    for whole, part in zip(result, found, strict=True):
        whole[known] = part
    return result


def _fits(constants: Constants, reach: Array) -> tuple[Array, Array, Array]:
    """Coefficients of r_k and s_k, powers of n / `reach` first, and whether the modes are apart, shape (cells,)."""
    apart, nodes = np.ones(len(reach), bool), []
    for node in NODES:
        rates, slopes, sound = slow_rates(constants, node * reach)
        gap = np.abs(np.diff(rates.imag, axis=1))[:, 0]
        apart &= sound & (gap > _APART * np.abs(rates.real).max(axis=1))
        nodes.append((rates.real, slopes))
    fitted_rates, fitted_slopes = map(through_nodes, zip(*nodes, strict=True))
    return fitted_rates, fitted_slopes, apart


def _follow(spin: Array, e: Array, rates: Array, slopes: Array, reach: Array) -> Ending:
    """Follow the slow equations to their end; spins in units of `reach`, and e in its square."""
    slopes = slopes * reach[:, None]  # r' = s n' with n in units of reach
    log_e = np.log(np.maximum(e, 1e-300))
    result, found = Ending(*np.full((4, len(spin)), np.nan)), Ending(spin, np.zeros_like(spin), *np.abs([spin, spin]))
    left = np.arange(len(spin))
    for _ in range(_MOST_STEPS):
        r, s = _at(rates, spin), _at(slopes, spin)
        turns = np.abs(s) * np.exp(log_e)
        with np.errstate(divide="ignore", invalid="ignore"):
            rest = np.where(turns > 0, s * np.exp(log_e) / (2 * r), 0.0)
        over = (r < 0).all(axis=1) & (np.abs(rest).sum(axis=1) < _OVER * np.abs(spin))
        if over.any():
            ended = Ending(*(each[over] for each in found._replace(spin=(spin + rest.sum(axis=1)))))
            _account(ended, spin[over], ended.spin)
            for whole, part in zip(result, ended, strict=True):
                whole[left[over]] = part
            left, spin, log_e, r, s, turns = (each[~over] for each in (left, spin, log_e, r, s, turns))
            rates, slopes, found = rates[:, ~over], slopes[:, ~over], Ending(*(each[~over] for each in found))
        if not len(left):
            break
        step = _step(r, s, turns, log_e)
        middle, _ = _move(spin, log_e, r, s, step / 2)
        moved, log_e = _move(spin, log_e, _at(rates, middle), _at(slopes, middle), step)
        _account(found, spin, moved)
        spin = moved
    return Ending(result.spin * reach, result.reversals, result.overshoot * reach, result.nearest_approach * reach)


def _step(r: Array, s: Array, turns: Array, log_e: Array) -> Array:
    """Length of the next step, shape (cells,)."""
    rate, turn = np.abs(r), turns.sum(axis=1)
    way = np.exp(log_e / 2).sum(axis=1) + rate.min(axis=1) / np.maximum(np.abs(s).max(axis=1), 1e-300)
    fastest = np.where(turns > _FAINT * turn[:, None], rate, 0.0).max(axis=1)
    by_turn = _TURN * way / np.maximum(turn, 1e-300)
    return np.asarray(np.minimum(_RATE / np.maximum(fastest, 1e-300), by_turn))


def _account(found: Ending, before: Array, after: Array) -> None:
    """Take in a step, in place."""
    size, reverses = np.abs(after), before * after < 0
    further = reverses | (size >= found.overshoot)
    found.reversals[reverses] += 1
    found.overshoot[further] = size[further]
    nearer = further | (size < found.nearest_approach)
    found.nearest_approach[nearer] = size[nearer]


def _at(coefficients: Array, spin: Array) -> Array:
    """The polynomials at a spin in units of the reach, shape (cells, 2)."""
    value = np.zeros_like(coefficients[0])
    for each in coefficients[::-1]:
        value = value * spin[:, None] + each
    return np.asarray(value)


def _move(spin: Array, log_e: Array, r: Array, s: Array, step: Array) -> tuple[Array, Array]:
    """Spin and log e after a step in which the modes grow at constant rates."""
    growth = 2 * r * step[:, None]
    gained = step[:, None] * np.divide(np.expm1(growth), growth, out=np.ones_like(growth), where=growth != 0)
    return spin - (s * np.exp(log_e) * gained).sum(axis=1), log_e + growth
