"""Linear stability of steady upright spin, from the right-hand side of a model itself.

At constant n a small rattle obeys a linear system, whose eigenvalues say at which spins it grows.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sweep.models.model import Array, Columns, Model, stack, take

# The search for critical spins ends at this spin, in sqrt(g/c), fifty times what a hand gives: upright spin that
# is stable up to here is taken to be stable at any spin.
_SPIN_LIMIT = 10.0

# Number of spins beyond n_c1 at which another stable range is searched for.
_OUTER_SAMPLES = 24


def jacobian(model: Model, constants: Any, spin: Array) -> Array:
    """Jacobian of the rattle at upright spin, shape (cells, m, m), where m is the number of states without the spin.

    Computed by complex steps of 1e-30: accurate to the last digit, because no difference is taken, and without
    deriving the equations a second time.
    """
    states = stack(model.upright(spin)).astype(complex)
    rattle = [i for i in range(len(model.states)) if i != model.spin_state]
    columns = []
    for i in rattle:
        shifted = states.copy()
        shifted[i] += 1e-30j
        slopes, _ = model.rhs(shifted, constants)
        columns.append(np.stack(np.broadcast_arrays(*slopes))[rattle].imag / 1e-30)
    return np.moveaxis(np.stack(columns, axis=-1), 0, 1)


def growth_rate(model: Model, constants: Any, spin: Array) -> Array:
    """Largest real part of the rattle's eigenvalues, in sqrt(g/c), shape (cells,): positive where the rattle grows."""
    return np.asarray(np.linalg.eigvals(jacobian(model, constants, spin)).real.max(axis=-1))


def fastest_motion(model: Model, columns: Columns) -> Array:
    """Largest |λ| of the rattle at the fastest spins within reach, leaving out the fast decay due to friction.

    This is the motion that an integrator has to follow, in sqrt(g/c), shape (cells,); 0 where nothing moves.
    """
    constants, reach = model.constants.of(columns), fastest_spin(model, columns)
    values = np.concatenate([np.linalg.eigvals(jacobian(model, constants, spin)) for spin in (reach, -reach)], axis=-1)
    moving = -values.real <= np.abs(values.imag)
    return np.asarray(np.where(moving, np.abs(values), 0.0).max(axis=-1))


def fastest_spin(model: Model, columns: Columns) -> Array:
    """The |spin| that a trajectory would reach if all its energy went into it, in sqrt(g/c), shape (cells,)."""
    spin, rattle, inertia = model.energy(model.start(columns), model.constants.of(columns))
    return np.asarray(np.sqrt(spin**2 + 2 * rattle / inertia))


def critical_spins(model: Model, columns: Columns, guess: tuple[Array, Array]) -> tuple[Array, Array]:
    """n_c1+ and n_c1- of the model itself: the ends of the range of spins about zero in which the rattle decays.

    Parameters
    ----------
    columns : physical parameters, each of shape (cells,)
    guess : where to search first, on the positive and on the negative side, such as the paper's n_c1±;
        NaN where there is no critical spin to search for

    Returns
    -------
    Two arrays of shape (cells,), in sqrt(g/c): ±inf where the guess is NaN or the rattle decays at all spins
    up to the limit of the search; NaN where it does not decay at rest (no friction, or no dissipation in the model).
    """
    constants = model.constants.of(columns)
    # Without friction the real parts are zero except for rounding.
    at_rest = growth_rate(model, constants, np.zeros_like(constants[0])) < -1e-13
    upper, lower = (_boundary(model, constants, at_rest, side) for side in guess)
    return upper, np.where(np.isinf(lower), -np.inf, lower)


