"""The slow equations of a body: how its two rocking modes and its spin act on each other.

Let E be the modes at rest, with |a_k|² = 2 E_k / J33 for the energy of an amplitude a_k.  The states are

    x = 2 Re E (a + Y a + w),   ω3 = -n + 2 Re Σ q_jk a_j a_k,                                               (1)

where Y has no part along the rocking modes, w is cubic in a and its conjugate, and the last sum is the ripple.  Then

    a' = (C + T[a a*]) a,   n' = Σ H_jk a_j a_k* + Q[a a* a a*]                                             (2)

up to terms of order |a|⁵ and |a|⁶.  With the Jacobian A of the full model at the spin n, A (1 + Y) = (1 + Y) C, so that
C has the exact rates.  The ripple and w follow from the condition that (1) obeys the full equations with (2): their
harmonics that do not turn with a mode, divided by their frequencies.  Unlike modes at n, all these are smooth functions
of n where the two frequencies meet.  C and H are computed at five spins, T and Q at three, with polynomials between
them.

The sums in T and Q are found by evaluating the full equations on a torus of phases, at amplitudes that a trajectory
reaches, so that they hold the mean effect of higher orders there.  How they change with the energy is measured at rest:
T and Q are divided by 1 + κ |a|², with one κ for each.

A couple adds -d n to n', where d does not depend on the spin.  C and the ripple then follow the spin as if it stood
still, which leaves out terms of the order of d in units of a frequency.
"""

from __future__ import annotations

import numpy as np

from sweep.jit import called
from sweep.models.model import Model
from sweep.models.slow.elementary import quotient, square
from sweep.models.stiff.modes import RATTLE
from sweep.models.theory.linear import NODES

# Products of a_1, a_2, a_1*, a_2*, by their exponents.
SECOND = np.array([(2, 0, 0, 0), (1, 1, 0, 0), (0, 2, 0, 0)])
THIRD = np.array([(2, 0, 1, 0), (2, 0, 0, 1), (1, 1, 1, 0), (1, 1, 0, 1), (0, 2, 1, 0), (0, 2, 0, 1),
                  (3, 0, 0, 0), (2, 1, 0, 0), (1, 2, 0, 0), (0, 3, 0, 0)])  # fmt: skip
RESONANT = 6
"""The first ones of `THIRD` turn as a_1 or a_2 do where the frequencies meet: they are the terms of T."""

# Distance in `THIRD` of resonant products that act on each other by a' = C a; the others act on their neighbours only.
_APART = 2

LOWEST, HIGHER, TERMS = 7, 19, 25
"""The coefficients: C in rows, H_11, H_22 and H_12; then T in rows; then Q, of |a_1|⁴, |a_1 a_2|², |a_2|⁴,
|a_1|² a_1 a_2*, |a_2|² a_1 a_2* and (a_1 a_2*)²."""

# The spins, among the five `NODES`, at which T and Q are found: with five, the same share of counts is right.
_THREE = 3

# Harmonics (of the first phase, of the second) of the products of third order, and of the spin's change.
_ODD = np.array([(1, 0), (2, -1), (0, 1), (1, 0), (-1, 2), (0, 1), (3, 0), (2, 1), (1, 2), (0, 3)])
_EVEN = np.array([(0, 0), (1, -1), (2, -2), (2, 0), (1, 1), (0, 2)])

