"""Follow the slow equations to their end, and count the reversals on the way.

Within a step the spin and the coefficients stay as they are in its middle.  The amplitudes then turn and grow as the
modes of a 2 × 2 matrix do, and their products, which drive the spin, are integrated exactly over the step.  So a step
may be long compared with the beat of the modes, unless the beat is slow enough for T to act on it.
"""

from __future__ import annotations

import numpy as np

from sweep.jit import called, inline
from sweep.models.slow.exchange import HIGHER, LOWEST, TERMS, quotient, square
from sweep.models.stiff.final_spin import lasts

# A step turns the spin by no more than this share of what a mode can.  The rates, whose derivative by the spin is about
# |H|, change the logarithm of an amplitude in a step by no more than `_CHANGE` compared with constant rates.
_TURN, _CHANGE = 0.04, 0.3

# The beat advances by no more than this phase in a step where its part in T changes the rates by more than a share
# `_ACTS` of its frequency.
_BEAT, _ACTS = 1.0, 0.1

# If the beat advances by more than this phase in a step, each mode keeps its own amplitude while the modes change with
# the spin. To resolve the old modes into the new ones would excite one by the other, which the motion does not do.
_APART_STEP = 3.0

# It is over when both modes decay and can change the spin by no more than this share; a couple slows the spin by no
# more than a share `_SLOWED` in a step.
_OVER, _MOST_STEPS, _SLOWED = 1e-3, 3000, 0.1

# The equations have failed if the spin exceeds what the energy allows by this factor.
_FAR = 3.0

# Eigenvalues differ by at least this share of the matrix; the squares of amplitudes may fall below the smallest number.
_APART, _TINY, _LONG = 1e-6, 1e-300, 1e12


@called
def _at(t, x, s):
    """The coefficients at a spin; t and s hold real and imaginary parts."""
    for k in range(2 * LOWEST):
        s[k] = (((t[4, k] * x + t[3, k]) * x + t[2, k]) * x + t[1, k]) * x + t[0, k]
    for k in range(2 * LOWEST, 2 * TERMS):
        s[k] = (t[2, k] * x + t[1, k]) * x + t[0, k]


@inline
def _rates(sums, by, e1, e2, beat):
    """C with T, divided by `by`, for products of the amplitudes: e_1, e_2 and `beat`, which is a_1 a_2*."""
    back = np.conj(beat)
    return (
        sums[0] + (sums[7] * e1 + sums[8] * beat + sums[10] * e2) / by,
        sums[1] + (sums[9] * e1 + sums[11] * back + sums[12] * e2) / by,
        sums[2] + (sums[13] * e1 + sums[14] * beat + sums[16] * e2) / by,
        sums[3] + (sums[15] * e1 + sums[17] * back + sums[18] * e2) / by,
    )


@inline
def _turning(sums, by, e1, e2, beat):
    """n' with Q, divided by `by`."""
    pairs = sums[19].real * e1 * e1 + sums[20].real * e1 * e2 + sums[21].real * e2 * e2
    pairs += 2.0 * ((sums[22] * e1 + sums[23] * e2 + sums[24] * beat) * beat).real
    return sums[4].real * e1 + sums[5].real * e2 + 2.0 * (sums[6] * beat).real + pairs / by


@called
def _modes(C):
    """Eigenvalues and eigenvectors of a 2 × 2 matrix, (λ_1, λ_2, (V_11, V_12, V_21, V_22))."""
    c11, c12, c21, c22 = C
    middle, half = 0.5 * (c11 + c22), 0.5 * (c11 - c22)
    root, scale = np.sqrt(half * half + c12 * c21), np.sqrt(square(c12) + square(c21) + square(half))
    root = root if square(root) > (_APART * scale) ** 2 else _APART * scale + 0j
    root = root if (half * np.conj(root)).real >= 0 else -root
    big = half + root
    norm1, norm2 = np.sqrt(square(big) + square(c21)) + _TINY, np.sqrt(square(big) + square(c12)) + _TINY
    return middle + root, middle - root, (big / norm1, -c12 / norm2, c21 / norm1, big / norm2)