def outer_range(model: Model, columns: Columns, n_c1: Array, reach: Array) -> tuple[Array, Array]:
    """The near and the far end of the next range of spins beyond `n_c1` in which the rattle decays.

    Nearly round bodies have such a range: a fast spin detunes the two modes whose coupling feeds the rattle.

    Parameters
    ----------
    n_c1 : critical spin, of either sign, at which the first range ends, shape (cells,)
    reach : largest |spin| of interest, shape (cells,)

    Returns
    -------
    Two arrays of shape (cells,), in sqrt(g/c): NaN where there is no such range within reach; the far end is
    infinite if it lies beyond reach.
    """
    constants, sign = model.constants.of(columns), np.sign(n_c1)
    near, far = np.full_like(n_c1, np.nan), np.full_like(n_c1, np.nan)
    cells = np.flatnonzero(np.isfinite(n_c1) & (np.abs(n_c1) < reach))
    if not len(cells):
        return near, far
    spins = sign[cells] * np.geomspace(1.001 * np.abs(n_c1[cells]), 1.001 * reach[cells], _OUTER_SAMPLES)
    growth = np.array([growth_rate(model, take(constants, cells), spin) for spin in spins])
    enters = (growth[:-1] >= 0) & (growth[1:] < 0)
    first = np.where(enters.any(axis=0), enters.argmax(axis=0), _OUTER_SAMPLES)
    later = np.arange(_OUTER_SAMPLES - 1)[:, None] > first
    leaves = (growth[:-1] < 0) & (growth[1:] >= 0) & later
    last = np.where(leaves.any(axis=0), leaves.argmax(axis=0), _OUTER_SAMPLES)
    far[cells[enters.any(axis=0)]] = np.inf
    for end, sample in ((near, first), (far, last)):
        at = np.flatnonzero(sample < _OUTER_SAMPLES)
        i = sample[at]
        end[cells[at]] = _root(
            lambda spin, which, at=at: growth_rate(model, take(constants, cells[at[which]]), spin),
            spins[i, at], spins[i + 1, at], growth[i, at], growth[i + 1, at],
        )  # fmt: skip
    return near, np.where(np.isinf(far), sign * np.inf, far)


def _boundary(model: Model, constants: Any, at_rest: Array, guess: Array) -> Array:
    """The critical spin on the side of `guess`, shape (cells,); `at_rest` says where the rattle decays at rest."""
    result = np.where(at_rest, np.inf, np.nan)
    cells = np.flatnonzero(at_rest & np.isfinite(guess))
    if not len(cells):
        return result

    def growth(spin: Array, which: Array) -> Array:
        return growth_rate(model, take(constants, which), spin)

    # Walk outwards from half the guess until the rattle grows.
    low, high = np.zeros(len(cells)), 0.5 * guess[cells]
    g_low, g_high = growth(low, cells), growth(high, cells)
    while (walking := (g_high < 0) & (np.abs(high) < _SPIN_LIMIT)).any():
        low, g_low = np.where(walking, high, low), np.where(walking, g_high, g_low)
        high = np.where(walking, 1.7 * high, high)
        g_high[walking] = growth(high[walking], cells[walking])
    found = g_high >= 0
    low, high, g_low, g_high = low[found], high[found], g_low[found], g_high[found]
    result[cells[found]] = _root(lambda spin, at: growth(spin, cells[found][at]), low, high, g_low, g_high)
    return result


def _root(f, low: Array, high: Array, f_low: Array, f_high: Array) -> Array:  # type: ignore[no-untyped-def]
    """Roots of many functions at once, to the last digits, by the regula falsi of Anderson and Björck."""
    for _ in range(60):
        active = np.flatnonzero(np.abs(high - low) > 4e-15 * np.abs(high))
        active = active[f_high[active] != 0]
        if not len(active):
            break
        x1, x2, f1, f2 = low[active], high[active], f_low[active], f_high[active]
        x = np.clip(x2 - f2 * (x2 - x1) / (f2 - f1), np.minimum(x1, x2), np.maximum(x1, x2))
        fx = f(x, active)
        same = np.sign(fx) == np.sign(f2)
        shrink = 1 - fx / f2
        # The newest point becomes `high`.  If the other end stays where it is, its function value is scaled down,
        # as it might otherwise stay for ever.
        low[active] = np.where(same, x1, x2)
        f_low[active] = np.where(same, f1 * np.where(shrink > 0, shrink, 0.5), f2)
        high[active], f_high[active] = x, fx
    return high
