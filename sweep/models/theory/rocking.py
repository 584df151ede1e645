"""The rocking about upright rest without slip: two undamped modes, in u and the angular momentum M about the contact.

    u' = B M,   M' = C u

to first order in u1, u2, M1, M2.  -ν² are the eigenvalues of B C.  `sweep.models.general.rigid_body` gives them for a
body.

The paper's ν1, ν2 neglect c² compared with a² and b² in C: at a = 10, b = 3 they give 3.65 for the period of the slower
mode; the right value is 3.87.
"""

from __future__ import annotations

from collections import namedtuple

import numpy as np

from sweep.jit import inline
from sweep.models.model import Array

LONGEST = 1000.0
"""Ratio of the two periods of the rocking beyond which the spin is averaged over a shorter time than the longer one.
Bodies with b > 1.00001 c have a smaller ratio (a = 10)."""

Rocking = namedtuple("Rocking", "B11 B12 B21 B22 C11 C12 C21 C22")
"""The elements of B and C."""


def frequencies(of: Rocking) -> tuple[Array, Array]:
    """The lower and the higher frequency ν, each of shape (cells,)."""
    B11, B12, B21, B22, C11, C12, C21, C22 = of
    first, second = -B12 * C21 - B11 * C11, -B21 * C12 - B22 * C22
    half_split = np.sqrt((0.5 * (first - second)) ** 2 + (B11 * C12 + B12 * C22) * (B21 * C11 + B22 * C21))
    higher = 0.5 * (first + second) + half_split
    # The product of the squares is det(B C).  A difference would lose the lower one where a body is nearly round.
    determinant = (B12 * B21 - B11 * B22) * (C12 * C21 - C11 * C22)
    lower = np.divide(determinant, higher, out=np.zeros_like(higher), where=higher > 0)
    return np.sqrt(np.maximum(lower, 0.0)), np.sqrt(np.maximum(higher, 0.0))


def longer_period(of: Rocking) -> Array:
    """Return the period over which the spin is averaged, shape (cells,): that of the slower mode.

    In a body that is nearly round about one axis the slower mode hardly swings back, and its period has no limit.  So
    it is at most `LONGEST` periods of the faster mode.
    """
    lower, higher = frequencies(of)
    with np.errstate(divide="ignore"):
        return np.asarray(2 * np.pi / np.maximum(lower, higher / LONGEST))


@inline
def implicit(weight, of):
    """(1 - weight J)⁻¹ row by row, sixteen numbers, where J is the matrix of the rocking `of` in (u1, u2, M1, M2)."""
    B11, B12, B21, B22, C11, C12, C21, C22 = of
    b11, b12, b21, b22 = weight * B11, weight * B12, weight * B21, weight * B22
    square = weight * weight
    s11, s12, s21, s22 = square * B11, square * B12, square * B21, square * B22
    # E = (1 - w² B C)⁻¹; the other blocks are w E B, w C E and 1 + w² C E B.
    E11, E12 = 1.0 - s21 * C12 - s22 * C22, s12 * C22 + s11 * C12
    E21, E22 = s21 * C11 + s22 * C21, 1.0 - s12 * C21 - s11 * C11
    inv_det = 1.0 / (E11 * E22 - E12 * E21)
    E11, E12, E21, E22 = E11 * inv_det, E12 * inv_det, E21 * inv_det, E22 * inv_det
    F11, F12 = weight * (C11 * E11 + C12 * E21), weight * (C11 * E12 + C12 * E22)
    F21, F22 = weight * (C21 * E11 + C22 * E21), weight * (C21 * E12 + C22 * E22)
    return (
        E11, E12, E12 * b21 + E11 * b11, E11 * b12 + E12 * b22,
        E21, E22, E22 * b21 + E21 * b11, E21 * b12 + E22 * b22,
        F11, F12, 1.0 + F12 * b21 + F11 * b11, F11 * b12 + F12 * b22,
        F21, F22, F22 * b21 + F21 * b11, 1.0 + F21 * b12 + F22 * b22,
    )  # fmt: skip
