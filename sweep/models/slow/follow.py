"""Follow the slow equations to their end, and count the reversals on the way.

Within a step the spin and the coefficients stay as they are in its middle.  The amplitudes then turn and grow as the
modes of a 2 × 2 matrix do, and their products, which drive the spin, are integrated exactly over the step.  So a step
may be long compared with the beat of the modes, unless the beat is slow enough for T to act on it.

Trajectories run side by side in lanes, whose steps are vector instructions.  A lane whose trajectory has ended is
computed with the others until another trajectory takes its place.
"""

from __future__ import annotations

import numpy as np

from sweep.jit import INTERPRETED, called, full_width, inline
from sweep.models.generated import compile_inline, tuple_of
from sweep.models.slow.elementary import exp, log1p, quotient, square, times, turn_by
from sweep.models.slow.exchange import HIGHER, LOWEST, TERMS
from sweep.models.stiff.final_spin import lasts

# With 16 lanes a step takes a fifth longer; with 64, more lanes are idle at the end.
_LANES = 1 if INTERPRETED else 32

# Steps between two looks at which lanes have ended.
_BLOCK = 8

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

# Since it last turned the spin, a mode may fall by this factor before it turns the spin again. The fall is that of its
# rates: in its amplitude, a step excites it anew by mixing the modes, and a tiny mode then grows back too early.
_DEEPEST = np.log(1e-8)

# Eigenvalues differ by at least this share of the matrix; the squares of amplitudes may fall below the smallest number.
_APART, _TINY, _LONG = 1e-6, 1e-300, 1e12

# Where the lanes of each quantity begin in a group; complex numbers take two rows.
(_Z1, _Z2, _V11, _V12, _V21, _V22, _REST, _BETWEEN, _N, _OLD, _COUNT, _KEEP, _STEP, _STEPS, _STATE, _SIZE, _D,
 _STRONG, _FAR_APART, _BENT_RATES, _BENT_TURN, _E1, _E2, _X, _LOG1, _LOG2, _LOW1, _LOW2, _SUNK, _GROUP) = (
    _LANES * row for row in (*range(0, 16, 2), *range(16, 38)))  # fmt: skip

_RUNNING, _OVER_NOW, _FAILED = 0.0, 1.0, 2.0


@inline
def _get(rows, at, lane):
    return complex(rows[at + lane], rows[at + _LANES + lane])


# (s, lane) -> all coefficients of a lane, one by one: a loop over them would need an array, and not be vectorised.
_SUMS = tuple_of(f"get(s, {at}, lane)" for at in range(0, 2 * TERMS * _LANES, 2 * _LANES))
_load_sums = compile_inline("load_sums", "s, lane", [f"return {_SUMS}"], {"get": _get})


@inline
def _put(rows, at, lane, z):
    rows[at + lane], rows[at + _LANES + lane] = z.real, z.imag


@inline
def _get_modes(g, lane):
    """The amplitudes z_1 and z_2, and their modes V."""
    V = (_get(g, _V11, lane), _get(g, _V12, lane), _get(g, _V21, lane), _get(g, _V22, lane))
    return _get(g, _Z1, lane), _get(g, _Z2, lane), V


@inline
def _put_modes(g, lane, z1, z2, V):
    _put(g, _Z1, lane, z1)
    _put(g, _Z2, lane, z2)
    _put(g, _V11, lane, V[0])
    _put(g, _V12, lane, V[1])
    _put(g, _V21, lane, V[2])
    _put(g, _V22, lane, V[3])


@inline
def _rates(sums, by, e1, e2, beat):
    """C with T, divided by `by`, for products of the amplitudes: e_1, e_2 and `beat`, which is a_1 a_2*."""
    back = np.conj(beat)
    share = 1.0 / by  # a complex division would have to check for zero
    return (
        sums[0] + times(share, times(e1, sums[7]) + sums[8] * beat + times(e2, sums[10])),
        sums[1] + times(share, times(e1, sums[9]) + sums[11] * back + times(e2, sums[12])),
        sums[2] + times(share, times(e1, sums[13]) + sums[14] * beat + times(e2, sums[16])),
        sums[3] + times(share, times(e1, sums[15]) + sums[17] * back + times(e2, sums[18])),
    )


