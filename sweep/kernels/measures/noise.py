"""Whether a mode of the rattle fell under the round-off of the other before it grew.

A mode that decays to 1e-16 of the other is filled in by round-off: when it grows again, it grows from noise, and
the reversal that it makes comes too early.  Between two looks each mode's logarithm goes by its growth rate at
the mean spin, within what the energy at hand allows; how deep a mode was is asked when it has come back.

On 70 random bodies and starts to t = 30 000 (a = 10, δ = 0.03; truth in double-double) with dopri5's round-off,
33 of 35 flagged had a reversal off by more than 1 %, and 33 of 34 of those were flagged.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sweep.jit import inline
from sweep.models import linear, slip
from sweep.models.coefficients import coefficients, normal_coordinates
from sweep.models.model import Array, Columns, stack

# Ratio of amplitudes below which a mode is round-off of the other.
DEPTH = 1e-14

# At the end a rattle that grew from noise counts from this energy on, in units of the spin's.
SEEN = 1e-4

# Spins, in the fastest within reach, through which the growth rates are fitted.
_NODES = np.array([0.0, -1.0, 1.0, -0.5, 0.5])
_FIT = np.linalg.inv(_NODES[:, None] ** np.arange(len(_NODES)))

_RATES = tuple(f"rate{k}_{i}" for k in (0, 1) for i in range(len(_NODES)))

ROWS = (
    "log_amplitude0", "log_amplitude1", "depth0", "depth1", *_RATES,
    "tracked", "tracked_spin", "tracked_reversals", "noise_limited",
)  # fmt: skip

_BODY = ("a", "b", "c", "delta", "mu")
_ZERO = 1e-300


def start_rows(columns: Columns, rattle: Array) -> dict[str, Array]:
    """The rows that do not start at zero, each of shape (cells,); `rattle` is the energy at the start."""
    rates = growth_coefficients(columns)
    shares = _shares(columns)
    result = {f"log_amplitude{k}": 0.5 * np.log(np.maximum(shares[k] * rattle, _ZERO)) for k in (0, 1)}
    return result | dict(zip(_RATES, rates.reshape(len(_RATES), -1), strict=True)) | {"tracked_spin": columns["n0"]}


def growth_coefficients(columns: Columns) -> Array:
    """Coefficients of Re λ(n) = Σ c_i n^i of the slower and the faster mode, shape (2, nodes, cells).

    The fastest spin within reach is rounded up, so that most starts of a body share a fit: five spins for
    4000 bodies take 0.3 s.  Three were off by half at b = 6, where the modes nearly meet.
    """
    reach = np.exp2(np.ceil(8 * np.log2(np.maximum(linear.fastest_spin(slip.MODEL, columns), 1e-6))) / 8)
    bodies, which = np.unique(stack((*(columns[name] for name in _BODY), reach)), axis=1, return_inverse=True)
    constants = stack(slip.constants(dict(zip(_BODY, bodies, strict=False))))
    rates = np.stack([_growth(constants, node * bodies[-1]) for node in _NODES], axis=1)
    # Not a matrix product: BLAS rounds a column by how many there are beside it.
    fit = [sum(w * rates[:, j] for j, w in enumerate(row)) / bodies[-1] ** i for i, row in enumerate(_FIT)]
    return np.stack(fit, axis=1)[:, :, which.reshape(-1)]


def _growth(constants: Array, spin: Array) -> Array:
    """Re λ of the two rocking modes, the slower first, shape (2, bodies)."""
    values = np.linalg.eigvals(linear.jacobian(slip.MODEL, constants, spin))
    order = np.argsort(-values.imag, axis=1)[:, 1::-1]
    return np.asarray(np.take_along_axis(values.real, order, axis=1).T)


def _shares(columns: Columns) -> Array:
    """Of the rattle's energy at the start in the slower and the faster mode (abdef), shape (2, cells)."""
    k = coefficients(columns)
    X, Y = normal_coordinates(columns)
    energies = stack((np.abs(k.nu1**2 - 1) * X**2, np.abs(k.nu2**2 - 1) * Y**2))
    energies = np.where(k.nu1 < k.nu2, energies, energies[::-1])
    total = energies.sum(axis=0)
    return np.asarray(np.divide(energies, total, out=np.zeros_like(energies), where=total > 0))


def make_track(rows: tuple[str, ...], lanes: int) -> Any:
    """Compiled (group, lane, running, ended, rattle, spin): follow the modes of a lane from one look to the next.

    `ended`: whether this is the last look, at a rattle that is of account.
    """
    LOG0, LOG1, DEPTH0, DEPTH1 = (rows.index(name) * lanes for name in ROWS[:4])
    TRACKED, SPIN, COUNTED, FLAG = (rows.index(name) * lanes for name in ROWS[-4:])
    RATE0, RATE1, terms = rows.index("rate0_0") * lanes, rows.index("rate1_0") * lanes, len(_NODES)
    DONE, STEP, PERIOD, CLOSED, COUNT = (
        rows.index(name) * lanes for name in ("done", "step", "period", "closed_window", "reversals")
    )
    deep = float(np.log(DEPTH))

    @inline
    def track(group: Any, lane: int, running: Any, ended: Any, rattle: Any, spin: Any) -> None:
        closed, done, count = group[CLOSED + lane], group[DONE + lane], group[COUNT + lane]
        mean = closed / group[PERIOD + lane] if closed != 0.0 else spin
        n = 0.5 * (mean + group[SPIN + lane])
        time = (done - group[TRACKED + lane]) * group[STEP + lane]
        rate0 = rate1 = 0.0
        for i in range(terms - 1, -1, -1):
            rate0 = rate0 * n + group[RATE0 + i * lanes + lane]
            rate1 = rate1 * n + group[RATE1 + i * lanes + lane]
        top = 0.5 * np.log(rattle if rattle > _ZERO else _ZERO)
        log0, log1 = group[LOG0 + lane] + rate0 * time, group[LOG1 + lane] + rate1 * time
        log0, log1 = log0 if log0 < top else top, log1 if log1 < top else top
        # Energy that neither mode has by this account is the growing one's.
        short = (log0 < top - 1.0) & (log1 < top - 1.0)
        log0 = top if short & (rate0 > rate1) else log0
        log1 = top if short & (rate1 >= rate0) else log1
        depth0, depth1 = group[DEPTH0 + lane], group[DEPTH1 + lane]
        depth0 = log0 - log1 if log0 - log1 < depth0 else depth0
        depth1 = log1 - log0 if log1 - log0 < depth1 else depth1
        # The larger mode has come back, from where it was at its lowest.
        larger = log1 > log0
        reverses = count != group[COUNTED + lane]
        noise = (reverses | ended) & ((depth1 if larger else depth0) < deep)
        if running:
            group[LOG0 + lane], group[LOG1 + lane] = log0, log1
            group[DEPTH0 + lane] = 0.0 if reverses & (not larger) else depth0
            group[DEPTH1 + lane] = 0.0 if reverses & larger else depth1
            group[TRACKED + lane], group[SPIN + lane], group[COUNTED + lane] = done, mean, count
            group[FLAG + lane] = 1.0 if noise else group[FLAG + lane]

    return track
