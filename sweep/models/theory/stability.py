"""Find the spins at which the upright spin of a model is stable: all of them at once.

At constant spin n a small rattle z obeys z' = J(n) z.  Where it begins or ceases to grow, two eigenvalues of J cross
the imaginary axis as a pair, or one crosses it at zero.  All the spins where either may happen are roots of polynomials
in n, so no range is missed, however narrow it is.

Where the characteristic polynomial c0 + c1 λ + … + c6 λ⁶ of J is known as a polynomial in n too, they are the roots of
c0 and of a resultant.  By arithmetic of 60 digits, all of 201 ends of ranges of random bodies were right to 1e-9, and
all but six that the other way gives.  But for nearly round bodies whose two modes hardly differ the other way is right.

The Jacobian of any other model has to be quadratic in n, as rigid bodies have gyroscopic terms linear in their spin and
centrifugal ones quadratic in it.  Then J itself, or its second additive compound, whose eigenvalues are the sums of two
eigenvalues of J, is singular at these spins:

    (K0 + n K1 + n² K2) z = 0

holds for some z, for K the compound or J.  This is an eigenvalue problem for 1/n, which takes seven times as long.

A search outwards from the paper's n_c1, by factors of 1.7, missed the first change in 3 of 5932 searches (bodies with
a = 1.5 … 50, |δ| <= 0.5, μ = 0.1 … 5000) and took three times as long.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from sweep.models.model import Array, Columns, Model, stack, take
from sweep.models.theory.linear import growth_rate, jacobian
from sweep.models.theory.polynomials import Polynomial, X, polynomial, real_roots, values_and_slopes

SPIN_LIMIT = 10.0
"""Largest |spin| examined, in sqrt(g/c), fifty times the spin that a hand gives: upright spin that is stable up to
this limit is taken as stable at any spin."""

_NEAR_REST = 1e-8
"""A spin at which couples are as at rest, in sqrt(g/c)."""

_MARGIN = 1.5
"""Safety factor on the decay rate of the spin: growth rates are not quite linear in it."""

# Where two modes hardly differ, digits are lost in the resultant: below this share of its terms at rest too many.
_DIGITS = 1e-12

# Newton's method may move a spin by this share; further away it has found another one.
_NEAR = 1e-5

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
    """The share of the range about zero in which the rattle decays faster than a couple damps the spin."""

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
        constants, limits = take(constants, cells), limits[cells]
        ranges.share[cells] = _share_within(model, constants, unit[cells], -growth[cells])
        changes = _changes(model, constants, limits)
        below = ranges.low, ranges.below_high, ranges.below_low
        for sign, theirs in ((-1, below), (1, (ranges.high, ranges.above_low, ranges.above_high))):
            ends = _ends(model, constants, sign * changes, sign, limits)
            for values, end in zip(theirs, ends, strict=True):
                values[cells] = sign * end
    return ranges


def _share_within(model: Model, constants, unit: Array, decay: Array) -> Array:
    """Return the share of the range about zero within which the rattle decays faster than a couple damps the spin.

    By the averaged equations (ndotab, abdot), a mode of energy I3 e/2 changes as e' = -2 s (n_c - n) e, and the spin as
    n' = -s e - r n, where r is its decay rate by the couple.  Then q = sqrt(e)/n obeys q'/q = r - s n_c + s n (1 + q²).
    So sqrt(e) falls for ever faster than n, and cannot turn it, if n (1 + q²) < n_c (1 - r/(s n_c)), where s n_c is the
    `decay` rate of the rattle at rest.  The share is 1 without a couple.
    """
    upright = tuple(stack(model.upright(_NEAR_REST * unit)))
    slopes, _ = model.rhs(upright, constants)
    damping = -slopes[model.spin_state] / upright[model.spin_state]
    return np.asarray(np.where(damping > 0, np.clip(1 - _MARGIN * damping / decay, 0.0, 1.0), 1.0))


def _is_steady(model: Model, constants, spin: Array) -> Array:
    """Return whether upright `spin` is stable, so that no rattle arises by itself, shape (cells,)."""
    slopes, _ = model.rhs(tuple(stack(model.upright(spin))), constants)
    arising = np.abs(np.delete(stack(slopes), model.spin_state, axis=0)).max(axis=0)
    return np.asarray(arising <= 1e-12 * spin**2)


def _changes(model: Model, constants, limits: Array) -> Array:
    """Find all spins within limits at which stability may change, shape (cells, solutions): NaN in place of others."""
    others, found = np.arange(len(limits)), list[tuple[Array, Array]]()
    if model.characteristic:
        polynomials = [polynomial(each).coefficients for each in model.characteristic(X, constants)]
        resultant, rest = _resultant(polynomials), [each[0] for each in polynomials]
        sound = np.abs(resultant[0]) > _DIGITS * (rest[1] * rest[4] * rest[5]) ** 2
        others, known = np.flatnonzero(~sound), np.flatnonzero(sound)
        for sign in (1.0, -1.0):
            for each in (polynomials[0], resultant):
                cells, spins = real_roots((each * sign ** np.arange(len(each))[:, None])[:, known], limits[known])
                cells, spins = known[cells], sign * spins
                if each is resultant:
                    spins = _polished([each[:, cells] for each in polynomials], spins)
                found.append((cells, spins))
    if len(others):
        solutions = _by_matrices(*_polynomial(model, take(constants, others)))
        cells, place = np.nonzero(np.isfinite(solutions))
        found.append((others[cells], solutions[cells, place]))
    cells, spins = map(np.concatenate, zip(*found, strict=True))
    order = np.argsort(cells, kind="stable")
    cells, spins = cells[order], spins[order]
    place = np.arange(len(cells)) - np.searchsorted(cells, cells)
    changes = np.full((len(limits), place.max(initial=0) + 1), np.nan)
    changes[cells, place] = spins
    return changes


def _resultant(polynomials: Sequence[Array]) -> Array:
    """Return the polynomial in n that vanishes where λ and -λ are roots of one in λ, shape (powers of n, cells).

    With s = -λ² these obey c0 - c2 s + c4 s² - c6 s³ = 0 and c1 - c3 s + c5 s² = 0.
    """
    u, v, w = _eliminated(*map(Polynomial, polynomials))
    found: Polynomial = u * u - v * w
    return found.coefficients


def _eliminated(c0: Any, c1: Any, c2: Any, c3: Any, c4: Any, c5: Any, c6: Any) -> tuple[Any, Any, Any]:
    """Return u, v and w of u + v s = 0 and w + u s = 0, which follow from the equations of `_resultant`."""
    square, linear, constant = c5 * c4 - c6 * c3, c5 * c2 - c6 * c1, c5 * c0  # of the one of second degree in s
    return square * c1 - constant * c5, linear * c5 - square * c3, constant * c3 - linear * c1


@np.errstate(all="ignore")
def _polished(polynomials: Sequence[Array], spins: Array) -> Array:
    """Solve the equations of `_resultant` by two of Newton's steps, because the resultant loses digits, shape (roots,).

    The `polynomials` in n have the shape (powers, roots), one for each power of λ.
    """
    found, s = spins, None
    for _ in range(2):
        c, slope = zip(*(values_and_slopes(each, found) for each in polynomials), strict=True)
        if s is None:
            u, v, _ = _eliminated(*c)
            s = -u / v
        even, odd = c[0] - s * (c[2] - s * (c[4] - s * c[6])), c[1] - s * (c[3] - s * c[5])
        even_s, odd_s = s * (2 * c[4] - 3 * s * c[6]) - c[2], 2 * s * c[5] - c[3]
        even_n, odd_n = slope[0] - s * (slope[2] - s * slope[4]), slope[1] - s * slope[3]
        determinant = even_s * odd_n - even_n * odd_s
        s, found = s + (odd * even_n - even * odd_n) / determinant, found + (even * odd_s - odd * even_s) / determinant
    return np.where(np.abs(found / spins - 1) < _NEAR, found, spins)


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


def _by_matrices(*polynomial: Array) -> Array:
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
