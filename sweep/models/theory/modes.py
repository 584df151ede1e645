"""A small rattle about upright spin as a sum of modes, from the equations of a model themselves.

At a constant spin, and to first order in the rattle x, which are all states but that of the spin,

    x = Σ_k R_k z_k,   z_k' = λ_k z_k.

To second order the rattle changes the state of the spin, s' = Σ B_jk z_j z_k, so that s - Σ B_jk z_j z_k / (λ_j + λ_k)
remains constant, whatever becomes of the z_k.  A model with slip has two rocking modes, which come first, with their
conjugates; the others are the decay of the slip.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from sweep.models.model import Array, Model, stack, take
from sweep.models.theory.linear import jacobian


class Equations(NamedTuple):
    """The equations in whose variables a rattle is resolved: those of a model, or its stiff form."""

    energy: Callable[..., Any]
    """As `Model.energy`."""
    turn: Callable[[Any, Any], Any]
    """(states, constants) -> the derivative of the state of the spin."""
    spin_state: int
    small: float = 1e-8
    """Amplitude at which quadratic forms are evaluated: the neglected terms are its square."""


@dataclass(frozen=True)
class Modes:
    """Modes at a spin; arrays over the cells."""

    rates: Array
    """Eigenvalues λ, in sqrt(g/c), shape (cells, modes)."""
    vectors: Array
    """Eigenvectors R as columns, shape (cells, m, modes), where m is the number of states without the spin."""
    upright: Array
    """The state of the spin in upright spin, shape (cells,)."""
    equations: Equations
    constants: Any

    @cached_property
    def energies(self) -> Array:
        """2 E_k / J for the real rattle 2 Re R_k, averaged over a period, in units of spin², for both rocking modes."""
        energies = np.zeros((2, len(self.upright)))
        for part in self._quarters:
            _, rattle, inertia = self.equations.energy(tuple(self._states(part)), self.constants)
            energies += 4 * rattle / inertia / self.equations.small**2
        return energies.T

    @cached_property
    def turns(self) -> Array:
        """s' for the same rattle, averaged over a period, and without the effect of couples, shape (cells, 2)."""
        turns, by_couples = np.zeros((2, len(self.upright))), self._turn(0 * self._quarters[0])
        for part in self._quarters:
            turns += 2 * (self._turn(part) - by_couples) / self.equations.small**2
        return turns.T

    @cached_property
    def turning(self) -> Array:
        """B, shape (cells, modes, modes), by polarisation: B(x, y) = (s'(x + y) - s'(x - y))/4."""
        small = self.vectors * self.equations.small
        one, other = small[:, :, :, None], small[:, :, None, :]
        difference = self._turn(one + other) - self._turn(one - other)
        return np.asarray(np.moveaxis(difference / (4 * self.equations.small**2), -1, 0))

    @cached_property
    def turned(self) -> Array:
        """The form B_jk / (λ_j + λ_k), by which the state of the spin appears and vanishes with a rattle."""
        return np.asarray(self.turning / (self.rates[:, :, None] + self.rates[:, None, :]))

    def of_unit_energy(self) -> Array:
        """Return the vectors with 2 E_k / J = 1 for both rocking modes, shape (cells, m, modes)."""
        E = self.vectors.astype(complex)
        with np.errstate(invalid="ignore", divide="ignore"):  # fast spin may make an energy negative
            E[:, :, :2] /= np.sqrt(self.energies)[:, None]
        E[:, :, 2:4] = E[:, :, :2].conj()
        return np.ascontiguousarray(E)

    def select(self, cells: Array) -> Modes:
        """Select the modes of the cells given by a mask or by indices."""
        rates, vectors, upright = (each[cells] for each in (self.rates, self.vectors, self.upright))
        return Modes(rates, vectors, upright, self.equations, take(self.constants, cells))

    @property
    def _quarters(self) -> tuple[Array, Array]:
        """Half of a small rattle in each rocking mode, at two times that are a quarter of a period apart."""
        small = self.vectors[:, :, :2] * self.equations.small
        return small.real, small.imag

    def _turn(self, rattle: Array) -> Array:
        return np.asarray(self.equations.turn(tuple(self._states(rattle)), self.constants))

    def _states(self, rattle: Array) -> Array:
        """Return the states of rattles of shape (cells, m, …) in upright spin; the cells come last."""
        return np.insert(np.moveaxis(rattle, 0, -1), self.equations.spin_state, self.upright, axis=0)


def modes_at(model: Model, constants: Any, spin: Array) -> Modes:
    """Find all modes of a model: the slower rocking, the faster one, their conjugates, and the others.

    Parameters
    ----------
    spin : shape (cells,)
    """
    rates, vectors = np.linalg.eig(jacobian(model, constants, spin))
    size = rates.shape[1]
    order = np.argsort(-rates.imag, axis=1)[:, [1, 0, size - 2, size - 1, *range(2, size - 2)]]
    rates, vectors = np.take_along_axis(rates, order, axis=1), np.take_along_axis(vectors, order[:, None, :], axis=2)
    upright, spin_state, rhs = stack(model.upright(spin))[model.spin_state], model.spin_state, model.rhs
    equations = Equations(model.energy, lambda y, p: rhs(y, p)[0][spin_state], spin_state)
    return Modes(rates, vectors.astype(complex), upright, equations, constants)


def resting_spin(model: Model, constants: Any, states: Array) -> Array:
    """Return the spin that remains when the rattle has decayed at its present rates, in sqrt(g/c), shape (cells,).

    It is exact to second order in the rattle, except for the change of the modes with the spin.  NaN where a mode does
    not decay.

    Parameters
    ----------
    states : of `model`, shape (states, cells)
    """
    spin, _, _ = model.energy(tuple(states), constants)
    modes = modes_at(model, constants, spin)
    rattle = np.delete(states, model.spin_state, axis=0).T
    z = np.linalg.solve(modes.vectors, rattle[..., None])[..., 0]
    end = (states[model.spin_state] - quadratic(modes.turned, z)) * model.upright(1.0)[model.spin_state]
    return np.asarray(np.where(modes.rates.real.max(axis=1) < 0, end, np.nan))


def quadratic(matrix: Array, amplitudes: Array) -> Array:
    """Evaluate a quadratic form of amplitudes, of shape (cells, modes), for a real rattle; shape (cells,)."""
    return np.asarray((amplitudes[:, None, :] @ matrix @ amplitudes[:, :, None])[:, 0, 0].real)
