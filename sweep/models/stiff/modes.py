"""Small rattle about upright spin as a sum of its two rocking modes, in the variables of `stiff.slip`.

At a constant spin n, and to first order in the rattle x = (u1, u2, M1, M2, v1, v2),

    x = 2 Re Σ_k R_k z_k,   z_k' = λ_k z_k.

To second order the rattle changes the spin: M3' = Σ B_jk z_j z_k, summed over the modes and their conjugates.  So
M3 - Σ B_jk z_j z_k / (λ_j + λ_k) remains constant, whatever becomes of the z_k.

By the averaged equations (ndotab, abdot), a mode of energy E_k changes the spin by d α²/2 in total while it decays or
grows, where d is the distance of n from the critical spin of the mode, and α = sqrt(2 E_k / J33)/d is called the *size*
of the mode.  This neglects terms of order α⁴ d in spin, and terms of order α_j³ by which mode j changes the other.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np

from sweep.models.general import rigid_body
from sweep.models.general.reversal_time import growth
from sweep.models.model import Array, Columns, Model, stack, take
from sweep.models.stiff.form import StiffForm
from sweep.models.theory import linear
from sweep.models.theory.rocking import frequencies

RATTLE = (0, 1, 2, 3, 5, 6)
"""Indices of the states that vanish in upright spin; the remaining one is then M3 = -J33 n."""

# Decay rate of the slip, in sqrt(g/h), above which friction counts as stopping the slip fast compared with the rattle.
SLIP_DECAY = 0.3

# Amplitude at which quadratic forms are evaluated: the neglected terms are its square.  With a couple, whose effect on
# the spin is subtracted, it is larger, because of round-off.
_SMALL, _WITH_COUPLES = 1e-8, 1e-5


@dataclass(frozen=True)
class Rattle:
    """Rattles resolved into modes, the one of lower frequency first; arrays over the cells."""

    sound: Array
    """True where there are two rocking modes into which the rattle can be resolved, shape (cells,)."""
    rates: Array
    """Eigenvalues λ with positive imaginary part, in sqrt(g/c), shape (cells, 2)."""
    modes: Array
    """Right eigenvectors R as columns, shape (cells, 6, 2)."""
    readings: Array
    """The matrix in z = readings (u1, u2, M1, M2), shape (cells, 2, 4).  It does not use the slip, because it is
    also applied to derivatives, and a history has no derivative of the slip."""
    amplitudes: Array
    """Amplitudes z, shape (cells, 2)."""
    unit_energies: Array
    """2 E_k / J33 for z_k = 1, averaged over a period, in units of spin², shape (cells, 2)."""
    slopes: Array
    """d Re λ_k / dn from the effect of the mode on the spin alone (the form that (abdot) gives), shape (cells, 2)."""
    upright: Array
    """M3 in upright spin with the same n, shape (cells,)."""
    form: StiffForm
    """The model."""
    constants: Any
    """Constants of the model."""

    @classmethod
    def of(cls, form: StiffForm, states: Array, constants: Any) -> Rattle:
        """Resolve states of `form`, shape (7, cells), into modes; all states except the spin have to be small."""
        spin, _, inertia = form.model.energy(states, constants)
        rates, modes, sound = _rocking(form, constants, spin)
        pairs = np.concatenate([modes[:, :4], modes[:, :4].conj()], axis=2)
        sound &= np.abs(np.linalg.det(pairs)) > 0
        pairs[~sound] = np.eye(4)
        readings = np.linalg.inv(pairs)[:, :2]
        amplitudes = (readings @ states[list(RATTLE[:4])].T[..., None])[..., 0]
        upright = -inertia * spin
        unit, turn = _unit_energies_and_turns(form, modes, upright, constants, sound)
        slopes = turn / (unit * inertia[:, None])
        return cls(sound, rates, modes, readings, amplitudes, unit, slopes, upright, form, constants)

    def select(self, cells: Array) -> Rattle:
        """Select the rattles of the cells given by a mask or by indices."""
        arrays = {f.name: getattr(self, f.name)[cells] for f in fields(self) if f.name not in ("form", "constants")}
        return Rattle(form=self.form, constants=take(self.constants, cells), **arrays)

    @cached_property
    def turning(self) -> Array:
        """B over the modes and their conjugates, in the order R_1, R_2, R_1*, R_2*, shape (cells, 4, 4)."""
        return _turning(self.form, self.modes, self.upright, self.constants)

    def distances(self) -> Array:
        """Distance d of the spin from the critical spin of each mode, in sqrt(g/c), shape (cells, 2).

        It is infinite for a mode that has no effect on the spin.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self.slopes == 0, np.inf, np.abs(self.rates.real / self.slopes))

    def sizes(self, bending: Array) -> Array:
        """Sizes α of the modes (see the module), shape (cells, 2).

        Where the other nonlinearities (see `bending`) change a mode more than its effect on the spin does, the size
        is a measure of these instead.
        """
        with np.errstate(divide="ignore"):
            steepest = np.maximum(1 / self.distances(), np.sqrt(bending)[:, None])
        return np.asarray(np.abs(self.amplitudes) * np.sqrt(self.unit_energies) * steepest)

    def changes(self, factors: Array, amplitudes: Array) -> Array:
        """Change of the rattle x, shape (cells, 6), when `amplitudes` grow by `factors`, both of shape (cells, 2)."""
        return np.asarray(2 * (self.modes @ ((factors - 1) * amplitudes)[..., None])[..., 0].real)

    def turn(self, amplitudes: Array) -> Array:
        """M3' for a rattle with these amplitudes, shape (cells,)."""
        return _form(self.turning, amplitudes)

    def rippled(self, amplitudes: Array) -> Array:
        """The ripple of M3 due to a rattle of these amplitudes, without the slow change, shape (cells,)."""
        slow = np.roll(np.eye(4, dtype=bool), 2, axis=1)  # a mode and its own conjugate
        return _form(np.where(slow, 0, self._turned), amplitudes)

    def turned(self, amplitudes: Array) -> Array:
        """The part of M3 that appears and vanishes with a rattle of these amplitudes, shape (cells,)."""
        return _form(self._turned, amplitudes)

    @property
    def _turned(self) -> Array:
        rates = np.concatenate([self.rates, self.rates.conj()], axis=1)
        return np.asarray(self.turning / (rates[:, :, None] + rates[:, None, :]))


