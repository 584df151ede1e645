"""The slip model by SciPy's adaptive DOP853: another integrator, with steps and errors of its own."""

from functools import cache
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from sweep.jit import exactly_compiled
from sweep.models.ladder import slip
from sweep.models.model import stack, take


def motion(body: dict[str, np.ndarray], times: Any, *, rtol: float, atol: float) -> np.ndarray:
    """The seven states and the integral of the spin of one cell from t = 0, shape (8, times)."""
    constants = take(slip.MODEL.constants.of(body), 0)
    start = np.array([*stack(slip.MODEL.start(body))[:, 0], 0.0])
    solution = solve_ivp(
        _extended(), (0, times[-1]), start, "DOP853", times, args=(constants,), rtol=rtol, atol=atol
    )  # fmt: skip
    assert solution.success
    return np.asarray(solution.y)


def spin(body: dict[str, np.ndarray], time: float, method: str = "DOP853") -> float:
    """The spin of one cell, by one of SciPy's methods."""
    constants, extended = take(slip.MODEL.constants.of(body), 0), _extended()

    def slopes(t: float, y: np.ndarray) -> np.ndarray:
        return np.asarray(extended(t, y, constants)[:7])

    solution = solve_ivp(slopes, (0, time), stack(slip.MODEL.start(body))[:, 0], method, rtol=1e-11, atol=1e-15)
    assert solution.success
    return float(slip.MODEL.rhs(tuple(solution.y[:, -1]), constants)[1][0])


@cache
def _extended() -> Any:
    rhs = slip.MODEL.rhs

    @exactly_compiled
    def extended(_: float, y: np.ndarray, p: Any) -> np.ndarray:
        slopes, extras = rhs((y[0], y[1], y[2], y[3], y[4], y[5], y[6]), p)
        return np.array([slopes[0], slopes[1], slopes[2], slopes[3], slopes[4], slopes[5], slopes[6], extras[0]])

    return extended
