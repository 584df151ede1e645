"""A small rattle about steady upright spin, from the right-hand side of a model itself.

At constant n it obeys a linear system.  `sweep.models.theory.modes` resolves it, and `sweep.models.theory.stability`
finds the spins at which it grows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from sweep.models.model import Array, Columns, Model, stack, take
from sweep.models.theory.polynomials import Polynomial, values_and_slopes

# Columns of a Jacobian that are computed in one call, times cells: few calls for few cells, and many stay in the cache.
_TOGETHER = 1024


def jacobian(model: Model, constants, spin: Array) -> Array:
    """Jacobian of the rattle at upright spin, shape (cells, m, m), where m is the number of states without the spin."""
    rattle = [i for i in range(len(model.states)) if i != model.spin_state]
    return derivative(lambda y: model.rhs(y, constants)[0], stack(model.upright(spin)), rattle)


def derivative(function: Callable[[Array], tuple[Array, ...]], states: Array, which: Sequence[int]) -> Array:
    """Derivatives of the components `which` of a function by the same states, shape (cells, m, m).

    They are computed by complex steps of 1e-30: accurate to the last digit, because no difference is taken, and without
    deriving the equations a second time.
    """
    columns, states, some = [], states.astype(complex)[:, None], list(which)
    together = max(1, _TOGETHER // max(1, states.shape[2]))
    for first in range(0, len(some), together):
        shifts = some[first : first + together]
        shifted = np.repeat(states, len(shifts), axis=1)
        shifted[shifts, np.arange(len(shifts))] += 1e-30j
        columns.append(stack(function(shifted))[some].imag / 1e-30)
    return np.moveaxis(np.concatenate(columns, axis=1), -1, 0)


def rates(model: Model, constants, spin: Array) -> Array:
    """Find the eigenvalues λ of the rattle, in sqrt(g/c), shape (cells, m), where m is the number of states without the
    spin.

    They are the roots of the characteristic polynomial; if a model has none, or its roots cannot be found with
    certainty, they are the eigenvalues of the Jacobian.
    """
    if not model.characteristic:
        return np.asarray(np.linalg.eigvals(jacobian(model, constants, spin)))
    found, sound = _roots(stack(model.characteristic(spin, constants)))
    others = np.flatnonzero(~sound)
    if len(others):
        found[others] = np.linalg.eigvals(jacobian(model, take(constants, others), spin[others]))
    return found


# Newton's steps to the frequencies, the least share by which they are taken to differ at first, and that by which they
# have to differ in the end, and the error relative to each coefficient with which the roots have to reproduce the
# polynomial.
_STEPS, _APART, _ALIKE, _EXACT = 6, 0.02, 1e-3, 1e-12


@np.errstate(all="ignore")
def _roots(polynomial: Array) -> tuple[Array, Array]:
    """Return the roots of real polynomials of sixth degree, shape (cells, 6), and whether they are right.

    The first two have positive imaginary parts.  They begin at the frequencies without slip, as where friction is
    strong, and repel each other and the conjugate ones (Aberth's method).  The other two are what is left.
    """
    c = polynomial / polynomial[6]
    half = c[2] / (2 * c[4])
    split = np.sqrt(np.maximum(half**2 - c[0] / c[4], (_APART * half) ** 2))
    z = 1j * np.sqrt(np.stack([half - split, half + split]))
    for _ in range(_STEPS):
        value, slope = values_and_slopes(c[:, None], z)
        step, other = value / slope, z[::-1]
        z = z - step / (1 - step * (1 / (z - other) + 1 / (z - other.conj()) - 0.5j / z.imag))
    p, q = -2 * z.real, z.real**2 + z.imag**2  # of λ² + p λ + q
    p, q = (*p, c[5] - p.sum(axis=0)), (*q, c[0] / (q[0] * q[1]))
    root = np.sqrt((p[2] ** 2 / 4 - q[2]).astype(complex))
    one, two, three = (Polynomial(np.stack([q[i], p[i], np.ones_like(half)])) for i in range(3))
    again = (one * two * three).coefficients[1:5]
    found = np.stack([*z, *z.conj(), -p[2] / 2 + root, -p[2] / 2 - root], axis=1)
    apart = np.abs(z[0] - z[1]) > _ALIKE * np.abs(z[0])
    return found, np.asarray((np.abs(again / c[1:5] - 1) < _EXACT).all(axis=0) & apart)


def growth_rate(model: Model, constants, spin: Array) -> Array:
    """Largest real part of the rattle's eigenvalues, in sqrt(g/c), shape (cells,): positive where the rattle grows."""
    return np.asarray(rates(model, constants, spin).real.max(axis=-1))


def rocking_rates(model: Model, constants, spin: Array) -> Array:
    """Re λ of both rocking modes, the slower first, in sqrt(g/c), shape (2, cells)."""
    values = rates(model, constants, spin)
    order = np.argsort(-values.imag, axis=1)[:, 1::-1]
    return np.take_along_axis(values.real, order, axis=1).T


def fastest_motion(model: Model, columns: Columns) -> Array:
    """Largest |λ| of the rattle at the fastest spins within reach, leaving out the fast decay due to friction.

    This is the motion that an integrator has to resolve, in sqrt(g/c), shape (cells,); 0 where nothing moves.  A model
    may define it itself.
    """
    if model.fastest_motion:
        return model.fastest_motion(columns)
    reach = fastest_spin(model, columns)
    values = np.concatenate(
        [
            rates(model, model.constants.of(extreme), spin)
            for extreme in model.extremes(columns)
            for spin in (reach, -reach)
        ],
        axis=-1,
    )
    moving = -values.real <= np.abs(values.imag)
    return np.asarray(np.where(moving, np.abs(values), 0.0).max(axis=-1))


def fastest_spin(model: Model, columns: Columns) -> Array:
    """The |spin| that a trajectory would reach if all its energy went into the spin, in sqrt(g/c), shape (cells,).

    It is 0 where the energy is less than at rest.
    """
    spin, rattle, inertia = model.energy(model.start(columns), model.constants.of(columns))
    return np.asarray(np.sqrt(np.maximum(spin**2 + 2 * rattle / inertia, 0.0)))


NODES = np.array([0.0, -1.0, 1.0, -0.5, 0.5])
"""Spins through which `through_nodes` fits a polynomial, in units of the fastest spin within reach.

With three spins, rates were off by half at b = 6, where the modes nearly meet.
"""

FIT = np.linalg.inv(NODES[:, None] ** np.arange(len(NODES)))
"""Takes values at `NODES` to the coefficients of the polynomial through them, lowest power first."""


def through_nodes(values: Array) -> Array:
    """Coefficients of the polynomials through values at the first `NODES`, lowest power first, along a first axis.

    This is not a matrix product, because the rounding of a cell by BLAS depends on the number of cells.
    """
    n = len(values)
    fit = FIT if n == len(NODES) else np.linalg.inv(NODES[:n, None] ** np.arange(n))
    return np.stack([sum(w * each for w, each in zip(row, values, strict=True)) for row in fit])