# Phases of both modes on a torus, in eighths of a turn.  The second mode needs only half a turn, because the equations
# are odd.  The first four points serve the first mode alone; the last of these and the next three the second alone.
_PHASES, _FIRST, _SECOND = 8, 4, 7
_ALONE = [(3, 0), (2, 0), (1, 0), (0, 0), (0, 1), (0, 2), (0, 3)]
_PLACES = np.array([*_ALONE, *sorted({*np.ndindex(_PHASES, _PHASES // 2)} - {*_ALONE})])
_POINTS = len(_PLACES)


def _turns(harmonics: np.ndarray) -> np.ndarray:
    """exp(i phase) of harmonics at the points, shape (points, harmonics)."""
    return np.asarray(np.exp(2j * np.pi / _PHASES * (_PLACES @ harmonics.T)))


_ALL = np.concatenate([np.eye(2, 4, dtype=int), THIRD, SECOND])
_DEGREES = _ALL[:, :2] + _ALL[:, 2:]
_WAVES = _turns(_ALL[:, :2] - _ALL[:, 2:]).T.copy()
_COS, _SIN = _WAVES.real.copy(), _WAVES.imag.copy()
_ODD_TURNS, _EVEN_TURNS = (_turns(-each).view(float) for each in (_ODD, _EVEN))

# Amplitudes for the ripple, for w, for T and Q, and for κ, in units of the fastest spin within reach.
_TINY, _SMALL, _USUAL, _LARGE = 1e-4, 0.1, 0.3, 0.9

# The least difference of frequencies by which a term of w is divided, relative to a frequency.
_NEAR = 0.02

# The iterations for Y converge as powers of the spin in units of a frequency: until they change it by less than this.
_ITERATIONS, _CLOSE = 16, 1e-13


def _rows(products: np.ndarray) -> np.ndarray:
    """Rows (product, other, i, j, times): by a' = C a, the product changes by `times` C_ij times the other product.

    For i = 2 and 3 it is the conjugate of C_0j and C_1j.
    """
    place, rows = {tuple(each): k for k, each in enumerate(products.tolist())}, []
    for k, powers in enumerate(products.tolist()):
        for i in range(4):
            for j in range(2 * (powers[i] > 0)):
                other = [*powers]
                other[i] -= 1
                other[j + i // 2 * 2] += 1
                rows.append((k, place[tuple(other)], i, j, powers[i]))
    return np.array(rows)


_OF_SECOND, _OF_THIRD = _rows(SECOND), _rows(THIRD)
_FIT = np.linalg.inv(NODES[:, None] ** np.arange(len(NODES)))
_FIT_OF_THREE = np.linalg.inv(NODES[:_THREE, None] ** np.arange(_THREE))
_SLOPE = (NODES[:, None] ** np.maximum(np.arange(5) - 1, 0) * np.arange(5)) @ _FIT
"""Takes values at `NODES` to the derivative there of the polynomial through them."""


@called
def _clear(matrix):
    """Set a matrix to zero.  Loops compile in a fifth of the time that Numba takes for expressions of arrays."""
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            matrix[i, j] = 0.0


@called
def _add(size, m, first, last, series):
    """Add the real part of `size` times a product of unit amplitudes to a series over points."""
    part, cos, sin = series[first:last], _COS[m, first:last], _SIN[m, first:last]
    for i in range(len(part)):  # a loop that begins at `first` is not vectorised
        part[i] += size.real * cos[i] - size.imag * sin[i]


@called
def _resolve(series, turns, first, last, sums):
    """Sum a series over points times `turns`, of shape (points, 2 harmonics), for as many as `sums` has room for."""
    for m in range(len(sums)):
        sums[m] = 0.0
    for i in range(first, last):
        for m in range(len(sums)):
            sums[m] += series[i] * turns[i, m]


@called
def _product(A, B, result):
    """`result` = A B."""
    for i in range(A.shape[0]):
        for k in range(B.shape[1]):
            total = 0.0j
            for j in range(A.shape[1]):
                total += A[i, j] * B[j, k]
            result[i, k] = total


@called
def _solve(M, x, band, least):
    """Solve M x = b by elimination without pivots; b is in `x`, and both are overwritten.

    Elements farther from the diagonal than `band` are 0.  Where a pivot is smaller than `least`, it is made as large.
    """
    for k in range(len(x)):
        pivot = M[k, k] if square(M[k, k]) > least * least else least * M[k, k] / abs(M[k, k])
        M[k, k], last = pivot, min(k + 1 + band, len(x))
        row = M[k, k + 1 : last]
        for i in range(k + 1, last):
            share, other = quotient(M[i, k], pivot), M[i, k + 1 : last]
            for j in range(len(row)):
                other[j] -= share * row[j]
            x[i] -= share * x[k]
    for k in range(len(x) - 1, -1, -1):
        for j in range(k + 1, min(k + 1 + band, len(x))):
            x[k] -= M[k, j] * x[j]
        x[k] = quotient(x[k], M[k, k])


@called
def _minus(A, rate, M):
    """M = A - rate."""
    for i in range(len(M)):
        for j in range(len(M)):
            M[i, j] = A[i, j]
        M[i, i] -= rate


@called
def _derivation(rows, C, D):
    """The matrix D in m' = D m, for products m of amplitudes with a' = C a."""
    _clear(D)
    for product, other, i, j, times in rows:
        D[product, other] += times * (C[i, j] if i < 2 else np.conj(C[i - 2, j]))


@called
def _follow_modes(A, Y, C):
    """Find Y, of shape (4, 2), and C for the Jacobian A in the modes at rest."""
    M, x, left = np.empty((4, 4), A.dtype), np.empty(4, A.dtype), 1.0
    _clear(Y)
    for _ in range(_ITERATIONS):
        if left < _CLOSE:
            break
        left = 0.0
        _product(A[:2, 2:], Y, C)
        for j in range(2):
            C[0, j], C[1, j] = C[0, j] + A[0, j], C[1, j] + A[1, j]
        for j in range(2):
            _minus(A[2:, 2:], C[j, j], M)
            for i in range(4):
                x[i] = Y[i, 1 - j] * C[1 - j, j] - A[i + 2, j]
            _solve(M, x, 3, 0.0)
            for i in range(4):
                left += abs(x[i].real - Y[i, j].real) + abs(x[i].imag - Y[i, j].imag)
                Y[i, j] = x[i]


@called
def _solve_ripple(g, C, q):
    """Find the ripple q with q D = g, which is overwritten."""
    D, turned = np.empty((3, 3), q.dtype), np.empty((3, 3), q.dtype)
    _derivation(_OF_SECOND, C, D)
    for i in range(3):
        for j in range(3):
            turned[i, j] = D[j, i]
    _solve(turned, g, 2, 0.0)
    for i in range(3):
        q[i] = g[i]


@called
def _solve_third(A, C, Y, f, w):
    """Find w with A w - w D = (1 + Y) T - f, where T is for the resonant terms along E, which w does not have.

    All are in the modes at rest; f and w of shape (6, products).
    """
    count = w.shape[1]
    D, M, x = np.empty((count, count), w.dtype), np.empty((24, 24), w.dtype), np.empty(24, w.dtype)
    rest = np.empty((4, 4), w.dtype)
    _derivation(_OF_THIRD, C, D)
    _product(Y, A[:2, 2:], rest)
    for i in range(4):
        for k in range(4):
            rest[i, k] = A[i + 2, k + 2] - rest[i, k]
    _fill(rest, D[:RESONANT, :RESONANT], M)
    for m in range(RESONANT):
        for i in range(4):
            x[4 * m + i] = Y[i, 0] * f[0, m] + Y[i, 1] * f[1, m] - f[i + 2, m]
    least = _NEAR * abs(A[1, 1])
    _solve(M, x, 4 * _APART, least)
    _clear(w)
    for m in range(RESONANT):
        for i in range(4):
            w[i + 2, m] = x[4 * m + i]
    _fill(A, D[RESONANT:, RESONANT:], M)
    for m in range(count - RESONANT):
        for i in range(6):
            x[6 * m + i] = -f[i, RESONANT + m]
    _solve(M, x, 6, least)
    for m in range(count - RESONANT):
        for i in range(6):
            w[i, RESONANT + m] = x[6 * m + i]


@called
def _fill(A, D, M):
    """The matrix of w -> A w - w D, for w in columns."""
    height = len(A)
    _clear(M)
    for m in range(len(D)):
        for i in range(height):
            for k in range(height):
                M[height * m + i, height * m + k] += A[i, k]
            for k in range(len(D)):
                M[height * m + i, height * k + i] -= D[k, m]


def make_exchange(model: Model):
    """Compiled (p, E, E⁻¹, reach, table, bent) -> d, which writes the coefficients of a body, and `begin`.

    `table`, of shape (5, TERMS), gets those of the polynomials in n / `reach`, of fourth degree for C and H and of
    second degree for T and Q; and `bent` the two κ.
    """
    rhs, couples = model.rhs, bool(model.variant and model.variant.couples)

    @called
    def slowed(n, p):
        """ω3' in upright spin, by couples alone."""
        rates, _ = rhs((0.0, 0.0, 0.0, 0.0, -n, 0.0, 0.0), p)
        return rates[4]

    @called
    def jacobian(n, p, E, inverse, A):
        """A in the modes at rest.  The equations are odd in the rattle, so a tiny one gives it to the last digits."""
        by_state, by_mode, x = np.empty((6, 6), E.dtype), np.empty((6, 6), E.dtype), np.zeros(6)
        for j in range(6):
            x[j - 1], x[j] = 0.0, _TINY**2
            slopes, _ = rhs((x[0], x[1], x[2], x[3], -n, x[4], x[5]), p)
            for i, state in enumerate(RATTLE):
                by_state[i, j] = slopes[state] / _TINY**2
        _product(by_state, E, by_mode)
        _product(inverse, by_mode, A)

    @called
    def harmonics(sizes, n, p, shape, inverse, q, odd, even):
        """Harmonics of x' in the modes at rest (`_ODD`) and of ω3' (`_EVEN`), on the torus of amplitudes of `sizes`.

        `shape` is E (1 + Y + w) by states: of shape (6, 2) without w.  As many modes are resolved as `odd` has rows.
        """
        first, last = 0 if sizes[0] > 0.0 else _FIRST - 1, _SECOND if sizes[1] > 0.0 else _FIRST
        last = last if sizes[0] == 0.0 or sizes[1] == 0.0 else _POINTS
        x, slopes = np.zeros((7, _POINTS)), np.empty((7, _POINTS))
        drag = slowed(n, p) if couples else 0.0
        powers = np.ones((4, 2))
        for k in range(3):
            for m in range(2):
                powers[k + 1, m] = powers[k, m] * sizes[m]
        for m in range(shape.shape[1]):
            size = 2.0 * powers[_DEGREES[m, 0], 0] * powers[_DEGREES[m, 1], 1]
            for k, state in enumerate(RATTLE):
                _add(size * shape[k, m], m, first, last, x[state])
        for m in range(3):
            _add(2.0 * powers[2 - m, 0] * powers[m, 1] * q[m], 2 + len(THIRD) + m, first, last, x[4])
        for i in range(first, last):
            rates, _ = rhs((x[0, i], x[1, i], x[2, i], x[3, i], x[4, i] - n, x[5, i], x[6, i]), p)
            slopes[0, i], slopes[1, i], slopes[2, i], slopes[3, i], slopes[4, i], slopes[5, i], slopes[6, i] = rates
            slopes[4, i] -= drag
        share, waves = 1.0 / (last - first), np.empty(max(len(even), odd.shape[1]), inverse.dtype)
        sums = waves.view(np.float64)
        _clear(odd)
        _resolve(slopes[4], _EVEN_TURNS, first, last, sums[: 2 * len(even)])
        for m in range(len(even)):
            even[m] = share * waves[m]
        if len(odd):
            for j, state in enumerate(RATTLE):
                _resolve(slopes[state], _ODD_TURNS, first, last, sums[: 2 * odd.shape[1]])
                for k in range(len(odd)):
                    factor = share * inverse[k, j]
                    for m in range(odd.shape[1]):
                        odd[k, m] += factor * waves[m]

    @called
    def small_shape(E, Y, shape):
        """E (1 + Y): the shape of a small rattle."""
        basis = np.zeros((6, 2), E.dtype)
        for i in range(2):
            basis[i, i] = 1.0
            for k in range(4):
                basis[k + 2, i] = Y[k, i]
        _product(E, basis, shape)

    @called
    def ripple(size, n, p, shape, inverse, C, q, even):
        """The ripple q; `even` gets the harmonics of ω3' at two amplitudes of `size`."""
        none, g = np.empty((0, len(THIRD)), inverse.dtype), np.empty(3, inverse.dtype)
        for k in range(3):
            q[k] = 0.0
        harmonics((size, size), n, p, shape, inverse, q, none, even)
        for k in range(3):
            g[k] = even[k + 3] / size**2
        _solve_ripple(g, C, q)

    @called
    def cubes(size, n, p, shape, inverse, q, linear, found, sums):
        """Terms of third order of x' in `found`, of shape (modes, products), and Q in `sums`, at an amplitude."""
        odd, even = np.empty(found.shape, inverse.dtype), np.empty(len(_EVEN), inverse.dtype)
        cube, energy, modes = size**3, size * size, range(len(found))
        harmonics((size, 0.0), n, p, shape, inverse, q, odd, even)
        sums[19] = -(even[0] + sums[4] * energy) / energy**2
        for k in modes:
            found[k, 0] = (odd[k, 0] - size * linear[k, 0]) / cube
        harmonics((0.0, size), n, p, shape, inverse, q, odd, even)
        sums[21] = -(even[0] + sums[5] * energy) / energy**2
        for k in modes:
            found[k, 5] = (odd[k, 5] - size * linear[k, 1]) / cube
        size, cube, energy = np.sqrt(0.5) * size, np.sqrt(0.125) * cube, 0.5 * energy
        harmonics((size, size), n, p, shape, inverse, q, odd, even)
        for k in modes:
            first, second = found[k, 0], found[k, 5]
            for m in range(odd.shape[1]):
                found[k, m] = odd[k, m] / cube
            found[k, 0], found[k, 3] = first, found[k, 3] - size * linear[k, 0] / cube - first
            found[k, 5], found[k, 2] = second, found[k, 2] - size * linear[k, 1] / cube - second
        sums[20] = -(even[0] + (sums[4] + sums[5]) * energy) / energy**2 - sums[19] - sums[21]
        beats, sums[24] = -(even[1] + sums[6] * energy) / energy**2, -even[2] / energy**2
        harmonics((np.sqrt(1.6) * size, np.sqrt(0.4) * size), n, p, shape, inverse, q, odd, even)
        sums[22] = -((even[1] / (0.8 * energy) + sums[6]) / (2.0 * energy) + 0.2 * beats) / 0.6
        sums[23] = beats - sums[22]

    @called
    def linear_terms(n, reach, p, E, inverse, Y, C, small, q, sums):
        """C, H and the ripple at one spin; `small` gets E (1 + Y)."""
        none, even, tiny = np.empty((0, len(THIRD)), E.dtype), np.empty(len(_EVEN), E.dtype), _TINY * reach
        small_shape(E, Y, small)
        for i in range(2):
            for j in range(2):
                sums[2 * i + j] = C[i, j]
        harmonics((tiny, 0.0), n, p, small, inverse, q, none, even)
        sums[4] = -even[0] / tiny**2
        ripple(tiny, n, p, small, inverse, C, q, even)
        sums[5], sums[6] = -even[0] / tiny**2 - sums[4], -even[1] / tiny**2

    @called
    def higher_terms(n, reach, p, E, inverse, A, C, Y, slope, small, q, rest, bent, sums):
        """T and Q at one spin, and the κ at rest; `slope` is the derivative of Y by n."""
        linear, shape, squares = np.empty((6, 2), E.dtype), np.empty((6, 12), E.dtype), np.zeros((2, 2))
        w, found, large = np.empty((6, len(THIRD)), E.dtype), np.empty((6, len(THIRD)), E.dtype), sums.copy()
        resonant = np.empty((2, RESONANT), E.dtype)
        for i in range(2):
            for j in range(2):
                linear[i, j] = C[i, j]
            for k in range(6):
                shape[k, i] = small[k, i]
            for k in range(4):  # (1 + Y) C
                linear[k + 2, i] = Y[k, 0] * C[0, i] + Y[k, 1] * C[1, i]
        cubes(_SMALL * reach, n, p, small, inverse, q, linear, found, sums)
        for m in range(RESONANT):  # Y depends on the spin, which changes
            for i in range(2):
                if THIRD[m, i]:
                    j, other = 0 if THIRD[m, 0] > (i == 0) else 1, 0 if THIRD[m, 2] else 1
                    turn = sums[4 + j] if j == other else sums[6] if j == 0 else np.conj(sums[6])
                    for k in range(4):
                        found[k + 2, m] -= slope[k, i] * turn
        _solve_third(A, C, Y, found, w)
        _product(E, w, shape[:, 2:])
        cubes(_USUAL * reach, n, p, shape, inverse, q, linear, resonant, sums)
        for i in range(2):
            for m in range(RESONANT):
                sums[LOWEST + i * RESONANT + m] = resonant[i, m]
        if rest:
            cubes(_LARGE * reach, n, p, shape, inverse, q, linear, resonant, large)
            for i in range(2):
                for m in range(RESONANT):
                    large[LOWEST + i * RESONANT + m] = resonant[i, m]
            for k in range(LOWEST, TERMS):
                squares[0, k // HIGHER] += abs(sums[k]) ** 2
                squares[1, k // HIGHER] += abs(large[k]) ** 2
            for k in range(2):
                ratio = np.sqrt(squares[0, k] / squares[1, k])
                bent[k] = (ratio - 1.0) / (reach * reach * (_LARGE**2 - ratio * _USUAL**2))

    @called
    def exchange(p, E, inverse, reach, table, bent):
        A, C, Y = np.empty((5, 6, 6), E.dtype), np.empty((5, 2, 2), E.dtype), np.empty((5, 4, 2), E.dtype)
        sums, slope = np.empty((5, TERMS), E.dtype), np.empty((4, 2), E.dtype)
        small, q = np.empty((6, 2), E.dtype), np.zeros(3, E.dtype)
        for k in range(5):
            jacobian(NODES[k] * reach, p, E, inverse, A[k])
            _follow_modes(A[k], Y[k], C[k])
        for k in range(5):
            n = NODES[k] * reach
            linear_terms(n, reach, p, E, inverse, Y[k], C[k], small, q, sums[k])
            if k < _THREE:
                _clear(slope)
                for j in range(5):
                    for i in range(4):
                        for m in range(2):
                            slope[i, m] += _SLOPE[k, j] / reach * Y[j, i, m]
                higher_terms(n, reach, p, E, inverse, A[k], C[k], Y[k], slope, small, q, k == 0, bent, sums[k])
        _clear(table)
        for m in range(LOWEST):
            for k in range(5):
                for j in range(5):
                    table[k, m] += _FIT[k, j] * sums[j, m]
        for m in range(LOWEST, TERMS):
            straight = 1.0 + bent[m // HIGHER] * (_USUAL * reach) ** 2
            for k in range(_THREE):
                for j in range(_THREE):
                    table[k, m] += straight * _FIT_OF_THREE[k, j] * sums[j, m]
        return slowed(reach, p) / reach if couples else 0.0

    @called
    def begin(x, n, reach, p, E, inverse):
        """The amplitudes a of a rattle x, and the spin without the ripple, at ω3 = -n."""
        A, C, Y = np.empty((6, 6), E.dtype), np.empty((2, 2), E.dtype), np.empty((4, 2), E.dtype)
        small, q, even = np.empty((6, 2), E.dtype), np.zeros(3, E.dtype), np.empty(len(_EVEN), E.dtype)
        jacobian(n, p, E, inverse, A)
        _follow_modes(A, Y, C)
        z1, z2 = 0.0j, 0.0j
        for k in range(6):
            z1, z2 = z1 + inverse[0, k] * x[k], z2 + inverse[1, k] * x[k]
        a1, a2 = z1, z2
        for _ in range(_ITERATIONS):  # a + Y* a* = z, where these rows of Y belong to the conjugates
            a1, a2 = z1 - np.conj(Y[0, 0] * a1 + Y[0, 1] * a2), z2 - np.conj(Y[1, 0] * a1 + Y[1, 1] * a2)
        small_shape(E, Y, small)
        ripple(_TINY * reach, n, p, small, inverse, C, q, even)
        return a1, a2, n + 2.0 * (q[0] * a1 * a1 + q[1] * a1 * a2 + q[2] * a2 * a2).real

    return exchange, begin