@inline
def _turned(z1, z2, V, W, keep):
    """Amplitudes z of the modes V as those of the modes W; with `keep` = 0, each mode keeps to itself."""
    by = quotient(1.0, W[0] * W[3] - W[1] * W[2])
    first = z1 * (W[3] * V[0] - W[1] * V[2]) + keep * z2 * (W[3] * V[1] - W[1] * V[3])
    return by * first, by * (keep * z1 * (W[0] * V[2] - W[2] * V[0]) + z2 * (W[0] * V[3] - W[2] * V[1]))


@inline
def _until(way, turn, rate):
    """The time in which a mode of a rate turns the spin by `way`: longer than any step if it never does."""
    turned = 2.0 * rate * way / (turn + _TINY)
    if turned <= -1.0:
        return _LONG
    return way / (turn + way / _LONG) if abs(turned) < 1e-6 else np.log1p(turned) / (2.0 * rate)


@inline
def _mean(after, turn):
    """The mean over a step of an exponential that is 1 before it and `after` = exp(turn) at its end."""
    return 1.0 + 0.5 * turn if abs(turn.real) + abs(turn.imag) < 1e-6 else quotient(after - 1.0, turn)


@inline
def _products(e1, e2, cross, V):
    """|a_1|², |a_2|² and a_1 a_2*, from the same products of the amplitudes of the modes V."""
    first = square(V[0]) * e1 + square(V[1]) * e2 + 2.0 * (V[0] * np.conj(V[1]) * cross).real
    second = square(V[2]) * e1 + square(V[3]) * e2 + 2.0 * (V[2] * np.conj(V[3]) * cross).real
    beat = V[0] * np.conj(V[2]) * e1 + V[1] * np.conj(V[3]) * e2
    return first, second, beat + V[0] * np.conj(V[3]) * cross + V[1] * np.conj(V[2]) * np.conj(cross)


@inline
def _grown(step, rate1, rate2):
    """What modes grow by in a step, and how far the phase between them turns; their common phase drives nothing."""
    phase = step * (rate1.imag - rate2.imag)
    return np.exp(step * rate1.real), np.exp(step * rate2.real), complex(np.cos(phase), np.sin(phase))


@called
def _means(z1, z2, step, rate1, rate2, grown, V):
    """The means of |a_1|², |a_2|² and a_1 a_2* over a step in which modes of amplitudes z grow."""
    g1, g2, turned = grown
    e1 = square(z1) * _mean(g1 * g1, 2.0 * step * rate1.real)
    e2 = square(z2) * _mean(g2 * g2, 2.0 * step * rate2.real)
    return _products(e1, e2, z1 * np.conj(z2) * _mean(g1 * g2 * turned, step * (rate1 + np.conj(rate2))), V)


