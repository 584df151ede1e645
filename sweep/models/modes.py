"""Small rattle about upright spin as a sum of modes, each carried on by its own exponential.

As long as the rattle is tiny, z' = J(n) z with a constant spin n.  With e = 2 E/I3 the rattle's energy
in units of spin², products of the rattle that this leaves out

* turn the spin: by e/2d at the most until a mode that grows has reached e, d being the distance of n
  from its critical spin (averaged equations, ndotab, abdot);
* bend a mode: the share c e of its amplitude, c = `bending`, appears in the direction of the other
  and hides one that is weaker than that.  Round-off hides it likewise, from `_ROUND_OFF` on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sweep.models import ellipsoid, linear
from sweep.models.model import Array, Columns, Model

# Share of a strong mode that appears as the weak one when a state is resolved into modes.
_ROUND_OFF = 1e-14

# Stands for an energy of zero where its logarithm is asked for.
_ZERO = 1e-300

# Of the tolerance in spin, what the neglected turn of the spin may take at either end.
_TURN_SHARE = 0.1


@dataclass(frozen=True)
class Rattle:
    """Rattles resolved into modes; arrays over cells, with m modes of which two rock."""

    model: Model
    turning: Array
    """The state that carries the spin, shape (cells,)."""
    rates: Array
    """Eigenvalues, shape (cells, m), in sqrt(g/c)."""
    modes: Array
    """Right eigenvectors as columns, shape (cells, m, m)."""
    amplitudes: Array
    """Shape (cells, m)."""
    growth: Array
    """Of the energies of the two rocking modes, shape (2, cells), in sqrt(g/c)."""
    energies: Array
    """Of the two rocking modes, averaged over a period, in units of spin², shape (2, cells)."""

    @classmethod
    def of(cls, model: Model, states: Array, constants: Array) -> Rattle:
        """Resolve `states`, shape (states, cells), which must be small but for the spin."""
        spin, _, _ = model.energy(states, constants)
        rates, modes = np.linalg.eig(linear.jacobian(model, constants, spin))
        rattle, turning = np.delete(states, model.spin_state, axis=0).T, states[model.spin_state]
        defective = np.linalg.det(modes) == 0
        modes[defective] = np.nan
        amplitudes = np.linalg.solve(modes, rattle[..., None].astype(complex))[..., 0]
        rocking = np.argsort(-rates.imag, axis=1)[:, :2]
        growth = 2 * np.take_along_axis(rates.real, rocking, axis=1).T
        whole = cls(model, turning, rates, modes, amplitudes, growth, growth)
        energies = np.array([whole._energy(constants, mode) for mode in rocking.T])
        return cls(model, turning, rates, modes, amplitudes, growth, energies)

    def select(self, cells: Array) -> Rattle:
        return Rattle(
            self.model, self.turning[cells], self.rates[cells], self.modes[cells], self.amplitudes[cells],
            self.growth[:, cells], self.energies[:, cells],
        )  # fmt: skip

    def _energy(self, constants: Array, mode: Array) -> Array:
        cells = np.arange(len(mode))
        shape = 2 * self.modes[cells, :, mode] * self.amplitudes[cells, mode, None]
        total = np.zeros(len(mode))
        # Modes that are nearly one have huge amplitudes that cancel, and no energy that is a number.
        with np.errstate(invalid="ignore"):
            for part in (shape.real, shape.imag):
                _, rattle, inertia = self.model.energy(self._with_spin(part), constants)
                total += rattle / inertia
        return total

    def at(self, time: Array) -> Array:
        """States after `time`, shape (states, cells)."""
        # What is exactly zero stays so, however far a growing exponential overflows.
        exponents = np.where(self.amplitudes == 0, 0.0, self.rates * time[:, None])
        moved = self.amplitudes * np.exp(exponents)
        return self._with_spin((self.modes @ moved[..., None])[..., 0].real)

    def _with_spin(self, rattle: Array) -> Array:
        return np.insert(rattle.T, self.model.spin_state, self.turning, axis=0)

    def time_to(self, energy: Array) -> Array:
        """Time until a growing mode reaches `energy`, shape (cells,); infinite where none grows."""
        with np.errstate(divide="ignore", invalid="ignore"):
            times = np.where(self.growth > 0, np.log(energy / np.maximum(self.energies, _ZERO)) / self.growth, np.inf)
        return np.asarray(np.maximum(np.fmin(*times), 0.0))

    def validity(self, bending: Array, distance: Array, spin: Array, tolerance: float) -> tuple[Array, Array]:
        """Begin and end of the time in which this resolution holds to `tolerance` in spin, shape (cells,).

        Parameters
        ----------
        bending : as `bending` gives it, shape (cells,)
        distance : of the spin from the next critical one, shape (cells,)
        spin : shape (cells,)

        Notes
        -----
        A share δ of a mode's amplitude moves what it will do later by δ over its rate in time, and so
        the spin by about δ n; hence δ = tolerance/n.  All conditions are linear in time once the
        logarithms are taken.  Modes that both decay hide nothing that would matter.
        """
        with np.errstate(divide="ignore"):
            log_e, log_c = np.log(np.maximum(self.energies, _ZERO)), np.log(bending)
            log_share = np.log(tolerance / np.abs(spin))
            log_cap = np.log(_TURN_SHARE * tolerance * np.abs(distance))
        begin, end = np.zeros_like(spin), np.where(np.isnan(self.energies).any(axis=0), 0.0, np.inf)
        grows = self.growth.max(axis=0) > 0
        for strong, weak in ((0, 1), (1, 0)):
            e, g = log_e[strong], self.growth[strong]
            difference, rate = 0.5 * (e - log_e[weak]) - log_share, 0.5 * (g - self.growth[weak])
            conditions = ((log_c + e + difference, g + rate), (np.log(_ROUND_OFF) + difference, rate))
            for excess, change in ((e - log_cap, g), *((np.where(grows, x, -np.inf), r) for x, r in conditions)):
                with np.errstate(divide="ignore", invalid="ignore"):
                    crossing = -excess / change
                begin = np.where((excess > 0) & (change < 0), np.fmax(begin, crossing), begin)
                end = np.where(change > 0, np.fmin(end, crossing), end)
                end = np.where((excess > 0) & (change >= 0), 0.0, end)
        return begin, end


def bending(columns: Columns) -> Array:
    """Bound on how much a rattle of e = 1 spin² bends the linear motion: its share of the normal force, shape (cells,).

    Rocking about one axis at the height c, R - 1 = (a² - c²)/c φ'² with φ'² = I3 e / (I + c²).
    """
    a, b, c = columns["a"], columns["b"], columns["c"]
    I1, I2, I3 = ellipsoid.inertia(columns)
    return np.asarray(I3 / c * np.maximum((a**2 - c**2) / (I2 + c**2), (b**2 - c**2) / (I1 + c**2)))