@inline
def _turning(sums, by, e1, e2, beat):
    """n' with Q, divided by `by`."""
    pairs = sums[19].real * e1 * e1 + sums[20].real * e1 * e2 + sums[21].real * e2 * e2
    pairs += 2.0 * ((times(e1, sums[22]) + times(e2, sums[23]) + sums[24] * beat) * beat).real
    return sums[4].real * e1 + sums[5].real * e2 + 2.0 * (sums[6] * beat).real + pairs / by


@inline
def _root(z):
    """A square root of z, which is not 0."""
    large = np.sqrt(0.5 * (np.sqrt(square(z)) + abs(z.real)))
    small = 0.5 * z.imag / (large + _TINY)
    return complex(large if z.real >= 0.0 else small, small if z.real >= 0.0 else large)


@inline
def _modes(C):
    """Eigenvalues and eigenvectors of a 2 × 2 matrix, (λ_1, λ_2, (V_11, V_12, V_21, V_22))."""
    c11, c12, c21, c22 = C
    middle, half = times(0.5, c11 + c22), times(0.5, c11 - c22)
    root, least = half * half + c12 * c21, _APART**2 * (square(c12) + square(c21) + square(half))
    apart = square(root) > least * least
    root = _root(complex(root.real if apart else least, root.imag if apart else 0.0))
    sign = 1.0 if half.real * root.real + half.imag * root.imag >= 0.0 else -1.0
    root = times(sign, root)
    big = half + root
    by1, by2 = 1.0 / np.sqrt(square(big) + square(c21) + _TINY), 1.0 / np.sqrt(square(big) + square(c12) + _TINY)
    return middle + root, middle - root, (times(by1, big), times(-by2, c12), times(by1, c21), times(by2, big))


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
    soon = way / (turn + way / _LONG) if abs(turned) < 1e-6 else log1p(max(turned, -1.0)) / (2.0 * rate)
    return soon if turned > -1.0 else _LONG


@inline
def _mean(after, turn):
    """The mean over a step of an exponential that is 1 before it and `after` = exp(turn) at its end."""
    small, z = abs(turn.real) + abs(turn.imag) < 1e-6, quotient(after - 1.0, turn)
    return complex(1.0 + 0.5 * turn.real if small else z.real, 0.5 * turn.imag if small else z.imag)


@inline
def _real_mean(after, turn):
    """As `_mean`, of real numbers."""
    return 1.0 + 0.5 * turn if abs(turn) < 1e-6 else (after - 1.0) / turn


@inline
def _products(e1, e2, cross, V):
    """|a_1|², |a_2|² and a_1 a_2*, from the same products of the amplitudes of the modes V."""
    first = square(V[0]) * e1 + square(V[1]) * e2 + 2.0 * (V[0] * np.conj(V[1]) * cross).real
    second = square(V[2]) * e1 + square(V[3]) * e2 + 2.0 * (V[2] * np.conj(V[3]) * cross).real
    beat = times(e1, V[0] * np.conj(V[2])) + times(e2, V[1] * np.conj(V[3]))
    return first, second, beat + V[0] * np.conj(V[3]) * cross + V[1] * np.conj(V[2]) * np.conj(cross)


@inline
def _grown(step, rate1, rate2):
    """Growth factors of both modes in a step, and exp(i φ) for the phase φ by which they part.

    Their common phase drives nothing.
    """
    phase = step * (rate1.imag - rate2.imag)
    return exp(step * rate1.real), exp(step * rate2.real), turn_by(phase)


