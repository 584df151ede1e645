"""The two rocking modes of a small rattle, in the variables of `stiff.slip` (`sweep.models.theory.modes`).

By the averaged equations (ndotab, abdot), a mode of energy E_k changes the spin by d α²/2 in total while it decays or
grows, where d is the distance of n from the critical spin of the mode, and α = sqrt(2 E_k / J33)/d is called the *size*
of the mode.  This neglects terms of order α⁴ d in spin, and terms of order α_j³ by which mode j changes the other.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from sweep.models.general import rigid_body
from sweep.models.general.reversal_time import growth
from sweep.models.model import Array, Columns, Model, stack
from sweep.models.stiff.form import StiffForm
from sweep.models.theory import linear
from sweep.models.theory.modes import Equations, Modes, modes_at, quadratic
from sweep.models.theory.rocking import frequencies

RATTLE = (0, 1, 2, 3, 5, 6)
"""Indices of the states that vanish in upright spin; the remaining one is then M3 = -J33 n."""

# Decay rate of the slip, in sqrt(g/h), above which friction counts as stopping the slip fast compared with the rattle.
_SLIP_DECAY = 0.3

# With a couple, whose effect on the spin is subtracted, quadratic forms are evaluated at a larger amplitude, because of
# round-off.
_SMALL, _WITH_COUPLES = 1e-8, 1e-5


@dataclass(frozen=True)
class Rattle:
    """Rattles resolved into their rocking modes, x = 2 Re Σ_k R_k z_k; arrays over the cells."""

    sound: Array
    """True where there are two rocking modes into which the rattle can be resolved, shape (cells,)."""
    modes: Modes
    """R_1, R_2 and their conjugates; the mode of lower frequency is the first."""
    readings: Array
    """The matrix in z = readings (u1, u2, M1, M2), shape (cells, 2, 4).  It does not use the slip, because it is
    also applied to derivatives, and a history has no derivative of the slip."""
    amplitudes: Array
    """Amplitudes z, shape (cells, 2)."""
    inertia: Array
    """J33, shape (cells,)."""
    form: StiffForm
    """The model."""

    @classmethod
    def of(cls, form: StiffForm, states: Array, constants: Any) -> Rattle:
        """Resolve states of `form`, shape (7, cells), into modes; all states except the spin have to be small."""
        spin, _, inertia = form.model.energy(states, constants)
        of_full = modes_at(form.full, constants, spin)
        upright = stack(form.full.upright(spin))
        to_momentum = linear.derivative(lambda y: form.momentum(y, constants), upright, RATTLE)
        rates, vectors = of_full.rates[:, :2], to_momentum @ of_full.vectors[:, :, :2]
        pairs = np.concatenate([vectors, vectors.conj()], axis=2)
        modes = Modes(
            np.concatenate([rates, rates.conj()], axis=1), pairs, -inertia * spin, _equations(form), constants
        )  # fmt: skip
        # Fast spin may make the energy of a mode negative.
        sound = rocks(form, of_full) & (modes.energies > 0).all(axis=1) & (np.abs(np.linalg.det(pairs[:, :4])) > 0)
        readings = np.linalg.inv(np.where(sound[:, None, None], pairs[:, :4], np.eye(4)))[:, :2]
        amplitudes = (readings @ states[list(RATTLE[:4])].T[..., None])[..., 0]
        return cls(sound, modes, readings, amplitudes, inertia, form)

    @property
    def rates(self) -> Array:
        """Eigenvalues λ with positive imaginary part, in sqrt(g/c), shape (cells, 2)."""
        return self.modes.rates[:, :2]

    @property
    def slopes(self) -> Array:
        """d Re λ_k / dn from the effect of the mode on the spin alone, as (abdot) gives it, shape (cells, 2)."""
        return np.asarray(self.modes.turns / (self.unit_energies * self.inertia[:, None]))

    @property
    def unit_energies(self) -> Array:
        """2 E_k / J33 for z_k = 1, averaged over a period, shape (cells, 2); 1 where it is negative."""
        return np.where(self.modes.energies > 0, self.modes.energies, 1.0)

    def select(self, cells: Array) -> Rattle:
        """Select the rattles of the cells given by a mask or by indices."""
        readings, amplitudes, inertia = (each[cells] for each in (self.readings, self.amplitudes, self.inertia))
        return Rattle(self.sound[cells], self.modes.select(cells), readings, amplitudes, inertia, self.form)

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
        grown = ((factors - 1) * amplitudes)[..., None]
        return np.asarray(2 * (self.modes.vectors[:, :, :2] @ grown)[..., 0].real)

    def turn(self, amplitudes: Array) -> Array:
        """M3' for a rattle with these amplitudes, shape (cells,)."""
        return quadratic(self.modes.turning, _with_conjugates(amplitudes))

    def turned(self, amplitudes: Array) -> Array:
        """The part of M3 that appears and vanishes with a rattle of these amplitudes, shape (cells,)."""
        return quadratic(self.modes.turned, _with_conjugates(amplitudes))


def rocks(form: StiffForm, modes: Modes) -> Array:
    """Return whether there are two rocking modes, and slip that is stopped fast, shape (cells,).

    With little friction the slip oscillates slowly, which two modes do not describe: at μ = 1e-3 neglecting it cost
    3e-7 in spin.
    """
    fast = modes.rates[:, 4:].real < -_SLIP_DECAY * form.unit(modes.constants)[:, None]
    return np.asarray(fast.all(axis=1) & (modes.rates[:, :2].imag > 0).all(axis=1))


def _equations(form: StiffForm) -> Equations:
    nonstiff, small = form.nonstiff, _WITH_COUPLES if form.full.variant.couples else _SMALL
    return Equations(form.model.energy, lambda y, p: nonstiff(*y, p)[0][4], form.model.spin_state, small)


def _with_conjugates(amplitudes: Array) -> Array:
    return np.concatenate([amplitudes, amplitudes.conj()], axis=1)


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