def slow_rates(form: StiffForm, constants: Any, spin: Array) -> tuple[Array, Array, Array]:
    """`rates`, `slopes` and `sound` of `Rattle` at a spin, without a rattle."""
    rates, modes, sound = _rocking(form, constants, spin)
    unit, turn = _unit_energies_and_turns(form, modes, -constants.J33 * spin, constants, sound)
    return rates, turn / (unit * constants.J33[:, None]), sound


def bending(model: Model, columns: Columns) -> Array:
    """Bound on how nonlinear a rattle of e = 2 E / J33 = 1 makes the motion, shape (cells,).

    The measure is its part in the normal force.  For rocking about one axis R - g = k φ'² with φ'² = J33 e / (J + h²),
    the stiffness k and the height h of the centre of mass.
    """
    p, surface = rigid_body.constants(columns, model.variant.surface), model.variant.surface
    k11, _, k22, h = surface.stiffness(p)
    return np.asarray(p.J33 / p.g * np.maximum(k11 / (p.J22 + h**2), k22 / (p.J11 + h**2)))


def fastest_growth(model: Model, columns: Columns, reach: Array) -> Array:
    """Bound on |Re λ| of the modes at spins up to `reach`, shape (cells,).

    The spin adds σ n (`sweep.models.general.reversal_time`).  The slip that a mode of frequency ν needs at rest,
    h ν ω/(μ g), takes the power h² ν² ω²/(μ g) of its energy, which is J_P ω²/2.
    """
    surface = model.variant.surface
    p = rigid_body.constants(columns, surface)
    h, (_, faster) = rigid_body.height(columns), frequencies(rigid_body.rocking(columns, surface))
    with np.errstate(divide="ignore"):
        slip = (h * faster) ** 2 / (columns["mu"] * p.g * (np.minimum(p.J11, p.J22) + h**2))
    return np.asarray(np.abs(growth(columns, surface)).max(axis=0) * reach + slip)