@inline
def _means(z1, z2, step, rate1, rate2, grown, V):
    """The means of |a_1|², |a_2|² and a_1 a_2* over a step in which modes of amplitudes z grow."""
    g1, g2, turned = grown
    e1 = square(z1) * _real_mean(g1 * g1, 2.0 * step * rate1.real)
    e2 = square(z2) * _real_mean(g2 * g2, 2.0 * step * rate2.real)
    return _products(e1, e2, z1 * np.conj(z2) * _mean(times(g1 * g2, turned), times(step, rate1 + np.conj(rate2))), V)


@inline
def _turns(sums, V):
    """H in the modes V: of each, and of both."""
    h1, h2, h12 = sums[4].real, sums[5].real, sums[6]
    one = h1 * square(V[0]) + h2 * square(V[2]) + 2.0 * (h12 * V[0] * np.conj(V[2])).real
    other = h1 * square(V[1]) + h2 * square(V[3]) + 2.0 * (h12 * V[1] * np.conj(V[3])).real
    both = times(h1, V[0] * np.conj(V[1])) + times(h2, V[2] * np.conj(V[3]))
    both += h12 * V[0] * np.conj(V[3]) + np.conj(h12) * V[2] * np.conj(V[1])
    return one, other, both


@inline
def _resolved(g, lane, sums, e1, e2, beat):
    """The rates at these products of the amplitudes, the amplitudes in the modes of these, and the modes."""
    z1, z2, V = _get_modes(g, lane)
    by = (1.0 + g[_BENT_RATES + lane] * (e1 + e2)) / g[_SIZE + lane]
    rate1, rate2, W = _modes(_rates(sums, by, e1, e2, beat))
    z1, z2 = _turned(z1, z2, V, W, g[_KEEP + lane])
    return rate1, rate2, z1, z2, W


@inline
def _turn_of(g, lane, sums, e1, e2, beat):
    """n' at these means of the products of the amplitudes."""
    return _turning(sums, (1.0 + g[_BENT_TURN + lane] * (e1 + e2)) / g[_SIZE + lane], e1, e2, beat)


@inline
def _longest(pace, f1, f2, rate1, rate2, apart, h1, h2, cross, left, d, strong):
    """The length of a step, with `pace` times the usual changes; h1 and h2 are the sizes of H in the modes."""
    r1, r2 = rate1.real, rate2.real
    way = pace * _TURN * (np.sqrt(f1) + np.sqrt(f2) + min(abs(r1), abs(r2)) / max(h1, h2, _TINY))
    step = min(_until(way, h1 * f1, r1), _until(way, h2 * f2, r2))
    step = min(step, _until(way, cross / (1.0 + apart * step), 0.5 * (r1 + r2)))
    step = min(step, pace * _CHANGE / (max(h1, h2) * min(way, left) + _TINY), pace * _SLOWED / (d + _TINY))
    acts = 2.0 * strong * np.sqrt(f1 * f2)
    return min(step, pace * _BEAT / (apart + acts)) if acts > _ACTS * apart else step


