"""A small rattle about upright spin in a model with slip, as a polynomial of degree four: compiled.

The rattle has six states.  Friction makes the slip v decay much faster than the body rocks, so that in a slow rattle
v = X z, where z are the four states of the rocking.  From

    z' = A z + B v,   v' = C z + D v    follows    X = D⁻¹ (X (A + B X) - C),

which is solved by iteration: each round gains the ratio of the two rates.  The characteristic polynomial of the rocking
is that of A + B X,

    λ⁴ + c3 λ³ + c2 λ² + c1 λ + c0.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sweep.jit import called, compiled
from sweep.kernels.codegen import compile_inline, tuple_of
from sweep.models.model import MODES, Model

# Rounds of the iteration for X, beyond which the slip does not count as fast.
_ROUNDS = 60


def has_fast_slip(model: Model) -> bool:
    """Tell whether the compiled search applies to a model."""
    return MODES in model.offers


def make_jacobian(model: Model) -> Any:
    """Compiled (rows, i, spin, J) -> None: the Jacobian of `theory.linear`, of the body in row i, to J (6, 6)."""
    rattle = [i for i in range(len(model.states)) if i != model.spin_state]
    slopes = compiled(compile_inline("slopes", "def slopes(y, p):\n    return rhs(y, p)[0]", {"rhs": model.rhs}))
    constants = " ".join(f"rows[i, {j}]," for j in range(len(model.constants._fields)))
    lines = [f"p, y = Constants({constants}), upright(spin)"]
    for column, state in enumerate(rattle):
        shifted = tuple_of(f"y[{i}] + {'1e-30j' if i == state else '0j'}" for i in range(len(model.states)))
        lines.append(f"slope = slopes({shifted}, p)")
        lines += [f"J[{row}, {column}] = slope[{i}].imag * 1e30" for row, i in enumerate(rattle)]
    source = "\n    ".join(["def jacobian(rows, i, spin, J):", *lines])
    names = {"slopes": slopes, "Constants": model.constants, "upright": model.upright}
    return compiled(compile_inline("jacobian", source, names))


@called
def quartic(J: Any, X: Any, c: Any) -> Any:
    """Write c0 … c3 of the rocking to c, and X, of shape (2, 4), from J, of shape (6, 6).

    False if the slip is not fast.
    """
    E = np.empty((2, 2))
    determinant = J[4, 4] * J[5, 5] - J[4, 5] * J[5, 4]
    E[0, 0], E[0, 1] = J[5, 5] / determinant, -J[4, 5] / determinant
    E[1, 0], E[1, 1] = -J[5, 4] / determinant, J[4, 4] / determinant
    G, W = np.empty((4, 4)), np.empty((2, 4))
    for _ in range(_ROUNDS):
        for i in range(4):
            for j in range(4):
                G[i, j] = J[i, j] + J[i, 4] * X[0, j] + J[i, 5] * X[1, j]
        for i in range(2):
            for j in range(4):
                W[i, j] = X[i, 0] * G[0, j] + X[i, 1] * G[1, j] + X[i, 2] * G[2, j] + X[i, 3] * G[3, j] - J[4 + i, j]
        change, size = 0.0, 0.0
        for i in range(2):
            for j in range(4):
                new = E[i, 0] * W[0, j] + E[i, 1] * W[1, j]
                change, size = max(change, abs(new - X[i, j])), max(size, abs(new))
                X[i, j] = new
        if change <= 4e-15 * size:
            break
    # The slip that is not slaved to the rocking: v' = F v.
    F00, F01 = J[4, 4], J[4, 5]
    F10, F11 = J[5, 4], J[5, 5]
    for k in range(4):
        F00, F01 = F00 - X[0, k] * J[k, 4], F01 - X[0, k] * J[k, 5]
        F10, F11 = F10 - X[1, k] * J[k, 4], F11 - X[1, k] * J[k, 5]
    trace, determinant = F00 + F11, F00 * F11 - F01 * F10
    _characteristic(G, c)
    # It decays without rocking by itself.
    return (change <= 4e-15 * size) & (trace < 0.0) & (2.0 * determinant <= trace * trace) & (determinant > 0.0)


@called
def _characteristic(G: Any, c: Any) -> None:
    """Write the coefficients c0 … c3 of the characteristic polynomial of a matrix, of shape (4, 4), to c."""
    c[:] = 0.0
    for i in range(4):
        c[3] -= G[i, i]
        for j in range(i):
            c[2] += G[i, i] * G[j, j] - G[i, j] * G[j, i]
    for i in range(4):  # the minors that leave out i
        p, q, r = (i + 1) % 4, (i + 2) % 4, (i + 3) % 4
        c[1] -= (
            G[p, p] * (G[q, q] * G[r, r] - G[q, r] * G[r, q])
            - G[p, q] * (G[q, p] * G[r, r] - G[q, r] * G[r, p])
            + G[p, r] * (G[q, p] * G[r, q] - G[q, q] * G[r, p])
        )
    for j in range(1, 4):  # by the minors of the first two rows, of the columns 0 and j, and of the other two
        k, m = 1 + j % 3, 1 + (j + 1) % 3
        c[0] += (G[0, 0] * G[1, j] - G[0, j] * G[1, 0]) * (G[2, k] * G[3, m] - G[2, m] * G[3, k])
        c[0] += (G[0, k] * G[1, m] - G[0, m] * G[1, k]) * (G[2, 0] * G[3, j] - G[2, j] * G[3, 0])
