"""Follow the slow equations to their end: count the reversals on the way, and find the spin that remains.

Within a step the spin and the coefficients stay as they are in its middle.  The amplitudes then turn and grow as the
modes of a 2 × 2 matrix do, and their products, which drive the spin, are integrated exactly over the step.  So a step
may be long compared with the beat of the modes, unless the beat is slow enough for T to act on it.

Trajectories run side by side in lanes, whose steps are vector instructions.  A lane whose trajectory has ended is
computed with the others until another trajectory takes its place.
"""

from __future__ import annotations

from collections import namedtuple
from functools import cache
from itertools import pairwise

import numpy as np

from sweep.jit import INTERPRETED, Cached, called, full_width, inline, serial
from sweep.models.generated import compile_inline, tuple_of
from sweep.models.slow.elementary import exp, log1p, quotient, square, times, turn_by
from sweep.models.slow.exchange import HIGHER, LOWEST, TERMS

# With 16 lanes a step takes a fifth longer; with 64, more lanes are idle at the end.
_LANES = 1 if INTERPRETED else 32

# Steps between two checks which lanes have ended.
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

# It is over when both modes decay and can change the spin by no more than this share.  With a couple, the spin is a sum
# of decaying terms, its own and one of each mode: it is over when the slowest exceeds the others that much.  A couple
# damps the spin by no more than a share `_DAMPED` in a step.  There may be more steps if they are shorter than usual.
_OVER, _MOST_STEPS, _DAMPED = 1e-3, 3000, 0.1

# The equations have failed if the spin exceeds what the energy allows by this factor.
_FAR = 3.0

# Since it last turned the spin, a mode may fall by this factor before it turns the spin again. The fall is that of its
# rates: in its amplitude, a step excites it anew by mixing the modes, and a tiny mode then grows back too early.
_DEEPEST = np.log(1e-8)

# Eigenvalues differ by at least this share of the matrix; the squares of amplitudes may fall below the smallest number.
_APART, _TINY, _LONG = 1e-6, 1e-300, 1e12

_RUNNING, _OVER_NOW, _FAILED = 0.0, 1.0, 2.0

Lane = namedtuple(
    "Lane",
    "z1 z2 v11 v12 v21 v22 beat "
    "n x old count keep step steps state e1 e2 log1 log2 low1 low2 sunk end overshoot nearest "
    "d size strong bent_rates bent_turn far_apart rest",
)
"""What a lane holds of a trajectory: the amplitudes z of two modes, and these modes V; the spin n, and x, the spin at
which the coefficients are evaluated; the spin without the beat at the last check, and the number of reversals; 1 unless
each mode keeps its own amplitude; the length of the step, the number of steps, and the state; for a step, the means of
|a_1|², |a_2|² and a_1 a_2* (e1, e2, beat); for each mode, by how much its logarithm has changed since it last turned
the spin, and the least of that; whether the mode that turned the spin last had fallen too far; the spin that would
remain, and the extremes of the last arc.  d, the factor of T and Q, a measure of T, both κ, whether one frequency is
more than twice the other, and the factor of the beat in the spin stay as they are."""

_COMPLEX, _FIXED = Lane._fields[:7], Lane._fields[-7:]

_ROW = {name: 2 * i for i, name in enumerate(_COMPLEX)}
_ROW |= {name: len(_COMPLEX) + i for i, name in enumerate(Lane._fields) if name not in _ROW}
_ROWS = len(_COMPLEX) + len(Lane._fields)

Terms = namedtuple("Terms", "C H T1 T2 Q")
"""The coefficients of a lane at a spin (`sweep.models.slow.exchange`): C and T in rows."""


@inline
def _complex(rows, at, lane):
    return complex(rows[at + lane], rows[at + _LANES + lane])


def _place(name: str) -> str:
    """Return the source of a quantity of a lane."""
    at = _ROW[name] * _LANES
    return f"of(g, {at}, lane)" if name in _COMPLEX else f"g[{at} + lane]"


# Loops over quantities would need arrays, and not be vectorised.
_load = compile_inline(
    "load", "g, lane", [f"return Lane{tuple_of(map(_place, Lane._fields))}"], {"Lane": Lane, "of": _complex}
)


