"""The slow equations of a body: how its two rocking modes and its spin act on each other.

Spins and amplitudes are in units of the fastest spin within reach.  Let E be the modes at rest, with
|a_k|² = 2 E_k / J33 for the energy of an amplitude a_k.  The states are

    x = 2 Re E (a + Y a + w),   ω3 = -n + 2 Re Σ q_jk a_j a_k,                                               (1)

where Y has no part along the rocking modes, w is cubic in a and its conjugate, and the last sum is the ripple.  Then

    a' = (C + T[a a*]) a,   n' = Σ H_jk a_j a_k* + Q[a a* a a*]                                             (2)

up to terms of order |a|⁵ and |a|⁶.  With the Jacobian A of the full model at the spin n, A (1 + Y) = (1 + Y) C, so that
C has the exact rates.  The ripple and w follow from the condition that (1) obeys the full equations with (2): their
terms that do not turn with a mode, divided by their rates, which is exact at rest.  That the spin mixes the modes while
they turn is left out of these two: with it, as many counts of random bodies are right, and 1 % more of `mu_b` at
n0 = 0.1.  Unlike modes at n, all these are smooth functions of n where the two frequencies meet.  C and H are computed
at five spins, T and Q at three, with polynomials between them.

T and Q are fitted to the full equations at 48 points, which differ in the phases and shares of the two modes, at an
amplitude that a trajectory reaches, so that they hold the mean effect of higher orders there.  How they change with the
energy is measured at rest: T and Q are divided by 1 + κ |a|², with one κ for each.

A couple adds -d n to n', where d does not depend on the spin.  C and the ripple are those of a spin that stands still,
which leaves out terms of the order of d in units of a frequency.
"""

from __future__ import annotations

from collections import namedtuple

import numpy as np

from sweep.jit import called, inline
from sweep.models.model import Model
from sweep.models.slow.elementary import quotient, times
from sweep.models.theory.linear import FIT, NODES, through_nodes

# Products of a_1, a_2, a_1*, a_2*, by their exponents; each stands for its conjugate too.  `_MEAN` are the terms of H.
_LINEAR = np.array([(1, 0, 0, 0), (0, 1, 0, 0)])
_MEAN = np.array([(1, 0, 1, 0), (0, 1, 0, 1), (1, 0, 0, 1)])
SECOND = np.array([(2, 0, 0, 0), (1, 1, 0, 0), (0, 2, 0, 0)])
"""The ripple."""

THIRD = np.array([(2, 0, 1, 0), (2, 0, 0, 1), (1, 1, 1, 0), (1, 1, 0, 1), (0, 2, 1, 0), (0, 2, 0, 1),
                  (3, 0, 0, 0), (2, 1, 0, 0), (1, 2, 0, 0), (0, 3, 0, 0)])  # fmt: skip
RESONANT = 6
"""The first ones of `THIRD` turn as a_1 or a_2 do where the frequencies meet: they are the terms of T."""

_FOURTH = np.array([(2, 0, 2, 0), (1, 1, 1, 1), (0, 2, 0, 2), (2, 0, 1, 1), (1, 1, 0, 2), (2, 0, 0, 2),
                   *(each for each in np.ndindex(5, 5, 5, 5) if sum(each) == 4 and each[0] + each[1] > 2)])  # fmt: skip
"""The terms of Q, and all others of that order."""

LOWEST, HIGHER, TERMS = 7, 19, 25
"""The coefficients: C in rows, H_11, H_22 and H_12; then T in rows; then Q, of |a_1|⁴, |a_1 a_2|², |a_2|⁴,
|a_1|² a_1 a_2*, |a_2|² a_1 a_2* and (a_1 a_2*)²."""

# The spins, among the five `NODES`, at which T and Q are found: with five, the same share of counts is right.
_THREE = 3

# Amplitudes for the ripple, for w, for T and Q, and for κ.
_SIZES = np.array([1e-4, 0.1, 0.3, 0.9])
_RIPPLE, _CUBIC, _USUAL, _LARGE = range(4)

