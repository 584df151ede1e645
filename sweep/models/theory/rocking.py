"""The rocking about upright rest without slip: two undamped modes, in u and the angular momentum M about the contact.

    u' = B M,   M' = C u

to first order in u1, u2, M1, M2.  -ν² are the eigenvalues of B C.  The paper's ν1, ν2 neglect c² beside a² and b² in
C: at a = 10, b = 3 they give 3.65 for the period of the slower mode, which is 3.87.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from sweep.jit import inline
from sweep.models import ellipsoid
from sweep.models.model import Array, Columns


class Body(NamedTuple):
    """What the rocking depends on, each of shape (cells,)."""

    I1: Any
    I2: Any
    I3: Any
    A11: Any
    A12: Any
    A22: Any
    A33: Any

    @classmethod
    def of(cls, columns: Columns) -> Body:
        return cls(*ellipsoid.inertia(columns), *ellipsoid.shape(columns))


@inline
def rocking(p: Any) -> Any:
    """(B12, B21, C11, C12, C21, C22); the diagonal of B vanishes.  `p` holds I1, I2 and A11 … A33."""
    A11, A12, A22, A33 = p.A11, p.A12, p.A22, p.A33
    inv_c = 1.0 / np.sqrt(A33)
    return 1.0 / (p.I2 + A33), -1.0 / (p.I1 + A33), A12 * inv_c, (A22 - A33) * inv_c, (A33 - A11) * inv_c, -A12 * inv_c


def frequencies(p: Any) -> tuple[Array, Array]:
    """The lower and the higher frequency ν, in sqrt(g/c), each of shape (cells,); `p` as in `rocking`."""
    B12, B21, C11, C12, C21, C22 = rocking(p)
    first, second = -B12 * C21, -B21 * C12
    half_split = np.sqrt((0.5 * (first - second)) ** 2 + B12 * C22 * B21 * C11)
    higher = 0.5 * (first + second) + half_split
    # The product of the squares is det(B C).  A difference would lose the lower one where a body is nearly round.
    determinant = B12 * B21 * (C12 * C21 - C11 * C22)
    lower = np.divide(determinant, higher, out=np.zeros_like(higher), where=higher > 0)
    return np.sqrt(np.maximum(lower, 0.0)), np.sqrt(np.maximum(higher, 0.0))


def slower_period(columns: Columns) -> Array:
    """Period of the slower mode, in sqrt(c/g), shape (cells,); infinite for a body that is round about one axis."""
    lower, _ = frequencies(Body.of(columns))
    with np.errstate(divide="ignore"):
        return np.asarray(2 * np.pi / lower)