def _storing(*names: str):
    """Inline (g, lane, values) -> None, which sets these quantities of a lane."""
    lines = list[str]()
    for i, each in enumerate(names):
        parts = (".real", ".imag") if each in _COMPLEX else ("",)
        lines += [f"g[{(_ROW[each] + k) * _LANES} + lane] = values[{i}]{part}" for k, part in enumerate(parts)]
    return compile_inline("store", "g, lane, values", lines, {})


def _make_load_terms():
    at = [f"of(s, {2 * _LANES * term}, lane)" for term in range(TERMS)]
    ends = [0, 4, LOWEST, LOWEST + 6, HIGHER, TERMS]
    parts = (tuple_of(at[begin:end]) for begin, end in pairwise(ends))
    return compile_inline("load_terms", "s, lane", [f"return Terms{tuple_of(parts)}"], {"Terms": Terms, "of": _complex})


_load_terms = _make_load_terms()


@inline
def _row(T, share, products):
    """Return a row of T, multiplied by `share`, for products of the amplitudes: |a_1|², |a_2|² and a_1 a_2*."""
    e1, e2, beat = products
    return (
        times(share, times(e1, T[0]) + T[1] * beat + times(e2, T[3])),
        times(share, times(e1, T[2]) + T[4] * np.conj(beat) + times(e2, T[5])),
    )


@inline
def _rates(terms, by, products):
    """C with T, divided by `by`."""
    share = 1.0 / by  # a complex division would have to check for zero
    one, other, C = _row(terms.T1, share, products), _row(terms.T2, share, products), terms.C
    return C[0] + one[0], C[1] + one[1], C[2] + other[0], C[3] + other[1]


@inline
def _turning(terms, by, products):
    """n' with Q, divided by `by`."""
    (e1, e2, beat), (h1, h2, h12), Q = products, terms.H, terms.Q
    pairs = Q[0].real * e1 * e1 + Q[1].real * e1 * e2 + Q[2].real * e2 * e2
    pairs += 2.0 * ((times(e1, Q[3]) + times(e2, Q[4]) + Q[5] * beat) * beat).real
    return h1.real * e1 + h2.real * e2 + 2.0 * (h12 * beat).real + pairs / by


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


Resolved = namedtuple("Resolved", "rate1 rate2 z1 z2 V")
"""The rates at some products of the amplitudes, and the amplitudes in the modes V of these rates."""


@inline
def _resolved(at, terms, products):
    by = (1.0 + at.bent_rates * (products[0] + products[1])) / at.size
    rate1, rate2, V = _modes(_rates(terms, by, products))
    z1, z2 = _turned(at.z1, at.z2, (at.v11, at.v12, at.v21, at.v22), V, at.keep)
    return Resolved(rate1, rate2, z1, z2, V)


@inline
def _turn_of(at, terms, products):
    """n' at these means of the products of the amplitudes."""
    return _turning(terms, (1.0 + at.bent_turn * (products[0] + products[1])) / at.size, products)


@inline
def _grown(step, now):
    """Growth factors of both modes in a step, and exp(i φ) for the phase φ by which they part.

    Their common phase drives nothing.
    """
    phase = step * (now.rate1.imag - now.rate2.imag)
    return exp(step * now.rate1.real), exp(step * now.rate2.real), turn_by(phase)


@inline
def _means(step, now, grown):
    """The means of |a_1|², |a_2|² and a_1 a_2* over a step in which the modes grow."""
    g1, g2, turned = grown
    e1 = square(now.z1) * _real_mean(g1 * g1, 2.0 * step * now.rate1.real)
    e2 = square(now.z2) * _real_mean(g2 * g2, 2.0 * step * now.rate2.real)
    mean = _mean(times(g1 * g2, turned), times(step, now.rate1 + np.conj(now.rate2)))
    return _products(e1, e2, now.z1 * np.conj(now.z2) * mean, now.V)


Acts = namedtuple("Acts", "f1 f2 h1 h2 h12 both apart cross beating")
"""What the modes do to the spin: |z|² and H of each; H of both, the rate of their beat, and its frequency; the largest
part of the beat in n', and in n."""


