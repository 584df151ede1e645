"""A small rattle about steady upright spin, from the right-hand side of a model itself.

At constant n it obeys a linear system.  `sweep.models.theory.stability` finds the spins at which it grows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from sweep.models.model import Array, Columns, Model, stack

# Amplitude at which the change of the spin is evaluated: the terms beyond its quadratic form are 1e-16 of it.
_SMALL = 1e-8

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


def growth_rate(model: Model, constants, spin: Array) -> Array:
    """Largest real part of the rattle's eigenvalues, in sqrt(g/c), shape (cells,): positive where the rattle grows."""
    return np.asarray(np.linalg.eigvals(jacobian(model, constants, spin)).real.max(axis=-1))


def resting_spin(model: Model, constants, states: Array) -> Array:
    """Return the spin that remains when the rattle has decayed at its present rates, in sqrt(g/c), shape (cells,).

    With the rattle x in the modes of x' = A x, and the spin's state changing by the quadratic form Q of x, the integral
    of Q is -Σ Q_jk z_j z_k/(λ_j + λ_k) over all pairs of modes: exact to second order in x, except for the change of A
    with the spin.  NaN where a mode does not decay.

    Parameters
    ----------
    states : of `model`, shape (states, cells)
    """
    spin, _, _ = model.energy(tuple(states), constants)
    rattle = [i for i in range(len(model.states)) if i != model.spin_state]
    rates, modes = np.linalg.eig(jacobian(model, constants, spin))
    amplitudes = np.linalg.solve(modes, states[rattle].T[..., None])[..., 0]
    pairs = amplitudes[:, :, None] * amplitudes[:, None, :] / (rates[:, :, None] + rates[:, None, :])
    change = -(pairs * _form(model, constants, spin, modes)).sum(axis=(1, 2)).real
    end = (states[model.spin_state] + change) * model.upright(1.0)[model.spin_state]
    return np.asarray(np.where(rates.real.max(axis=1) < 0, end, np.nan))


def _form(model: Model, constants, spin: Array, modes: Array) -> Array:
    """Return how rattles in `modes` change the spin's state, a quadratic form, by polarisation; shape (cells, m, m)."""
    rattle = [i for i in range(len(model.states)) if i != model.spin_state]
    upright, vectors = stack(model.upright(spin)).astype(complex)[:, None, None], np.moveaxis(modes, 0, -1)
    found = []
    for both in (vectors[:, :, None] + vectors[:, None, :], vectors[:, :, None] - vectors[:, None, :]):
        states = np.repeat(np.repeat(upright, modes.shape[2], axis=1), modes.shape[2], axis=2)
        states[rattle] += _SMALL * both
        found.append(model.rhs(tuple(states), constants)[0][model.spin_state])
    return np.moveaxis((found[0] - found[1]) / (4 * _SMALL**2), -1, 0)


def rocking_rates(model: Model, constants, spin: Array) -> Array:
    """Re λ of the two modes of highest frequency, the slower first, in sqrt(g/c), shape (2, cells).

    In a model with slip these are the two rocking modes.
    """
    values = np.linalg.eigvals(jacobian(model, constants, spin))
    order = np.argsort(-values.imag, axis=1)[:, 1::-1]
    return np.take_along_axis(values.real, order, axis=1).T


def fastest_motion(model: Model, columns: Columns) -> Array:
    """Largest |λ| of the rattle at the fastest spins within reach, leaving out the fast decay due to friction.

    This is the motion that an integrator has to follow, in sqrt(g/c), shape (cells,); 0 where nothing moves.  A model
    may define it itself.
    """
    if model.fastest_motion:
        return model.fastest_motion(columns)
    reach = fastest_spin(model, columns)
    values = np.concatenate(
        [
            np.linalg.eigvals(jacobian(model, model.constants.of(extreme), spin))
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

_FIT = np.linalg.inv(NODES[:, None] ** np.arange(len(NODES)))


def through_nodes(values: Array) -> Array:
    """Coefficients of the polynomials through values at `NODES`, lowest power first, along a first axis.

    This is not a matrix product, because the rounding of a cell by BLAS depends on the number of cells.
    """
    return np.stack([sum(w * each for w, each in zip(row, values, strict=True)) for row in _FIT])