def make_follow():
    """Compiled (tables, starts, cells, factors, counts, sound) -> None: follows the slow equations of `cells`.

    Parameters
    ----------
    tables : the coefficients of `sweep.models.slow.exchange`, of all cells
    starts : of all cells, shape (cells, 8): real and imaginary parts of a_1 and a_2, n, d, and the two κ
    cells : which of them to follow
    factors : of T and Q, of d, of the changes in a step, and of the start spin: all 1, except to test how much a count
        depends on them
    counts, sound : get the numbers of reversals of `cells`, and whether the equations describe the motion to its end,
        where the mode that turns the spin last has not fallen too far before

    Changes of sign are those of the spin without its beat, Re H_12 a_1 a_2* / (λ_1 + λ_2*) at rest, of which the part
    that decays is left out: the simulated count is of the ripple-free spin.
    """
    wide = full_width()

    @called
    def coefficients(t, g, s):
        """The coefficients at a spin."""
        wide()
        for k in range(2 * LOWEST):
            for lane in range(_LANES):
                x = g[_X + lane]
                value = ((t[4, k, lane] * x + t[3, k, lane]) * x + t[2, k, lane]) * x + t[1, k, lane]
                s[k * _LANES + lane] = value * x + t[0, k, lane]
        for k in range(2 * LOWEST, 2 * TERMS):
            for lane in range(_LANES):
                x = g[_X + lane]
                s[k * _LANES + lane] = (t[2, k, lane] * x + t[1, k, lane]) * x + t[0, k, lane]

    @called
    def begin(g, s, pace):
        """Count a reversal, choose a step, and find the spin in its middle."""
        wide()
        for lane in range(_LANES):
            n, d, state, sums = g[_N + lane], g[_D + lane], g[_STATE + lane], _load_sums(s, lane)
            z1, z2, V = _get_modes(g, lane)
            e1, e2, beat = _products(square(z1), square(z2), times(g[_KEEP + lane], z1 * np.conj(z2)), V)
            rate1, rate2, z1, z2, V = _resolved(g, lane, sums, e1, e2, beat)
            f1, f2, r1, r2, apart = square(z1), square(z2), rate1.real, rate2.real, abs(rate1.imag - rate2.imag)
            (g1, g2, g12), both, running = _turns(sums, V), rate1 + np.conj(rate2), state == _RUNNING
            near, far = (_get(g, _REST, lane) * beat).real, 2.0 * quotient(g12 * z1 * np.conj(z2), both).real
            new = n - (far if g[_FAR_APART + lane] > 0.0 else near)
            reverses = running & (new * g[_OLD + lane] < 0.0)
            g[_COUNT + lane] += 1.0 if reverses else 0.0
            g[_OLD + lane] = new
            h1, h2, cross = abs(g1), abs(g2), 2.0 * np.sqrt(square(g12) * f1 * f2)
            first, second = reverses & (h1 * f1 >= h2 * f2), reverses & (h1 * f1 < h2 * f2)
            # Loads inside a conditional expression would keep the loop from being vectorised.
            log1, log2, low1, low2 = g[_LOG1 + lane], g[_LOG2 + lane], g[_LOW1 + lane], g[_LOW2 + lane]
            sunk, low = g[_SUNK + lane], low1 if first else low2
            deep = 1.0 if low < _DEEPEST else 0.0
            g[_SUNK + lane] = deep if reverses else sunk
            g[_LOG1 + lane], g[_LOW1 + lane] = 0.0 if first else log1, 0.0 if first else low1
            g[_LOG2 + lane], g[_LOW2 + lane] = 0.0 if second else log2, 0.0 if second else low2
            beating = cross / np.sqrt(square(both))
            lasting, others = lasts(n, (r1, r2), d, -g1 * f1 / (2.0 * r1 + d), -g2 * f2 / (2.0 * r2 + d))
            over = (r1 < 0.0) & (r2 < 0.0) & (others + beating < _OVER * lasting)
            g[_STATE + lane] = _OVER_NOW if running & over else state
            left = 0.5 * h1 * f1 / abs(r1) + 0.5 * h2 * f2 / abs(r2) + beating
            step = _longest(pace, f1, f2, rate1, rate2, apart, h1, h2, cross, left, d, g[_STRONG + lane])
            g[_STEP + lane], g[_KEEP + lane] = step, 0.0 if apart * step > _APART_STEP else 1.0
            grown = _grown(0.5 * step, rate1, rate2)
            e1, e2, beat = _means(z1, z2, 0.5 * step, rate1, rate2, grown, V)
            middle = (n + 0.5 * step * _turn_of(g, lane, sums, e1, e2, beat)) * exp(-0.5 * d * step)
            grown = (grown[0] * grown[0], grown[1] * grown[1], grown[2] * grown[2])
            g[_E1 + lane], g[_E2 + lane], beat = _means(z1, z2, step, rate1, rate2, grown, V)
            g[_X + lane] = middle
            _put(g, _BETWEEN, lane, beat)
            _put_modes(g, lane, z1, z2, V)

    @called
    def end(g, s):
        """Take the step with the coefficients of its middle."""
        wide()
        for lane in range(_LANES):
            sums, step, state = _load_sums(s, lane), g[_STEP + lane], g[_STATE + lane]
            e1, e2, beat = g[_E1 + lane], g[_E2 + lane], _get(g, _BETWEEN, lane)
            rate1, rate2, z1, z2, V = _resolved(g, lane, sums, e1, e2, beat)
            grown = _grown(step, rate1, rate2)
            e1, e2, beat = _means(z1, z2, step, rate1, rate2, grown, V)
            n = (g[_N + lane] + step * _turn_of(g, lane, sums, e1, e2, beat)) * exp(-g[_D + lane] * step)
            steps = g[_STEPS + lane] + 1.0
            log1, log2 = g[_LOG1 + lane] + step * rate1.real, g[_LOG2 + lane] + step * rate2.real
            low1, low2 = g[_LOW1 + lane], g[_LOW2 + lane]
            g[_LOG1 + lane], g[_LOW1 + lane] = log1, log1 if log1 < low1 else low1
            g[_LOG2 + lane], g[_LOW2 + lane] = log2, log2 if log2 < low2 else low2
            fails = (not abs(n) < _FAR) | (steps >= _MOST_STEPS)
            g[_STATE + lane] = _FAILED if (state == _RUNNING) & fails else state
            g[_N + lane], g[_X + lane], g[_STEPS + lane] = n, n, steps
            _put_modes(g, lane, times(grown[0], z1), times(grown[1], z2) * np.conj(grown[2]), V)

    @called
    def fill(g, t, lane, table, start, factors):
        """Set a lane to the beginning of a trajectory."""
        size, spin, couple = factors[0], factors[3] * start[4], factors[1] * start[5]
        parts, strong = table.view(np.float64), 0.0
        for j in range(5):
            for k in range(2 * TERMS):
                t[j, k, lane] = parts[j, k]
        for k in range(LOWEST, HIGHER):
            strong += 0.5 * square(table[0, k])
        for at in range(0, _GROUP, _LANES):
            g[at + lane] = 0.0
        _put(g, _Z1, lane, complex(start[0], start[1]))
        _put(g, _Z2, lane, complex(start[2], start[3]))
        g[_V11 + lane] = g[_V22 + lane] = g[_KEEP + lane] = 1.0
        g[_N + lane], g[_X + lane], g[_D + lane] = spin, spin, couple
        g[_BENT_RATES + lane], g[_BENT_TURN + lane] = start[6], start[7]
        g[_SIZE + lane], g[_STRONG + lane] = size, size * np.sqrt(strong)
        g[_FAR_APART + lane] = 1.0 if table[0, 3].imag > 2.0 * table[0, 0].imag else 0.0
        both = table[0, 0] + np.conj(table[0, 3])
        g[_REST + _LANES + lane] = -2.0 * table[0, 6].real * both.imag / square(both)

    @called
    def follow(tables, starts, cells, factors, counts, sound):
        g, t, s = np.zeros(_GROUP), np.zeros((5, 2 * TERMS, _LANES)), np.empty(2 * TERMS * _LANES)
        whose, following, begun = np.full(_LANES, -1), 0, 0
        g[_STATE : _STATE + _LANES] = _FAILED
        while True:
            for lane in range(_LANES):
                if g[_STATE + lane] != _RUNNING:
                    if whose[lane] >= 0:
                        counts[whose[lane]] = g[_COUNT + lane]
                        sound[whose[lane]] = (g[_STATE + lane] == _OVER_NOW) & (g[_SUNK + lane] == 0.0)
                        whose[lane], following = -1, following - 1
                    if begun < len(cells):
                        cell = cells[begun]
                        fill(g, t, lane, tables[cell], starts[cell], factors)
                        whose[lane], begun, following = cell, begun + 1, following + 1
            if not following:
                break
            for _ in range(_BLOCK):
                coefficients(t, g, s)
                begin(g, s, factors[2])
                coefficients(t, g, s)
                end(g, s)

    return follow
