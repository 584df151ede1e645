"""Small rattle about steady upright spin, from a model's own right-hand side.

With n constant the rattle obeys a linear system; its eigenvalues say at which spins it grows.
"""

from __future__ import annotations

import numpy as np

from sweep.models.model import Array, Columns, Model, stack

# Beyond this spin, in sqrt(g/c), upright spin is taken as stable for good: fifty times a hand's.
_SPIN_LIMIT = 10.0

# Spins looked at, beyond n_c1, for another stable range.
_OUTER_SAMPLES = 24


def jacobian(model: Model, constants: Array, spin: Array) -> Array:
    """Jacobian of the rattle at upright spin, shape (cells, m, m), m = number of states less spin.

    By complex steps of 1e-30: to the last digit, without a difference or a second derivation.
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


def growth_rate(model: Model, constants: Array, spin: Array) -> Array:
    """Largest real part of the rattle's eigenvalues: above zero, it grows.  Shape (cells,)."""
    return np.asarray(np.linalg.eigvals(jacobian(model, constants, spin)).real.max(axis=-1))


def fastest_motion(model: Model, columns: Columns) -> Array:
    """Largest |λ| of the rattle at the fastest spins within reach, friction's quick decay left out.

    What an integrator has to follow, in sqrt(g/c), shape (cells,); 0 where nothing moves.
    """
    constants, reach = stack(model.constants(columns)), fastest_spin(model, columns)
    values = np.concatenate([np.linalg.eigvals(jacobian(model, constants, spin)) for spin in (reach, -reach)], axis=-1)
    moving = -values.real <= np.abs(values.imag)
    return np.asarray(np.where(moving, np.abs(values), 0.0).max(axis=-1))


def fastest_spin(model: Model, columns: Columns) -> Array:
    """The |spin| that a start could reach if all its energy went into it, shape (cells,)."""
    start = stack(model.start(columns)), stack(model.constants(columns))
    spin, rattle, inertia = model.energy(*start)
    return np.asarray(np.sqrt(spin**2 + 2 * rattle / inertia))


def critical_spins(model: Model, columns: Columns, guess: tuple[Array, Array]) -> tuple[Array, Array]:
    """n_c1+ and n_c1- of the model itself: the ends of the spins about zero at which rattle decays.

    Parameters
    ----------
    columns : physical parameters, each of shape (cells,)
    guess : where to look first, positive and negative, such as the paper's n_c1±; NaN is no guess

    Returns
    -------
    Two arrays of shape (cells,): ±inf where the rattle decays at all spins up to the limit of the
    search, NaN where it does not decay at rest (no friction, or no dissipation in the model).
    """
    constants = stack(model.constants(columns))
    # Without friction the real parts are zero but for rounding.
    at_rest = growth_rate(model, constants, np.zeros(constants.shape[1])) < -1e-13
    upper, lower = (_boundary(model, constants, at_rest, side) for side in guess)
    return upper, np.where(np.isinf(lower), -np.inf, lower)


def outer_range(model: Model, columns: Columns, n_c1: Array, reach: Array) -> tuple[Array, Array]:
    """The next range of spins beyond `n_c1` at which the rattle decays: its near and far end.

    Nearly round bodies have one: a fast spin detunes the two modes whose coupling feeds the rattle.

    Parameters
    ----------
    n_c1 : critical spin of either sign, shape (cells,), where the first range ends
    reach : largest |spin| of interest, shape (cells,)

    Returns
    -------
    Two arrays of shape (cells,): NaN where there is no such range within reach; the far end is
    infinite where it lies beyond reach.
    """
    constants, sign = stack(model.constants(columns)), np.sign(n_c1)
    near, far = np.full_like(n_c1, np.nan), np.full_like(n_c1, np.nan)
    cells = np.flatnonzero(np.isfinite(n_c1) & (np.abs(n_c1) < reach))
    if not len(cells):
        return near, far
    spins = sign[cells] * np.geomspace(1.001 * np.abs(n_c1[cells]), 1.001 * reach[cells], _OUTER_SAMPLES)
    growth = np.array([growth_rate(model, constants[:, cells], spin) for spin in spins])
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
            lambda spin, which, at=at: growth_rate(model, constants[:, cells[at[which]]], spin),
            spins[i, at], spins[i + 1, at], growth[i, at], growth[i + 1, at],
        )  # fmt: skip
    return near, np.where(np.isinf(far), sign * np.inf, far)


def _boundary(model: Model, constants: Array, at_rest: Array, guess: Array) -> Array:
    result = np.where(at_rest, np.inf, np.nan)
    cells = np.flatnonzero(at_rest & np.isfinite(guess))
    if not len(cells):
        return result

    def growth(spin: Array, which: Array) -> Array:
        return growth_rate(model, constants[:, which], spin)

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
    """Roots of many functions at once by the Anderson-Björck regula falsi, to the last digits."""
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
        # The newest point becomes `high`; the far end keeps its value, scaled down if it stays again.
        low[active] = np.where(same, x1, x2)
        f_low[active] = np.where(same, f1 * np.where(shrink > 0, shrink, 0.5), f2)
        high[active], f_high[active] = x, fx
    return high