@called
def follow(a1, a2, n, table, bent, d, reach, size):
    """Follow the slow equations from (a_1, a_2, n).

    Parameters
    ----------
    table, bent, d, reach : the coefficients of `sweep.models.slow.exchange`
    size : factor of T and Q, 1 but for a test of how much depends on them

    Returns
    -------
    The number of reversals, and whether the equations describe the motion to its end.  Changes of sign are those of the
    spin without its beat, Re H_12 a_1 a_2* / (i ω_1 - i ω_2) at rest: the simulated count is of the ripple-free spin.
    """
    sums = np.empty(table.shape[1], table.dtype)
    parts, part = table.view(np.float64), sums.view(np.float64)
    strong = 0.0
    for k in range(LOWEST, HIGHER):
        strong += 0.5 * square(table[0, k])
    strong = size * np.sqrt(strong)
    far = table[0, 3].imag > 2.0 * table[0, 0].imag
    at_rest = 2.0 * table[0, 6].real / (1j * (table[0, 0] - table[0, 3]).imag)
    count, old, keep = 0, 0.0, 1.0
    z1, z2, V = a1, a2, (1.0 + 0j, 0j, 0j, 1.0 + 0j)
    for _ in range(_MOST_STEPS):
        e1, e2, beat = _products(square(z1), square(z2), keep * z1 * np.conj(z2), V)
        _at(parts, n / reach, part)
        rate1, rate2, W = _modes(_rates(sums, (1.0 + bent[0] * (e1 + e2)) / size, e1, e2, beat))
        z1, z2 = _turned(z1, z2, V, W, keep)
        V = W
        f1, f2, r1, r2, apart = square(z1), square(z2), rate1.real, rate2.real, abs(rate1.imag - rate2.imag)
        g1, g2, g12 = _turns(sums, V)
        beats = 2.0 * quotient(g12 * z1 * np.conj(z2), rate1 + np.conj(rate2)) if far else at_rest * beat
        new = n - beats.real
        count, old = count + (new * old < 0.0), new
        turn1, turn2, cross = abs(g1) * f1, abs(g2) * f2, 2.0 * np.sqrt(square(g12) * f1 * f2)
        beating = cross / np.sqrt(square(rate1 + np.conj(rate2)))
        left = 0.5 * turn1 / abs(r1) + 0.5 * turn2 / abs(r2) + beating
        lasting, others = lasts(n, (r1, r2), d, -g1 * f1 / (2.0 * r1 + d), -g2 * f2 / (2.0 * r2 + d))
        if r1 < 0.0 and r2 < 0.0 and others + beating < _OVER * lasting:
            return count, True
        way = _TURN * (np.sqrt(f1) + np.sqrt(f2) + min(abs(r1), abs(r2)) / max(abs(g1), abs(g2), _TINY))
        step = min(_until(way, turn1, r1), _until(way, turn2, r2))
        step = min(step, _until(way, cross / (1.0 + apart * step), 0.5 * (r1 + r2)))
        step = min(step, _CHANGE / (max(abs(g1), abs(g2)) * min(way, left) + _TINY), _SLOWED / (d + _TINY))
        acts = 2.0 * strong * np.sqrt(f1 * f2)
        if acts > _ACTS * apart:
            step = min(step, _BEAT / (apart + acts))
        keep = 0.0 if apart * step > _APART_STEP else 1.0
        grown = _grown(0.5 * step, rate1, rate2)
        e1, e2, beat = _means(z1, z2, 0.5 * step, rate1, rate2, grown, V)
        middle = n + 0.5 * step * _turning(sums, (1.0 + bent[1] * (e1 + e2)) / size, e1, e2, beat)
        middle *= np.exp(-0.5 * d * step)
        grown = (grown[0] * grown[0], grown[1] * grown[1], grown[2] * grown[2])
        e1, e2, beat = _means(z1, z2, step, rate1, rate2, grown, V)
        _at(parts, middle / reach, part)
        rate1, rate2, W = _modes(_rates(sums, (1.0 + bent[0] * (e1 + e2)) / size, e1, e2, beat))
        z1, z2 = _turned(z1, z2, V, W, keep)
        V = W
        grown = _grown(step, rate1, rate2)
        e1, e2, beat = _means(z1, z2, step, rate1, rate2, grown, V)
        n += step * _turning(sums, (1.0 + bent[1] * (e1 + e2)) / size, e1, e2, beat)
        n *= np.exp(-d * step)
        z1, z2 = z1 * grown[0], z2 * grown[1] * np.conj(grown[2])
        if not abs(n) < _FAR * reach:
            break
    return count, False


@called
def _turns(sums, V):
    """H in the modes V: of each, and of both."""
    h1, h2, h12 = sums[4].real, sums[5].real, sums[6]
    one = h1 * square(V[0]) + h2 * square(V[2]) + 2.0 * (h12 * V[0] * np.conj(V[2])).real
    other = h1 * square(V[1]) + h2 * square(V[3]) + 2.0 * (h12 * V[1] * np.conj(V[3])).real
    both = h1 * V[0] * np.conj(V[1]) + h2 * V[2] * np.conj(V[3])
    both += h12 * V[0] * np.conj(V[3]) + np.conj(h12) * V[2] * np.conj(V[1])
    return one, other, both