@inline
def _acts(H, now):
    (h1, h2, h12), V, f1, f2 = H, now.V, square(now.z1), square(now.z2)
    one = h1.real * square(V[0]) + h2.real * square(V[2]) + 2.0 * (h12 * V[0] * np.conj(V[2])).real
    other = h1.real * square(V[1]) + h2.real * square(V[3]) + 2.0 * (h12 * V[1] * np.conj(V[3])).real
    together = times(h1.real, V[0] * np.conj(V[1])) + times(h2.real, V[2] * np.conj(V[3]))
    together += h12 * V[0] * np.conj(V[3]) + np.conj(h12) * V[2] * np.conj(V[1])
    both, cross = now.rate1 + np.conj(now.rate2), 2.0 * np.sqrt(square(together) * f1 * f2)
    apart = abs(now.rate1.imag - now.rate2.imag)
    return Acts(f1, f2, one, other, together, both, apart, cross, cross / np.sqrt(square(both)))


@inline
def _lasts(n, r1, r2, d, left1, left2):
    """Sizes of the most slowly decaying term of the spin, and of the others together."""
    rest = abs(n + left1 + left2)
    of_modes = abs(left2) if r2 > r1 else abs(left1)
    others = rest + (abs(left1) if r2 > r1 else abs(left2))
    drag = d < min(-2.0 * r1, -2.0 * r2)
    return abs(n) if drag else of_modes, abs(left1) + abs(left2) if drag else others


@inline
def _tracked(at, acts, reverses):
    """Return log1, log2, low1, low2 and sunk after a check."""
    strong = abs(acts.h1) * acts.f1 >= abs(acts.h2) * acts.f2
    first, second = reverses & strong, reverses & (not strong)
    deep = 1.0 if (at.low1 if first else at.low2) < _DEEPEST else 0.0
    one, other = (0.0 if first else at.log1, 0.0 if first else at.low1), (0.0 if second else at.log2,
                                                                         0.0 if second else at.low2)  # fmt: skip
    return one[0], other[0], one[1], other[1], deep if reverses else at.sunk


@inline
def _course(at, now, acts, spin, far, reverses):
    """Return the state, the spin that would remain, and overshoot and nearest approach after a check at a spin.

    With a couple, which damps all spins, the nearest approach is the smallest share that |spin| has in the sum of
    |spin| and of what both modes can still do to it.
    """
    r1, r2, turn1, turn2 = now.rate1.real, now.rate2.real, acts.h1 * acts.f1, acts.h2 * acts.f2
    left1, left2 = -turn1 / (2.0 * r1 + at.d), -turn2 / (2.0 * r2 + at.d)
    lasting, others = _lasts(at.n, r1, r2, at.d, left1, left2)
    over = (r1 < 0.0) & (r2 < 0.0) & (others + acts.beating < _OVER * lasting)
    end = at.n - far + left1 + left2 if at.d == 0.0 else at.n
    size = abs(end if over else spin)
    further = reverses | (size >= at.overshoot)
    overshoot = size if further else at.overshoot
    able = abs(turn1) / (2.0 * abs(r1) + at.d) + abs(turn2) / (2.0 * abs(r2) + at.d)
    size = size / (size + able) if at.d > 0.0 else size
    nearest = size if further | (size < at.nearest) else at.nearest
    running = at.state == _RUNNING
    return (
        _OVER_NOW if running & over else at.state,
        end if running else at.end, overshoot if running else at.overshoot, nearest if running else at.nearest,
    )  # fmt: skip


@inline
def _longest(at, now, acts, pace):
    """The length of a step, with `pace` times the usual changes."""
    r1, r2, h1, h2, f1, f2 = now.rate1.real, now.rate2.real, abs(acts.h1), abs(acts.h2), acts.f1, acts.f2
    left = 0.5 * h1 * f1 / abs(r1) + 0.5 * h2 * f2 / abs(r2) + acts.beating
    way = pace * _TURN * (np.sqrt(f1) + np.sqrt(f2) + min(abs(r1), abs(r2)) / max(h1, h2, _TINY))
    step = min(_until(way, h1 * f1, r1), _until(way, h2 * f2, r2))
    step = min(step, _until(way, acts.cross / (1.0 + acts.apart * step), 0.5 * (r1 + r2)))
    step = min(step, pace * _CHANGE / (max(h1, h2) * min(way, left) + _TINY), pace * _DAMPED / (at.d + _TINY))
    mixed = 2.0 * at.strong * np.sqrt(f1 * f2)
    return min(step, pace * _BEAT / (acts.apart + mixed)) if mixed > _ACTS * acts.apart else step


