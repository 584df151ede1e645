"""Find the spins at which the upright spin of a model is stable: all of them at once, by eigenvalues.

At constant spin n a small rattle z obeys z' = J(n) z, and J is a quadratic polynomial in n, as rigid bodies have
gyroscopic terms linear in their spin and centrifugal ones quadratic in it.  Where the rattle begins or ceases to grow,
two eigenvalues of J cross the imaginary axis as a pair, or one crosses it at zero.  So either the second additive
compound of J, whose eigenvalues are the sums of two eigenvalues of J, or J itself is singular there, and

    (K0 + n K1 + n² K2) z = 0

holds for some z, for K the compound or J.  This is an eigenvalue problem for 1/n.  Its real solutions are all the
spins where stability may change, so no range is missed, however narrow it is.

A search outwards from the paper's n_c1, by factors of 1.7, missed the first change in 3 of 5932 searches (bodies with
a = 1.5 … 50, |δ| <= 0.5, μ = 0.1 … 5000) and took three times as long.
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np

from sweep.models.model import Array, Columns, Model, stack, take
from sweep.models.theory.linear import growth_rate, jacobian

SPIN_LIMIT = 10.0
"""Largest |spin| examined, in sqrt(g/c), fifty times the spin that a hand gives: upright spin that is stable up to
this limit is taken as stable at any spin."""

_SLOW_SPIN = 1e-8
"""A spin at which couples are as at rest, in sqrt(g/c)."""

_MARGIN = 1.5
"""Safety factor on the decay rate of the spin: growth rates are not quite linear in it."""

# Without friction the growth rates are zero except for rounding.
DECAYS = -1e-13


def critical_spins(model: Model, columns: Columns) -> tuple[Array, Array]:
    """n_c1+ and n_c1- of the model itself: the ends of the range of spins about zero in which the rattle decays.

    Parameters and results are those of `stable_ranges`.
    """
    lower, upper, *_ = stable_ranges(model, columns)
    return upper, lower


class StableRanges(NamedTuple):
    """Ranges of spin in which the rattle decays: the one about zero, the next below it, and the next above it.

    Arrays of shape (cells,), in sqrt(g/c). An end is infinite where a range does not end within `SPIN_LIMIT`; NaN where
    there is no such range.
    """

    low: Array
    high: Array
    below_low: Array
    below_high: Array
    above_low: Array
    above_high: Array
    share: Array
    """The share of the range about zero in which the rattle decays faster than a couple slows the spin."""

    @classmethod
    def none(cls, cells: int) -> StableRanges:
        """Return the ranges of cells whose rattle decays at no spin, as far as known."""
        return cls(*np.full((len(cls._fields), cells), np.nan))


def stable_ranges(model: Model, columns: Columns) -> StableRanges:
    """Find the ranges of spin in which the rattle decays.

    Bodies have outer ranges where a fast spin detunes the two modes whose coupling feeds the rattle.

    Parameters
    ----------
    columns : physical parameters, each of shape (cells,)

    Returns
    -------
    The ranges; NaN for a body whose rattle does not decay at rest (no friction, or no dissipation in the model), or
    whose third axis is not an axis of inertia, so that it cannot spin upright.

    Raises
    ------
    ValueError
        if the Jacobian of the model is not quadratic in the spin.
    """
    constants, limits = model.constants.of(columns), SPIN_LIMIT * model.spin_unit(columns)
    rest = np.zeros_like(constants[0])
    ranges = StableRanges.none(len(rest))
    unit, growth = model.spin_unit(columns), growth_rate(model, constants, rest)
    cells = np.flatnonzero((growth < DECAYS) & _is_steady(model, constants, unit))
    if len(cells):
        constants = take(constants, cells)
        ranges.share[cells] = _share_within(model, constants, unit[cells], -growth[cells])
        changes = _possible_changes(*_polynomial(model, constants))
        below = ranges.low, ranges.below_high, ranges.below_low
        for sign, theirs in ((-1, below), (1, (ranges.high, ranges.above_low, ranges.above_high))):
            ends = _ends(model, constants, sign * changes, sign, limits[cells])
            for values, end in zip(theirs, ends, strict=True):
                values[cells] = sign * end
    return ranges


def _share_within(model: Model, constants, unit: Array, decay: Array) -> Array:
    """Return the share of the range about zero within which the rattle decays faster than a couple slows the spin.

    By the averaged equations (ndotab, abdot), a mode of energy I3 e/2 changes as e' = -2 s (n_c - n) e, and the spin as
    n' = -s e - r n, where r is its decay rate by the couple.  Then q = sqrt(e)/n obeys q'/q = r - s n_c + s n (1 + q²).
    So sqrt(e) falls for ever faster than n, and cannot turn it, if n (1 + q²) < n_c (1 - r/(s n_c)), where s n_c is the
    `decay` rate of the rattle at rest.  The share is 1 without a couple.
    """
    upright = tuple(stack(model.upright(_SLOW_SPIN * unit)))
    slopes, _ = model.rhs(upright, constants)
    slowing = -slopes[model.spin_state] / upright[model.spin_state]
    return np.asarray(np.where(slowing > 0, np.clip(1 - _MARGIN * slowing / decay, 0.0, 1.0), 1.0))


def _is_steady(model: Model, constants, spin: Array) -> Array:
    """Return whether upright `spin` is stable, so that no rattle arises by itself, shape (cells,)."""
    slopes, _ = model.rhs(tuple(stack(model.upright(spin))), constants)
    arising = np.abs(np.delete(stack(slopes), model.spin_state, axis=0)).max(axis=0)
    return np.asarray(arising <= 1e-12 * spin**2)


def _polynomial(model: Model, constants) -> tuple[Array, Array, Array]:
    """J0, J1, J2 of J(n) = J0 + n J1 + n² J2, each of shape (cells, m, m)."""
    one = np.ones_like(constants[0])
    at_rest, plus, minus = (jacobian(model, constants, spin * one) for spin in (0, 1, -1))
    J1, J2 = (plus - minus) / 2, (plus + minus - 2 * at_rest) / 2
    first = take(constants, slice(1))
    elsewhere = jacobian(model, first, np.full(1, 0.5))
    if not np.allclose((at_rest + J1 / 2 + J2 / 4)[:1], elsewhere, rtol=0, atol=1e-9 * np.abs(elsewhere).max()):
        raise ValueError(f"the {model.name} model: the Jacobian of the rattle is not quadratic in the spin")
    return at_rest, J1, J2


def _possible_changes(*polynomial: Array) -> Array:
    """All real n at which J(n) or its compound is singular, shape (cells, solutions): NaN in place of complex ones."""
    solutions = []
    for K0, K1, K2 in (polynomial, tuple(map(_compound, polynomial))):
        size = K0.shape[-1]
        companion = np.zeros((len(K0), 2 * size, 2 * size))
        companion[:, :size] = -np.linalg.solve(K0, np.concatenate([K1, K2], axis=-1))
        companion[:, size:, :size] = np.eye(size)
        inverse = np.linalg.eigvals(companion)
        with np.errstate(divide="ignore"):
            solutions.append(np.where(inverse.imag == 0, 1 / inverse.real, np.nan))
    return np.concatenate(solutions, axis=-1)


def _compound(J: Array) -> Array:
    """The second additive compound of J, shape (cells, m (m - 1) / 2, m (m - 1) / 2)."""
    pairs = np.array(list(combinations(range(J.shape[-1]), 2)))
    p, q = pairs.T[:, :, None]
    i, j = pairs.T[:, None, :]
    return np.asarray(J[:, p, i] * (q == j) - J[:, q, i] * (p == j) + J[:, q, j] * (p == i) - J[:, p, j] * (q == i))


def _ends(model: Model, constants, changes: Array, sign: int, limits: Array) -> tuple[Array, Array, Array]:
    """|spin| at the end of the range about zero, and at both ends of the next one, on the side of `sign`."""
    changes = np.sort(np.where((changes > 0) & (changes <= limits[:, None]), changes, np.inf), axis=-1)
    changes = np.append(changes, np.full((len(changes), 1), np.inf), axis=-1)
    # Whether the rattle grows between one change and the next.
    cells, place = np.nonzero(np.isfinite(changes))
    spins = (changes[cells, place] + np.minimum(changes[cells, place + 1], limits[cells])) / 2
    growth = np.full(changes.shape, np.nan)
    growth[cells, place] = growth_rate(model, take(constants, cells), sign * spins)

    def first(wanted: Array, beyond: Array) -> Array:
        """The first change to that state beyond a spin; infinite if there is none."""
        return np.asarray(np.where(wanted & (changes > beyond[:, None]), changes, np.inf).min(axis=-1))

    end = first(growth >= 0, np.zeros(len(changes)))
    near = first(growth < 0, end)
    far = first(growth >= 0, near)
    return end, np.where(np.isinf(near), np.nan, near), np.where(np.isinf(near), np.nan, far)