def _rocking(form: StiffForm, constants: Any, spin: Array) -> tuple[Array, Array, Array]:
    """Rates and modes, as in `Rattle`, and whether there are two rocking modes, shape (cells,)."""
    rates, modes = np.linalg.eig(linear.jacobian(form.full, constants, spin))
    # With little friction the slip is not stopped fast, but oscillates slowly, which these two modes do not describe:
    # at μ = 1e-3 neglecting it cost 3e-7 in spin.
    falling = np.argsort(-rates.imag, axis=1)
    fast = np.take_along_axis(rates.real, falling[:, 2:4], axis=1) < -SLIP_DECAY * form.unit(constants)[:, None]
    order = falling[:, 1::-1]
    rates = np.take_along_axis(rates, order, axis=1)
    modes = np.take_along_axis(modes, order[:, None, :], axis=2).astype(complex)
    upright = stack(form.full.upright(spin))
    to_momentum = linear.derivative(lambda y: form.momentum(y, constants), upright, RATTLE)
    return rates, to_momentum @ modes, np.asarray(fast.all(axis=1) & (rates.imag > 0).all(axis=1))


def _small(form: StiffForm) -> float:
    return _WITH_COUPLES if form.full.variant.couples else _SMALL


def _turning(form: StiffForm, modes: Array, upright: Array, constants: Any) -> Array:
    """B by polarisation: B(x, y) = (M3'(x + y) - M3'(x - y))/4."""
    small = _small(form)
    both = np.moveaxis(np.concatenate([modes, modes.conj()], axis=2), 0, -1) * small
    one, other = both[:, :, None], both[:, None, :]
    forms = []
    for rattle in (one + other, one - other):
        slopes, _ = form.slow(*np.insert(rattle, 4, upright, axis=0), constants)
        forms.append(slopes[4])
    return np.asarray(np.moveaxis((forms[0] - forms[1]) / (4 * small**2), -1, 0))


def _unit_energies_and_turns(
    form: StiffForm, modes: Array, upright: Array, constants: Any, sound: Array
) -> tuple[Array, Array]:
    """2 E / J33 and M3' of each mode at z = 1, averaged over a period, each of shape (cells, 2).

    It clears `sound` where fast spin makes the energy of a mode negative, and takes 1 for that.
    """
    energies = turns = np.zeros((modes.shape[2], len(upright)))
    slowed, small = slowing(form, upright, constants), _small(form)
    for part in (modes.real, modes.imag):
        states = np.insert(np.moveaxis(part, 0, -1) * small, 4, upright, axis=0)
        _, rattle, inertia = form.model.energy(states, constants)
        energies = energies + 4 * rattle / inertia / small**2
        turns = turns + 2 * (form.slow(*states, constants)[0][4] - slowed) / small**2
    sound &= (energies > 0).all(axis=0)
    return np.where(energies > 0, energies, 1.0).T, turns.T


def slowing(form: StiffForm, upright: Array, constants: Any) -> Array:
    """M3' in upright spin, by couples alone, shape (cells,)."""
    rest = np.zeros_like(upright)
    if not form.full.variant.couples:
        return rest
    slopes, _ = form.slow(rest, rest, rest, rest, upright, rest, rest, constants)
    return np.asarray(slopes[4])


def _form(matrix: Array, amplitudes: Array) -> Array:
    """The quadratic form of `matrix` over the amplitudes and their conjugates, shape (cells,)."""
    z = np.concatenate([amplitudes, amplitudes.conj()], axis=1)
    return np.asarray((z[:, None, :] @ matrix @ z[:, :, None])[:, 0, 0].real)
