"""Small rattle about upright spin as a sum of its two rocking modes, in the variables of `slip_split`.

x = 2 Re Σ_k R_k z_k with z_k' = λ_k z_k, to first order in the rattle x = (u1, u2, M1, M2, v1, v2), at a constant
spin n.  To second order the rattle turns the spin: M3' = Σ B_jk z_j z_k over the modes and their conjugates,
so that M3 - Σ B_jk z_j z_k / (λ_j + λ_k) stays as it is, whatever becomes of the z_k.

A mode of amplitude z_k, by the averaged equations (ndotab, abdot), turns the spin by d α²/2 in all while it
decays or grows: α = sqrt(2 E_k / I3)/d is its *size*, d the distance of n from the mode's critical spin.
What stays out of account is of the order α⁴ d in spin, and α_j³ where mode j bends the other.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from sweep.models import averaged, ellipsoid, linear, slip
from sweep.models.model import Array, Columns, stack
from sweep.models.slip_split import SPLIT, momentum, slip_constants, slow

RATTLE = (0, 1, 2, 3, 5, 6)
"""Indices of the states that vanish in upright spin; the other is M3 = -I3 n."""

# Rate, in sqrt(g/c), from which on friction stops the slip quickly beside what the rattle does.
_SLIP_DECAY = 0.3

# Where quadratic forms are evaluated: what they leave out is 1e-16 of them.
_SMALL = 1e-8


@dataclass(frozen=True)
class Rattle:
    """Rattles resolved into modes, the slower first; arrays over cells."""

    sound: Array
    """Whether there are two rocking modes to be resolved into, shape (cells,)."""
    rates: Array
    """Eigenvalues λ with positive imaginary part, shape (cells, 2), in sqrt(g/c)."""
    modes: Array
    """Right eigenvectors R as columns, shape (cells, 6, 2)."""
    readings: Array
    """z = readings (u1, u2, M1, M2): without the slip, which a history does not keep.  Shape (cells, 2, 4)."""
    amplitudes: Array
    """z, shape (cells, 2)."""
    unit_energies: Array
    """2 E_k / I3 of z_k = 1, averaged over a period, in units of spin², shape (cells, 2)."""
    slopes: Array
    """d Re λ_k / dn by the turning alone (the form (abdot) gives it), shape (cells, 2)."""
    upright: Array
    """M3, shape (cells,)."""
    constants: Array
    """Of the model, shape (cells, constants)."""

    @classmethod
    def of(cls, states: Array, constants: Array) -> Rattle:
        """Resolve `states` of the split form, shape (7, cells), which must be small but for the spin."""
        spin, _, inertia = SPLIT.energy(states, constants)
        rates, modes, sound = _rocking(constants, spin)
        pairs = np.concatenate([modes[:, :4], modes[:, :4].conj()], axis=2)
        sound &= np.abs(np.linalg.det(pairs)) > 0
        pairs[~sound] = np.eye(4)
        readings = np.linalg.inv(pairs)[:, :2]
        amplitudes = (readings @ states[list(RATTLE[:4])].T[..., None])[..., 0]
        upright = -inertia * spin
        unit, turn = _unit_energies_and_turns(modes, upright, constants)
        slopes = turn / (unit * inertia[:, None])
        return cls(sound, rates, modes, readings, amplitudes, unit, slopes, upright, constants.T)

    def select(self, cells: Array) -> Rattle:
        return Rattle(**{field.name: getattr(self, field.name)[cells] for field in fields(self)})

    @cached_property
    def turning(self) -> Array:
        """B, over modes and conjugates (R_1, R_2, R_1*, R_2*), shape (cells, 4, 4)."""
        return _turning(self.modes, self.upright, self.constants.T)

    def distances(self) -> Array:
        """Of the spin from each mode's critical spin, infinite for a mode that does not turn it, shape (cells, 2)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self.slopes == 0, np.inf, np.abs(self.rates.real / self.slopes))

    def sizes(self, bending: Array) -> Array:
        """α (see the module), or what bends a mode as much by the other nonlinearities; shape (cells, 2)."""
        with np.errstate(divide="ignore"):
            steepest = np.maximum(1 / self.distances(), np.sqrt(bending)[:, None])
        return np.asarray(np.abs(self.amplitudes) * np.sqrt(self.unit_energies) * steepest)

    def changes(self, factors: Array, amplitudes: Array) -> Array:
        """What the rattle x gains where `amplitudes` grow by `factors`; both and the result over (cells, modes)."""
        return np.asarray(2 * (self.modes @ ((factors - 1) * amplitudes)[..., None])[..., 0].real)

    def turn(self, amplitudes: Array) -> Array:
        """M3' for a rattle of these amplitudes, shape (cells,)."""
        return _form(self.turning, amplitudes)

    def turned(self, amplitudes: Array) -> Array:
        """The part of M3 that goes and comes with a rattle of these amplitudes, shape (cells,)."""
        rates = np.concatenate([self.rates, self.rates.conj()], axis=1)
        return _form(self.turning / (rates[:, :, None] + rates[:, None, :]), amplitudes)