@inline
def _without_beat(at, products, now, acts):
    """The spin without the beat, and the beat in the spin at the present rates."""
    far = 2.0 * quotient(acts.h12 * now.z1 * np.conj(now.z2), acts.both).real
    return at.n - (far if at.far_apart > 0.0 else -at.rest * products[2].imag), far


def _make_coefficients(wide):
    """Compiled (t, g, s) -> None: evaluates the coefficients of all lanes at their spins x."""
    X = _ROW["x"] * _LANES

    @called
    def coefficients(t, g, s):
        wide()
        for k in range(2 * LOWEST):
            for lane in range(_LANES):
                x = g[X + lane]
                value = ((t[4, k, lane] * x + t[3, k, lane]) * x + t[2, k, lane]) * x + t[1, k, lane]
                s[k * _LANES + lane] = value * x + t[0, k, lane]
        for k in range(2 * LOWEST, 2 * TERMS):
            for lane in range(_LANES):
                x = g[X + lane]
                s[k * _LANES + lane] = (t[2, k, lane] * x + t[1, k, lane]) * x + t[0, k, lane]

    return coefficients


def _make_begin(wide):
    """Compiled (g, s, pace) -> None: checks all lanes, chooses a step, and finds the spin in its middle."""
    store_look = _storing("old", "count", "log1", "log2", "low1", "low2", "sunk", "state", "end", "overshoot",
                          "nearest")  # fmt: skip
    store_step = _storing("step", "keep", "e1", "e2", "beat", "x", *_COMPLEX[:6])

    @called
    def begin(g, s, pace):
        wide()
        for lane in range(_LANES):
            at, terms = _load(g, lane), _load_terms(s, lane)
            V = at.v11, at.v12, at.v21, at.v22
            products = _products(square(at.z1), square(at.z2), times(at.keep, at.z1 * np.conj(at.z2)), V)
            now = _resolved(at, terms, products)
            acts = _acts(terms.H, now)
            spin, far = _without_beat(at, products, now, acts)
            reverses = (at.state == _RUNNING) & (spin * at.old < 0.0)
            count = at.count + (1.0 if reverses else 0.0)
            look = (spin, count), _tracked(at, acts, reverses), _course(at, now, acts, spin, far, reverses)
            store_look(g, lane, look[0] + look[1] + look[2])
            step = _longest(at, now, acts, pace)
            grown = _grown(0.5 * step, now)
            turn = _turn_of(at, terms, _means(0.5 * step, now, grown))
            middle = (at.n + 0.5 * step * turn) * exp(-0.5 * at.d * step)
            grown = (grown[0] * grown[0], grown[1] * grown[1], grown[2] * grown[2])
            keep = 0.0 if acts.apart * step > _APART_STEP else 1.0
            store_step(g, lane, (step, keep, *_means(step, now, grown), middle, now.z1, now.z2, *now.V))

    return begin


def _make_end(wide):
    """Compiled (g, s, most) -> None: takes the step of all lanes, with the coefficients of its middle.

    A trajectory fails that takes `most` steps.
    """
    store = _storing("state", "n", "x", "steps", "log1", "log2", "low1", "low2", *_COMPLEX[:6])

    @called
    def end(g, s, most):
        wide()
        for lane in range(_LANES):
            at, terms = _load(g, lane), _load_terms(s, lane)
            now, step = _resolved(at, terms, (at.e1, at.e2, at.beat)), at.step
            grown = _grown(step, now)
            n = (at.n + step * _turn_of(at, terms, _means(step, now, grown))) * exp(-at.d * step)
            steps = at.steps + 1.0
            log1, log2 = at.log1 + step * now.rate1.real, at.log2 + step * now.rate2.real
            low1, low2 = log1 if log1 < at.low1 else at.low1, log2 if log2 < at.low2 else at.low2
            fails = (at.state == _RUNNING) & ((not abs(n) < _FAR) | (steps >= most))
            amplitudes = times(grown[0], now.z1), times(grown[1], now.z2) * np.conj(grown[2])
            state = _FAILED if fails else at.state
            store(g, lane, (state, n, n, steps, log1, log2, low1, low2, *amplitudes, *now.V))

    return end


