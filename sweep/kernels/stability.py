"""Finds the spins at which upright spin is stable, as `theory.stability` does, by a compiled search, for slip.

A rattle decays where the coefficients of its polynomial (`sweep.kernels.quartic`) fulfil the conditions of Routh and
Hurwitz,

    c3 > 0,  c1 > 0,  c0 > 0  and  c1 (c2 c3 - c1) - c3² c0 > 0.

The coefficients are smooth functions of the spin, which a polynomial through a few samples gives to rounding errors.
Changes of sign of the four functions above are looked for from zero spin outwards.  A body of which anything remains in
doubt is left to the eigenvalues: its slip may decay too slowly, the polynomial may not fit, or two changes may lie
close together.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from sweep.jit import Cached, called, compiled, on_all_threads, serial
from sweep.kernels.quartic import has_fast_slip, make_jacobian, quartic
from sweep.models.ladder import analytic
from sweep.models.model import Array, Columns, Model, stack
from sweep.models.theory import stability

# Samples of the coefficients, at Chebyshev points; the last two terms of their Chebyshev series must be below this
# share of the largest.
_NODES, _FITS = 13, 1e-10

# Points on each side of zero at which signs are looked at, at distances that grow with the square of their number.
_POINTS = 40

# Spins are looked at up to this, in sqrt(g/c), or up to twice the paper's n_c1 if that is more; and if rattles grow
# nowhere there, up to four times as far, and so on.
_USUAL, _BEYOND, _WIDENED, _WIDER = 0.12, 2.0, 3, 4.0

# Two changes may lie between points if a parabola through three of them comes this near to zero, relative to the
# sample in the middle.
_NEAR = 0.2

# Bodies that a thread takes at a time.
_PART = 128


def nearest_ranges(model: Model, columns: Columns) -> tuple[Array, Array]:
    """As `theory.stability.stable_ranges`, shape (6, bodies), and the |spin| up to which no range is missing.

    The range about zero is always found; of the ranges beyond it, those that begin within the |spin| in the second
    array, shape (bodies,), which is infinite where the eigenvalues were asked.
    """
    if not has_fast_slip(model):
        ranges = stability.stable_ranges(model, columns)
        return ranges, np.full(ranges.shape[1], np.inf)
    usual = _USUAL / np.sqrt(columns["c"])
    limits = [np.fmax(usual, _BEYOND * np.abs(n_c1)) for n_c1 in analytic.critical_spins(columns)]
    limits = np.minimum(np.stack(limits, axis=-1), stability.SPIN_LIMIT)
    rows = np.ascontiguousarray(stack(tuple(model.constants.of(columns))).T)
    ranges, search, series = np.empty((len(rows), 6)), compiled_search(model), _series()
    parts = [slice(begin, begin + _PART) for begin in range(0, len(rows), _PART)]
    on_all_threads(lambda part: search(rows[part], limits[part], *series, ranges[part]), parts)
    covered, doubtful = limits.min(axis=1), np.flatnonzero(np.isnan(ranges[:, 0]))
    if len(doubtful):
        theirs = {name: values[doubtful] for name, values in columns.items()}
        ranges[doubtful] = stability.stable_ranges(model, theirs).T
        covered[doubtful] = np.inf
    return ranges.T, covered


def compile_search(model: Model) -> None:
    """Compile the search for a model, or load it from disk."""
    compiled_search(model)(np.empty((0, len(model.constants._fields))), np.empty((0, 2)), *_series(), np.empty((0, 6)))


@cache
def _series() -> tuple[Array, Array, Array]:
    """Chebyshev points in [-1, 1], and matrices that turn values there into coefficients of powers, and of T_k."""
    points = np.polynomial.chebyshev.chebpts1(_NODES)
    chebyshev = np.linalg.inv(np.polynomial.chebyshev.chebvander(points, _NODES - 1))
    powers = np.stack([np.pad(np.polynomial.chebyshev.cheb2poly(np.eye(k + 1)[k]), (0, _NODES - 1 - k))
                       for k in range(_NODES)], axis=-1)  # fmt: skip
    return points, powers @ chebyshev, chebyshev


@called
def _functions(powers: Any, t: float, f: Any) -> None:
    """Write to f the four functions that are positive where the rattle decays; `powers` as `fit` writes them."""
    c0, c1, c2, c3 = 0.0, 0.0, 0.0, 0.0
    for k in range(len(powers) - 1, -1, -1):
        c0, c1, c2, c3 = c0 * t + powers[k, 0], c1 * t + powers[k, 1], c2 * t + powers[k, 2], c3 * t + powers[k, 3]
    f[0], f[1], f[2], f[3] = c0, c1, c3, c1 * (c2 * c3 - c1) - c3 * c3 * c0


@called
def _narrow(powers: Any, near: float, far: float, at_near: float, at_far: float, which: int) -> float:
    """The t between `near` and `far` at which function `which`, of opposite signs there, vanishes (Illinois)."""
    f, t = np.empty(4), near
    for _ in range(60):
        t = (near * at_far - far * at_near) / (at_far - at_near)
        if t in (near, far):
            break
        _functions(powers, t, f)
        if f[which] == 0.0:
            break
        if (f[which] > 0.0) == (at_far > 0.0):
            far, at_far, at_near = t, f[which], 0.5 * at_near
        else:
            near, at_near, at_far = t, f[which], 0.5 * at_far
    return t


@called
def _may_touch(x: Any, y: Any, which: int) -> Any:
    """Tell whether a parabola through three values of a function, all of one sign, comes near zero between them."""
    first = (y[1, which] - y[0, which]) / (x[1] - x[0])
    second = (y[2, which] - y[1, which]) / (x[2] - x[1])
    bend = (second - first) / (x[2] - x[0])
    if bend * y[1, which] <= 0.0:
        return False
    vertex = 0.5 * (x[0] + x[1] - first / bend)
    if (vertex - x[0]) * (vertex - x[2]) >= 0.0:
        return False
    lowest = y[0, which] + first * (vertex - x[0]) + bend * (vertex - x[0]) * (vertex - x[1])
    return lowest * y[1, which] <= _NEAR * y[1, which] * y[1, which]


@called
def _changes(powers: Any, zero: float, end: float, found: Any) -> int:
    """Write the first three changes between `zero`, the t of zero spin, and `end` to `found`.

    Returns which function vanishes at the first one, or -1 if anything is in doubt.
    """
    x, y = np.zeros(3), np.zeros((3, 4))
    n, stable, first = 0, True, 0
    found[:] = np.nan
    x[2] = zero
    _functions(powers, zero, y[2])
    if not y[2].min() > 0.0:
        return -1
    for k in range(1, _POINTS + 1):
        x[0], x[1], x[2] = x[1], x[2], zero + (end - zero) * (k / _POINTS) ** 2
        y[0], y[1] = y[1], y[2]
        _functions(powers, x[2], y[2])
        differ, which = 0, 0
        for i in range(4):
            if (y[1, i] > 0.0) != (y[2, i] > 0.0):
                differ, which = differ + 1, i
            elif k > 1 and (y[0, i] > 0.0) == (y[1, i] > 0.0) and _may_touch(x, y, i):
                return -1
        # Two functions that change at once may do so in either order; one that changes while another is negative
        # makes no difference.
        if differ > 1:
            return -1
        if differ == 1 and (y[2].min() > 0.0) != stable:
            stable = not stable
            found[n] = _narrow(powers, x[1], x[2], y[1, which], y[2, which], which)
            first = which if n == 0 else first
            n += 1
            if n == len(found):
                break
    return first


@called
def _sample(polynomial: Any, spin: float, X: Any, c: Any) -> Any:
    """As `quartic`, at a spin."""
    J = np.empty((6, 6))
    for i in range(6):
        for j in range(6):
            J[i, j] = polynomial[0, i, j] + spin * (polynomial[1, i, j] + spin * polynomial[2, i, j])
    return quartic(J, X, c)


@called
def _fit(polynomial: Any, low: float, high: float, series: Any, powers: Any) -> Any:
    """Write c0 … c3 as polynomials in t to `powers`, where t = -1 … 1 is the spin from `low` to `high`.

    False if the slip is not fast or the polynomials do not fit.
    """
    points, to_powers, to_chebyshev = series
    X, before, c = np.zeros((2, 4)), np.zeros((2, 4)), np.empty((_NODES, 4))
    for k in range(_NODES):
        if k > 1:  # extrapolate X: that saves a third of the rounds
            ahead = (points[k] - points[k - 1]) / (points[k - 1] - points[k - 2])
            for i in range(2):
                for j in range(4):
                    X[i, j], before[i, j] = X[i, j] + ahead * (X[i, j] - before[i, j]), X[i, j]
        elif k == 1:
            before[:] = X
        if not _sample(polynomial, 0.5 * (low + high) + 0.5 * (high - low) * points[k], X, c[k]):
            return False
    for i in range(4):
        largest, last = 0.0, 0.0
        for k in range(_NODES):
            power, term = 0.0, 0.0
            for j in range(_NODES):
                power, term = power + to_powers[k, j] * c[j, i], term + to_chebyshev[k, j] * c[j, i]
            powers[k, i] = power
            largest, last = max(largest, abs(term)), max(last, abs(term)) if k >= _NODES - 2 else 0.0
        if last > _FITS * largest:
            return False
    return True


@called
def _polish(polynomial: Any, low: float, high: float, powers: Any, t: float, which: int) -> float:
    """The spin at which function `which` vanishes, from the t at which its polynomial does: two steps of Newton."""
    half = 0.5 * (high - low)
    X, c, f = np.zeros((2, 4)), np.empty((1, 4)), np.empty((2, 4))
    _functions(powers, t - 1e-5, f[0])
    _functions(powers, t + 1e-5, f[1])
    slope, spin = (f[1, which] - f[0, which]) / (2e-5 * half), 0.5 * (low + high) + half * t
    for _ in range(2):
        _sample(polynomial, spin, X, c[0])
        _functions(c, 0.0, f[0])
        spin -= f[0, which] / slope
    return spin


@cache
def compiled_search(model: Model) -> Cached:
    """Compiled (rows, limits, points, to_powers, to_chebyshev, ranges) -> None: NaN for a body that remains in doubt.

    rows : constants, shape (bodies, constants)
    limits : |spin| up to which to look on the positive and on the negative side, shape (bodies, 2)
    ranges : shape (bodies, 6)
    """
    jacobian = make_jacobian(model)

    @compiled
    def expand(rows: Any, body: int, polynomial: Any) -> None:
        """Write J0, J1 and J2 of J = J0 + n J1 + n² J2."""
        for k in range(3):
            jacobian(rows, body, (0.0, 1.0, -1.0)[k], polynomial[k])
        for i in range(6):
            for j in range(6):
                plus, minus = polynomial[1, i, j], polynomial[2, i, j]
                polynomial[1, i, j] = 0.5 * (plus - minus)
                polynomial[2, i, j] = 0.5 * (plus + minus) - polynomial[0, i, j]

    def search(rows: Any, limits: Any, points: Any, to_powers: Any, to_chebyshev: Any, ranges: Any) -> None:
        polynomial, powers, found = np.empty((3, 6, 6)), np.empty((_NODES, 4)), np.empty((2, 3))
        for body in range(len(rows)):
            ranges[body] = np.nan
            expand(rows, body, polynomial)
            high, low = limits[body, 0], -limits[body, 1]
            for _ in range(_WIDENED + 1):
                if not _fit(polynomial, low, high, (points, to_powers, to_chebyshev), powers):
                    break
                zero = -(high + low) / (high - low)
                above, below = _changes(powers, zero, 1.0, found[0]), _changes(powers, zero, -1.0, found[1])
                if above < 0 or below < 0:
                    break
                if not np.isnan(found[0, 0] + found[1, 0]):
                    ranges[body, 0] = _polish(polynomial, low, high, powers, found[1, 0], below)
                    ranges[body, 1] = _polish(polynomial, low, high, powers, found[0, 0], above)
                    half, middle = 0.5 * (high - low), 0.5 * (high + low)
                    # A range that does not end where it is looked for goes on.
                    if not np.isnan(found[1, 1]):
                        ranges[body, 2] = -np.inf if np.isnan(found[1, 2]) else middle + half * found[1, 2]
                        ranges[body, 3] = middle + half * found[1, 1]
                    if not np.isnan(found[0, 1]):
                        ranges[body, 4] = middle + half * found[0, 1]
                        ranges[body, 5] = np.inf if np.isnan(found[0, 2]) else middle + half * found[0, 2]
                    break
                high *= _WIDER if np.isnan(found[0, 0]) else 1.0
                low *= _WIDER if np.isnan(found[1, 0]) else 1.0

    return serial(search, f"stability-{model.name}")