def bending(columns: Columns) -> Array:
    """Bound on how much a rattle of e = 1 spin² bends the linear motion: its share of the normal force, shape (cells,).

    Rocking about one axis at the height c, R - 1 = (a² - c²)/c φ'² with φ'² = I3 e / (I + c²).
    """
    a, b, c = columns["a"], columns["b"], columns["c"]
    I1, I2, I3 = ellipsoid.inertia(columns)
    return np.asarray(I3 / c * np.maximum((a**2 - c**2) / (I2 + c**2), (b**2 - c**2) / (I1 + c**2)))


def fastest_growth(columns: Columns, reach: Array) -> Array:
    """Largest |Re λ| of the modes at spins up to `reach` by (abdot), in sqrt(g/c), shape (cells,)."""
    k1, k4, m1, m4, _ = averaged.constants(columns)
    return np.asarray(np.maximum(np.abs(k1) * reach + np.abs(m1), np.abs(k4) * reach + np.abs(m4)))


def _rocking(constants: Array, spin: Array) -> tuple[Array, Array, Array]:
    """Rates and modes as `Rattle` has them, and where there are two."""
    rates, modes = np.linalg.eig(linear.jacobian(slip.MODEL, slip_constants(constants), spin))
    # Without much friction the slip swings too, but slowly, and is not carried by these modes: with μ = 1e-3
    # leaving it out cost 3e-7 in spin.
    falling = np.argsort(-rates.imag, axis=1)
    gone = (np.take_along_axis(rates.real, falling[:, 2:4], axis=1) < -_SLIP_DECAY).all(axis=1)
    order = falling[:, 1::-1]
    rates = np.take_along_axis(rates, order, axis=1)
    modes = np.take_along_axis(modes, order[:, None, :], axis=2).astype(complex)
    return rates, _to_momentum(constants, spin) @ modes, np.asarray(gone & (rates.imag > 0).all(axis=1))


def _to_momentum(constants: Array, spin: Array) -> Array:
    """Jacobian of `momentum` over the rattle at upright spin, shape (cells, 6, 6)."""
    upright = stack(slip.upright(spin)).astype(complex)
    columns = []
    for i in RATTLE:
        shifted = upright.copy()
        shifted[i] += 1e-30j
        columns.append(stack(momentum(shifted, constants))[list(RATTLE)].imag / 1e-30)
    return np.moveaxis(np.stack(columns, axis=-1), 0, 1)


def _turning(modes: Array, upright: Array, constants: Array) -> Array:
    """B by polarisation: B(x, y) = (M3'(x + y) - M3'(x - y))/4."""
    both = np.moveaxis(np.concatenate([modes, modes.conj()], axis=2), 0, -1) * _SMALL
    one, other = both[:, :, None], both[:, None, :]
    forms = []
    for rattle in (one + other, one - other):
        slopes, _ = slow(*np.insert(rattle, 4, upright, axis=0), constants)
        forms.append(slopes[4])
    return np.asarray(np.moveaxis((forms[0] - forms[1]) / (4 * _SMALL**2), -1, 0))


def _unit_energies_and_turns(modes: Array, upright: Array, constants: Array) -> tuple[Array, Array]:
    """2 E / I3 and M3' of each mode at z = 1, averaged over a period, shape (cells, 2)."""
    energies = turns = np.zeros((modes.shape[2], len(upright)))
    for part in (modes.real, modes.imag):
        states = np.insert(np.moveaxis(part, 0, -1) * _SMALL, 4, upright, axis=0)
        _, rattle, inertia = SPLIT.energy(states, constants)
        energies = energies + 4 * rattle / inertia / _SMALL**2
        turns = turns + 2 * slow(*states, constants)[0][4] / _SMALL**2
    return energies.T, turns.T


def _form(matrix: Array, amplitudes: Array) -> Array:
    z = np.concatenate([amplitudes, amplitudes.conj()], axis=1)
    return np.asarray((z[:, None, :] @ matrix @ z[:, :, None])[:, 0, 0].real)