def _make_fill():
    """Compiled (g, t, lane, table, start, factors) -> None: sets a lane to the beginning of a trajectory."""
    store = _storing("z1", "z2", "v11", "v22", "keep", "n", "x", *_FIXED)

    @called
    def fill(g, t, lane, table, start, factors):
        size, spin, couple = factors[0], factors[3] * start[4], factors[1] * start[5]
        strong, both = 0.0, table[0, 0] + np.conj(table[0, 3])
        for j in range(5):
            for k in range(TERMS):
                t[j, 2 * k, lane], t[j, 2 * k + 1, lane] = table[j, k].real, table[j, k].imag
        for k in range(LOWEST, HIGHER):
            strong += 0.5 * square(table[0, k])
        for row in range(_ROWS):
            g[row * _LANES + lane] = 0.0
        z1, z2, one = complex(start[0], start[1]), complex(start[2], start[3]), complex(1.0, 0.0)
        far_apart = 1.0 if table[0, 3].imag > 2.0 * table[0, 0].imag else 0.0
        rest = -2.0 * table[0, 6].real * both.imag / square(both)
        fixed = couple, size, size * np.sqrt(strong), start[6], start[7], far_apart, rest
        store(g, lane, (z1, z2, one, one, 1.0, spin, spin, *fixed))

    return fill


FOUND = ("end", "count", "overshoot", "nearest", "sunk")
"""What is found of a trajectory, in this order, of which `sound` says whether the equations describe the motion to its
end: the spin that remains, or with a couple the spin when it can no longer reverse; the number of reversals; the
largest |spin| since the last reversal, or since the beginning; the smallest after that, with a couple in shares
(`_course`); and whether the mode that turned the spin last had fallen too far before."""


def make_follow():
    """Compiled (tables, starts, cells, factors, found, sound) -> None: follows the slow equations of `cells`.

    Parameters
    ----------
    tables : the coefficients of `sweep.models.slow.exchange`, of all cells
    starts : of all cells, shape (cells, 8): real and imaginary parts of a_1 and a_2, n, d, and the two κ
    cells : which of them to follow
    factors : of T and Q, of d, of the changes in a step, and of the start spin: all 1, except to test how much a count
        depends on them
    found, sound : of all cells, shapes (cells, `FOUND`) and (cells,)

    Changes of sign are those of the spin without its beat, Re H_12 a_1 a_2* / (λ_1 + λ_2*) at rest, of which the part
    that decays is left out: the simulated count is of the ripple-free spin.
    """
    wide = full_width()
    coefficients, begin, end, fill = _make_coefficients(wide), _make_begin(wide), _make_end(wide), _make_fill()
    state, rows = _ROW["state"] * _LANES, tuple(_ROW[name] * _LANES for name in FOUND)

    @called
    def follow(tables, starts, cells, factors, found, sound):
        g, t, s = np.zeros(_ROWS * _LANES), np.zeros((5, 2 * TERMS, _LANES)), np.zeros(2 * TERMS * _LANES)
        whose, following, begun, most = np.full(_LANES, -1), 0, 0, _MOST_STEPS / min(factors[2], 1.0)
        for lane in range(_LANES):
            g[state + lane] = _FAILED
        while True:
            for lane in range(_LANES):
                if g[state + lane] != _RUNNING:
                    if whose[lane] >= 0:
                        for k in range(len(rows)):
                            found[whose[lane], k] = g[rows[k] + lane]
                        sound[whose[lane]] = g[state + lane] == _OVER_NOW
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
                end(g, s, most)

    return follow


@cache
def compiled_follow() -> Cached:
    """Compiled `make_follow`, the same for all models."""
    return serial(make_follow(), "(c16[:, :, ::1], f8[:, ::1], i8[::1], f8[::1], f8[:, ::1], b1[::1])", "follow")
