"""Polynomials of many bodies at once: sums, products, and all their real roots.

The numbers of a body never depend on the other bodies.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import comb
from typing import Any

import numpy as np

from sweep.models.model import Array

# Two roots closer than this, as a share of the limit, count as none.
_CLOSE = 1e-13

# Newton's method ends when it moves a root by less than this share; a root is at least this share of the limit.
_FINE, _LEAST = 4e-15, 1e-12


class Polynomial:
    """A polynomial whose `coefficients`, lowest power first, have the shape (powers, cells)."""

    __array_ufunc__ = None  # an array leaves operations with a polynomial to this class

    def __init__(self, coefficients: Array) -> None:
        self.coefficients = coefficients

    def __add__(self, other: Any) -> Polynomial:
        one, two = sorted((self.coefficients, polynomial(other).coefficients), key=len)
        total = np.zeros((len(two), *np.broadcast_shapes(one.shape[1:], two.shape[1:])))
        total += two
        total[: len(one)] += one
        return Polynomial(total)

    def __mul__(self, other: Any) -> Polynomial:
        one, two = sorted((self.coefficients, polynomial(other).coefficients), key=len)
        if len(one) == 1:
            return Polynomial(one * two)
        product = np.zeros((len(one) + len(two) - 1, *np.broadcast_shapes(one.shape[1:], two.shape[1:])))
        for i, each in enumerate(one):
            product[i : i + len(two)] += each * two
        return Polynomial(product)

    def __sub__(self, other: Any) -> Any:
        return self + other * -1.0

    def __rsub__(self, other: Any) -> Any:
        return self * -1.0 + other

    def __neg__(self) -> Polynomial:
        return self * -1.0

    __radd__, __rmul__ = __add__, __mul__


def polynomial(value: Any) -> Polynomial:
    """Return a polynomial itself, or a number or an array over the cells as a constant polynomial."""
    return value if isinstance(value, Polynomial) else Polynomial(np.array(value, float, ndmin=2))


X = Polynomial(np.array([[0.0], [1.0]]))
"""The variable itself."""


def real_roots(coefficients: Array, limit: Array) -> tuple[Array, Array]:
    """Find all roots from zero to a limit of polynomials in one variable: the cell of each and itself, shape (roots,).

    The polynomial is written in Bernstein's form on an interval, whose coefficients change sign as often as there are
    roots within, or more often by an even number.  Where this does not say that there is one root or none, the interval
    is halved.

    Parameters
    ----------
    coefficients : lowest power first, shape (powers, cells)
    limit : shape (cells,)
    """
    degree = np.flatnonzero(coefficients.any(axis=1)).max(initial=1)
    scaled = coefficients[: degree + 1] * limit ** np.arange(degree + 1)[:, None]
    cells, low, high = map(np.concatenate, zip(*_isolated(scaled), strict=True))
    return cells, _root(scaled[:, cells], low, high) * limit[cells]


def _isolated(coefficients: Array) -> Iterator[tuple[Array, Array, Array]]:
    """Yield cells, and the ends of intervals within (0, 1), each of which contains one root; shape (roots,)."""
    degree, cells = len(coefficients) - 1, np.arange(coefficients.shape[1])
    bernstein = coefficients / np.array([comb(degree, i) for i in range(degree + 1)])[:, None]
    for k in range(1, degree + 1):
        for i in range(degree, k - 1, -1):
            bernstein[i] += bernstein[i - 1]
    low, width = np.zeros(len(cells)), 1.0
    while True:
        negative = np.signbit(bernstein)
        changes = (negative[1:] != negative[:-1]).sum(axis=0)
        yield cells[changes == 1], low[changes == 1], low[changes == 1] + width
        more = np.flatnonzero((changes > 1) & (width > _CLOSE))
        if not len(more):
            return
        cells, low, width, bernstein = np.tile(cells[more], 2), low[more], width / 2, bernstein[:, more]
        low, halves = np.concatenate([low, low + width]), np.empty((degree + 1, 2, len(more)))
        for k in range(degree + 1):
            halves[k, 0], halves[degree - k, 1] = bernstein[0], bernstein[-1]
            bernstein = (bernstein[1:] + bernstein[:-1]) / 2
        bernstein = halves.reshape(degree + 1, -1)


def _root(coefficients: Array, low: Array, high: Array) -> Array:
    """Find the root between `low` and `high` by Newton's method, or by halving where that leaves; shape (roots,)."""
    roots, which = np.empty(len(low)), np.arange(len(low))
    with np.errstate(all="ignore"):
        low = np.maximum(low, _LEAST)
        x = -coefficients[0] / coefficients[1]  # near zero it is almost straight
        x = np.where((x > low) & (x < high), x, np.sqrt(low * high))
        rises = values_and_slopes(coefficients, high)[0] > 0
        while len(which):
            value, slope = values_and_slopes(coefficients, x)
            beyond = (value > 0) == rises
            low, high = np.where(beyond, low, x), np.where(beyond, x, high)
            new = x - value / slope
            found = np.abs(new - x) <= _FINE * x
            new = np.where(found | ((new > low) & (new < high)), new, np.sqrt(low * high))
            found |= high - low <= _FINE * x
            roots[which[found]] = new[found]
            left = ~found
            which, coefficients, x = which[left], coefficients[:, left], new[left]
            low, high, rises = low[left], high[left], rises[left]
    return roots


def values_and_slopes(coefficients: Array, x: Array) -> tuple[Array, Array]:
    """Evaluate polynomials, lowest power first along a first axis, and their derivatives."""
    value, slope = coefficients[-1], np.zeros_like(x)
    for each in coefficients[-2::-1]:
        value, slope = value * x + each, slope * x + value
    return value, slope