# Points where the equations are evaluated, by phases of both modes in eighths of a turn and by their shares of the
# energy: the first mode alone, the second alone, both alike, and both unlike, which only Q needs.  The second mode
# takes half a turn, because the equations are odd.  The points where both are alike are sorted: the first 16 points end
# with a coarse grid, which suffices for the ripple, and the first 24 with a checkerboard, which suffices for w.  For T
# and Q it does not: 70 % of counts of `mu_b` at n0 = 0.1 would be right, in place of 78.
_LINE, _COARSE = [(k, k) for k in range(4)], [(j, k) for j in range(0, 8, 2) for k in (0, 2)]
_TORUS = sorted(np.ndindex(8, 4), key=lambda phases: (phases not in _COARSE, sum(phases) % 2))
_PHASES = np.array([*_LINE, *_LINE, *_TORUS, *_COARSE])
_SHARES = np.repeat([(1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (0.8, 0.2)], [4, 4, 32, 8], axis=0)
_POINTS_OF_X, _POINTS_OF_SPIN = (0, 24, 40, 40), (16, 0, 48, 48)
"""The numbers of points for x' and for ω3' at each amplitude: multiples of eight, which vector instructions need."""
_POINTS = tuple(map(max, _POINTS_OF_X, _POINTS_OF_SPIN))


def _in_parts(columns: np.ndarray) -> np.ndarray:
    """Return complex columns as real and imaginary parts in turn."""
    return np.asarray(columns.view(float))


def _waves(products: np.ndarray, size: float) -> np.ndarray:
    """Return what real and imaginary parts of coefficients of products contribute to a real number at the points."""
    amplitudes = (size * np.sqrt(_SHARES))[:, None] ** (products[:, :2] + products[:, 2:])
    turns = np.exp(2j * np.pi / 8 * (_PHASES @ (products[:, :2] - products[:, 2:]).T))
    return _in_parts(2 * np.prod(amplitudes, axis=2) * turns.conj()).T.copy()


def _weights(products: np.ndarray, size: float, points: int, wanted: int) -> np.ndarray:
    """Return the weights that turn numbers at the first points into the coefficients of products that fit them best.

    `products` are all of one order; weights are returned for the first `wanted`.  They fit products of lower order too,
    because |a|² is the same at all points.
    """
    # a_1⁴ and a_2⁴ are real at all points: their imaginary parts have no weight.
    fit = np.linalg.pinv(_waves(products, size)[:, :points], rcond=1e-9)
    real = (products[:, :2] == products[:, 2:]).all(axis=1)  # its own conjugate, which counts once
    weights = np.zeros((len(_PHASES), 2 * wanted))
    weights[:points] = (fit * np.repeat(1 + real, 2))[:, : 2 * wanted]
    return weights


_WAVES = np.stack([_waves(np.concatenate([_LINEAR, THIRD]), size) for size in _SIZES])
_RIPPLES = np.stack([_waves(SECOND, size) for size in _SIZES])
_OF_X = np.stack([_weights(THIRD, size, points, 10) for size, points in zip(_SIZES, _POINTS_OF_X, strict=True)])
_OF_SPIN = -np.stack([
    _weights(_FOURTH if level else np.concatenate([_MEAN, SECOND]), _SIZES[level], _POINTS_OF_SPIN[level], 6)
    for level in range(4)
])  # fmt: skip

# The least difference of rates by which a term of w is divided, relative to a frequency.
_NEAR = 0.02

# The iterations for Y, and those for a, converge as powers of the spin in units of a frequency.  Those for Y end when
# they change Y by less than `_CLOSE`, and have failed if the last one changes it by more than `_FAR`.
_ITERATIONS, _CLOSE, _FAR = 24, 1e-13, 1e-6

_SLOPE = (NODES[:, None] ** np.maximum(np.arange(5) - 1, 0) * np.arange(5)) @ FIT
"""Takes values at `NODES` to the derivative there of the polynomial through them."""


@called
def _clear(matrix):
    """Set a matrix to zero.  Loops compile in a fifth of the time that Numba takes for expressions of arrays."""
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            matrix[i, j] = 0.0


@called
def _superpose(amplitudes, waves, total):
    """`total` = the sum of `_waves` with complex amplitudes."""
    for i in range(len(total)):
        total[i] = 0.0
    for k in range(len(amplitudes)):
        cos, sin, of_cos, of_sin = amplitudes[k].real, amplitudes[k].imag, waves[2 * k], waves[2 * k + 1]
        for i in range(len(total)):
            total[i] += cos * of_cos[i] + sin * of_sin[i]


@called
def _combine(weights, rows, total):
    """`total` = Σ weights_k rows_k, for as many columns as `total` has; the number of weights is a multiple of four."""
    for i in range(len(total)):
        total[i] = 0.0
    for k in range(0, len(weights), 4):  # one by one takes twice as long, because each sum waits for the one before it
        a, b, c, d = weights[k], weights[k + 1], weights[k + 2], weights[k + 3]
        of_a, of_b, of_c, of_d = rows[k], rows[k + 1], rows[k + 2], rows[k + 3]
        for i in range(len(total)):
            total[i] += (a * of_a[i] + b * of_b[i]) + (c * of_c[i] + d * of_d[i])


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
def _along_modes(inverse, parts, result):
    """`result` = E⁻¹ z, where `parts` has real and imaginary parts of z in turn, for as many rows as `result` has."""
    for i in range(result.shape[0]):
        for k in range(result.shape[1]):
            total = 0.0j
            for j in range(inverse.shape[1]):
                total += inverse[i, j] * complex(parts[j, 2 * k], parts[j, 2 * k + 1])
            result[i, k] = total


@called
def _separate_modes(A, Y, C):
    """Find Y, of shape (4, 2), and C for the Jacobian A in the modes at rest; return whether the iteration converged.

    It converges where A is nearly diagonal.
    """
    left = 1.0
    _clear(Y)
    for _ in range(_ITERATIONS):
        if left < _CLOSE:
            break
        left = 0.0
        for j in range(2):
            for i in range(2):
                C[i, j] = 0.0j
                for k in range(4):
                    C[i, j] += A[i, k + 2] * Y[k, j]
                C[i, j] += A[i, j]
        for j in range(2):
            for i in range(4):
                value = Y[i, 0] * C[0, j] + Y[i, 1] * C[1, j] - A[i + 2, j]
                for k in range(4):
                    value -= A[i + 2, k + 2] * Y[k, j]
                change = quotient(value, A[i + 2, i + 2] - C[j, j])
                left += abs(change.real) + abs(change.imag)
                Y[i, j] += change
    return left < _FAR


@inline
def _rate_of(powers, C):
    """Return the rate of a product of amplitudes, by the rates C_11 and C_22."""
    first, second = C[0, 0], C[1, 1]
    return powers[0] * first + powers[1] * second + powers[2] * np.conj(first) + powers[3] * np.conj(second)


@called
def _find_third(A, C, Y, f, w):
    """Find w with A w - w D = (1 + Y) T - f in its diagonal part, where D has the rates of the products.

    T is for the resonant terms along E, which w does not have.  All are in the modes at rest.
    """
    _clear(w)
    for m in range(len(THIRD)):
        for i in range(2 if m < RESONANT else 0, 6):
            rest, value = A[i, i] - _rate_of(THIRD[m], C), -f[i, m]
            for j in range(2 if m < RESONANT else 0):
                value += Y[i - 2, j] * f[j, m]
                rest -= Y[i - 2, j] * A[j, i]
            least, size = _NEAR * abs(A[1, 1]), abs(rest)
            w[i, m] = quotient(value, max(size, least) / size * rest)


@called
def _without_linear(share, linear, found):
    """Subtract from terms of third order what `_OF_X` leaves in them of the linear ones."""
    for k in range(len(found)):
        for m, i in ((0, 0), (3, 0), (2, 1), (5, 1)):
            found[k, m] -= share * linear[k, i]


Body = namedtuple("Body", "p reach")
"""The constants of a body, and the fastest spin within reach, which is the unit of spins and amplitudes."""

At = namedtuple("At", "n A C Y slope small linear q")
"""What is found at a spin n: the Jacobian A in the modes at rest, C and Y, the derivative of Y by the spin, E (1 + Y)
and (1 + Y) C, and the ripple q."""


def _make_equations(model: Model):
    """Compiled functions that evaluate the equations near upright spin: `damping`, `jacobian` and `evaluate`."""
    rhs, couples = model.rhs, bool(model.variant and model.variant.couples)

    @called
    def slopes_of(x, n, body, slopes):
        """Write the slopes at a spin n; rows of `x` and `slopes` are the rattle in the order of `RATTLE`, then ω3."""
        for i in range(x.shape[1]):
            state = x[0, i], x[1, i], x[2, i], x[3, i], (x[6, i] - n) * body.reach, x[4, i], x[5, i]
            rates, _ = rhs(state, body.p)
            slopes[0, i], slopes[1, i], slopes[2, i], slopes[3, i], turn, slopes[4, i], slopes[5, i] = rates
            slopes[6, i] = turn / body.reach

    @called
    def damping(n, body):
        """Return ω3' in upright spin, by couples alone."""
        rates, _ = rhs((0.0, 0.0, 0.0, 0.0, -n * body.reach, 0.0, 0.0), body.p)
        return rates[4] / body.reach if couples else 0.0

    @called
    def jacobian(n, body, E, inverse, A):
        """Find A in the modes at rest, from slopes of rattles along E so small that only linear terms are left."""
        # Twelve columns are used; sixteen are evaluated as fast, because eight at a time make a vector.
        x, slopes, tiny = np.zeros((7, 16)), np.empty((7, 16)), _SIZES[_RIPPLE] ** 2
        for i in range(6):
            for k in range(6):
                x[i, 2 * k], x[i, 2 * k + 1] = tiny * E[i, k].real, tiny * E[i, k].imag
        slopes_of(x, n, body, slopes)
        for i in range(6):
            for k in range(12):
                slopes[i, k] /= tiny
        _along_modes(inverse, slopes, A)

    @called
    def evaluate(level, n, body, shape, q, of_x, of_spin):
        """Evaluate the equations at an amplitude, and sum x' by `_OF_X` and ω3' by `_OF_SPIN`.

        `shape` is E (1 + Y + w) by states, or without w, of shape (6, 2).  The sums are real and imaginary parts in
        turn.
        """
        points, drag = _POINTS[level], damping(n, body)
        x, slopes = np.empty((7, points)), np.empty((7, points))
        for i in range(6):
            _superpose(shape[i], _WAVES[level], x[i])
        _superpose(q, _RIPPLES[level], x[6])
        slopes_of(x, n, body, slopes)
        for i in range(len(of_x)):
            _combine(slopes[i, : _POINTS_OF_X[level]], _OF_X[level], of_x[i])
        for i in range(points):
            slopes[6, i] -= drag
        _combine(slopes[6], _OF_SPIN[level], of_spin)

    return damping, jacobian, evaluate


def _make_linear_terms(evaluate):
    """Compiled (at, body, E, sums) -> None: finds C, H and the ripple, from A, Y and C."""

    @called
    def linear_terms(at, body, E, sums):
        n, _, C, Y, _, small, linear, q = at
        basis, of_spin = np.empty((6, 2), E.dtype), np.empty(12)
        _clear(basis)
        for i in range(2):
            basis[i, i], q[i], q[2] = 1.0, 0.0, 0.0
            for k in range(4):
                basis[k + 2, i] = Y[k, i]
        _product(E, basis, small)
        _product(basis, C, linear)
        evaluate(_RIPPLE, n, body, small, q, np.empty((0, 1)), of_spin)
        for k in range(4):
            sums[k] = C[k // 2, k % 2]
        for k in range(3):
            sums[4 + k], ripple = (
                complex(of_spin[2 * k], of_spin[2 * k + 1]),
                complex(of_spin[2 * k + 6], of_spin[2 * k + 7]),
            )
            q[k] = -quotient(ripple, _rate_of(SECOND[k], C))

    return linear_terms


def _make_higher_terms(evaluate):
    """Compiled functions: `find_shape`, which finds E (1 + Y + w), and `resonances`, which finds T and Q with it."""

    @called
    def find_shape(at, body, E, inverse, sums, shape):
        n, A, C, Y, slope, small, linear, q = at
        of_x, w, found = np.empty((6, 20)), np.empty((6, 10), E.dtype), np.empty((6, 10), E.dtype)
        evaluate(_CUBIC, n, body, small, q, of_x, np.empty(0))
        _along_modes(inverse, of_x, found)
        _without_linear(_SIZES[_CUBIC] ** -2, linear, found)
        for m in range(RESONANT):  # Y depends on the spin, which changes
            for i in range(2):
                if THIRD[m, i]:
                    j, other = 0 if THIRD[m, 0] > (i == 0) else 1, 0 if THIRD[m, 2] else 1
                    turn = sums[4 + j] if j == other else sums[6] if j == 0 else np.conj(sums[6])
                    for k in range(4):
                        found[k + 2, m] -= slope[k, i] * turn
        _find_third(A, C, Y, found, w)
        _product(E, w, found)
        for k in range(6):
            for m in range(12):
                shape[k, m] = small[k, m] if m < 2 else found[k, m - 2]

    @called
    def resonances(level, at, body, inverse, shape, sums):
        of_x, found = np.empty((6, 2 * RESONANT)), np.empty((2, RESONANT), inverse.dtype)
        of_spin, per = np.empty(12), _SIZES[level] ** -2
        evaluate(level, at.n, body, shape, at.q, of_x, of_spin)
        _along_modes(inverse, of_x, found)
        _without_linear(per, at.linear, found)
        for i in range(2):
            for m in range(RESONANT):
                sums[LOWEST + i * RESONANT + m] = found[i, m]
        for k in range(6):
            sums[HIGHER + k] = complex(of_spin[2 * k], of_spin[2 * k + 1])
        for k, h in ((0, 4), (1, 4), (1, 5), (2, 5), (3, 6), (4, 6)):  # `_OF_SPIN` leaves H in them
            sums[HIGHER + k] -= per * sums[h]

    return find_shape, resonances


def coefficients(sums: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return polynomials in the spin through what was found at the spins, and κ of T and of Q.

    The polynomials are of fourth degree for C and H, and of second degree for T and Q.

    Parameters
    ----------
    sums : what `make_exchange` finds, shape (cells, 6, TERMS)

    Returns
    -------
    Coefficients of the powers, shape (cells, 5, TERMS), and κ, shape (cells, 2).
    """
    at_nodes, large = np.moveaxis(sums[:, :5], 1, 0), sums[:, 5]
    table, bent = np.zeros_like(at_nodes), np.empty((len(sums), 2))
    table[:, :, :LOWEST] = through_nodes(at_nodes[:, :, :LOWEST])
    for k, terms in enumerate((slice(LOWEST, HIGHER), slice(HIGHER, TERMS))):
        usual, larger = ((np.abs(each[:, terms]) ** 2).sum(axis=1) for each in (sums[:, 0], large))
        with np.errstate(all="ignore"):  # the modes were not found
            ratio = np.sqrt(usual / larger)
            bent[:, k] = (ratio - 1) / (_SIZES[_LARGE] ** 2 - ratio * _SIZES[_USUAL] ** 2)
        straight = 1 + bent[:, k] * _SIZES[_USUAL] ** 2
        table[:_THREE, :, terms] = straight[:, None] * through_nodes(at_nodes[:_THREE, :, terms])
    return np.ascontiguousarray(np.moveaxis(table, 0, 1)), bent


def make_exchange(model: Model):
    """Compiled (body, E, E⁻¹, sums) -> (d, converged), which finds the terms of a body, and `begin`.

    E is in units of `reach`.  `sums`, of shape (6, TERMS), gets the terms at the five `NODES`, but T and Q only at
    three; and as a last row those at rest with T and Q at a large amplitude.  `converged` says whether the modes were
    found at all spins.
    """
    damping, jacobian, evaluate = _make_equations(model)
    linear_terms, (find_shape, resonances) = _make_linear_terms(evaluate), _make_higher_terms(evaluate)

    @called
    def exchange(body, E, inverse, sums):
        A, C, Y = np.empty((5, 6, 6), E.dtype), np.empty((5, 2, 2), E.dtype), np.empty((5, 4, 2), E.dtype)
        slope, q = np.empty((4, 2), E.dtype), np.empty(3, E.dtype)
        small, linear, shape = np.empty((6, 2), E.dtype), np.empty((6, 2), E.dtype), np.empty((6, 12), E.dtype)
        converged = True
        for k in range(5):
            jacobian(NODES[k], body, E, inverse, A[k])
            converged &= _separate_modes(A[k], Y[k], C[k])
        for k in range(5):
            at = At(NODES[k], A[k], C[k], Y[k], slope, small, linear, q)
            linear_terms(at, body, E, sums[k])
            if k < _THREE:
                _clear(slope)
                for m in range(5):
                    for i in range(4):
                        for j in range(2):
                            slope[i, j] += times(_SLOPE[k, m], Y[m, i, j])
                find_shape(at, body, E, inverse, sums[k], shape)
                resonances(_USUAL, at, body, inverse, shape, sums[k])
            if k == 0:
                for m in range(LOWEST):
                    sums[5, m] = sums[0, m]
                resonances(_LARGE, at, body, inverse, shape, sums[5])
        return damping(1.0, body), converged

    @called
    def begin(x, n, body, E, inverse):
        """Return the amplitudes a of a rattle x, the spin without the ripple, and `converged` at a spin n."""
        A, C, Y, q = (
            np.empty((6, 6), E.dtype),
            np.empty((2, 2), E.dtype),
            np.empty((4, 2), E.dtype),
            np.empty(3, E.dtype),
        )
        jacobian(n, body, E, inverse, A)
        converged = _separate_modes(A, Y, C)
        z1, z2 = 0.0j, 0.0j
        for k in range(6):
            z1, z2 = z1 + inverse[0, k] * x[k], z2 + inverse[1, k] * x[k]
        a1, a2 = z1, z2
        for _ in range(_ITERATIONS):  # a + Y* a* = z, where these rows of Y belong to the conjugates
            a1, a2 = z1 - np.conj(Y[0, 0] * a1 + Y[0, 1] * a2), z2 - np.conj(Y[1, 0] * a1 + Y[1, 1] * a2)
        at = At(n, A, C, Y, Y, np.empty((6, 2), E.dtype), np.empty((6, 2), E.dtype), q)
        linear_terms(at, body, E, np.empty(LOWEST, E.dtype))
        return a1, a2, n + 2.0 * (q[0] * a1 * a1 + q[1] * a1 * a2 + q[2] * a2 * a2).real, converged

    return exchange, begin
