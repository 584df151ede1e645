"""Elementary functions by arithmetic alone.

The compiler's own have branches, and a loop that calls one is not vectorised.
"""

from __future__ import annotations

import numpy as np

from sweep.jit import inline

_LOG_2 = np.log(2.0)
_ROUNDS = 1.5 * 2.0**52
"""Added to a number, it leaves the nearest whole number in the lowest bits."""

_ROOT_OF_HALF = np.float64(np.sqrt(0.5)).view(np.int64)


@inline
def square(z):
    """Return |z|², without the root that abs takes."""
    return z.real * z.real + z.imag * z.imag


@inline
def times(x, z):
    """Multiply a complex number by a real one, which Numba would first make complex."""
    return complex(x * z.real, x * z.imag)


@inline
def quotient(a, b):
    """Divide complex numbers, without the checks of a division."""
    return times(1.0 / square(b), a * np.conj(b))


@inline
def exp(x):
    """Return the exponential of x, to 1e-12; beyond ±700 that of ±700.

    It is 2^k exp(f) with |f| < 0.35, where k is written into the bits of the exponent.
    """
    x = min(max(x, -700.0), 700.0)
    shifted = x / _LOG_2 + _ROUNDS
    f = x - (shifted - _ROUNDS) * _LOG_2
    e = 1.0 + f / 9.0 * (1.0 + f / 10.0 * (1.0 + f / 11.0))
    e = 1.0 + f / 5.0 * (1.0 + f / 6.0 * (1.0 + f / 7.0 * (1.0 + f / 8.0 * e)))
    e = 1.0 + f * (1.0 + f / 2.0 * (1.0 + f / 3.0 * (1.0 + f / 4.0 * e)))
    return e * np.int64((np.float64(shifted).view(np.int64) + 1023) << 52).view(np.float64)


@inline
def log1p(x):
    """Return the logarithm of 1 + x, to 1 % for x up to 1e300, from its exponent and a fraction from 0.7 to 1.4."""
    bits = np.float64(1.0 + x).view(np.int64)
    power = (bits - _ROOT_OF_HALF) >> 52
    fraction = np.int64(bits - (power << 52)).view(np.float64)
    z = (fraction - 1.0) / (fraction + 1.0)
    return _LOG_2 * power + 2.0 * z * (1.0 + z * z / 3.0)


@inline
def turn_by(phase):
    """Return exp(i phase), to 1e-13 or the round-off of the phase.

    It is found from sin and 1 - cos of an eighth of the phase, doubled three times.
    """
    u = 0.125 * (phase - 2.0 * np.pi * np.floor(phase / (2.0 * np.pi) + 0.5))
    q = u * u
    sin = u * (1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0 * (1.0 - q / 110.0)))))
    left = q / 2.0 * (1.0 - q / 12.0 * (1.0 - q / 30.0 * (1.0 - q / 56.0 * (1.0 - q / 90.0 * (1.0 - q / 132.0)))))
    for _ in range(3):
        sin, left = 2.0 * sin * (1.0 - left), 2.0 * sin * sin
    return complex(1.0 - left, sin)
