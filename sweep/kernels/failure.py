"""Find out whether a failure is real, by approaching it in ever shorter steps.

A step that is too long has stages at states that the trajectory never visits.  If one of these has no positive normal
force, or no positive Painlevé denominator, the kernel stops, but the step alone may be at fault.  So the same motion
is integrated again from the last sound state, in steps of dopri5 with error control.  A step with such a stage is
tried again at half its length.  If this never succeeds, the failure is one of the body, at this place and time.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from sweep.jit import Cached, compiled, parallel
from sweep.kernels.codegen import make_gather
from sweep.kernels.runge_kutta import DOPRI5, make_step
from sweep.kernels.status import DIVERGED, LIFT_OFF, PARADOX, RUNNING, TOPPLED
from sweep.models.generated import compile_inline
from sweep.models.model import Array, Model, stack

# Relative error of a step.  States below `_SMALL` count as if they were of this size.
_TOLERANCE, _SMALL = 1e-12, 1e-3

# A step that fails although it is shorter than this, in sqrt(c/g), has met a true failure.
_SHORTEST = 1e-14

# Where the states change too fast for any step, a failure this near, in sqrt(c/g), is the reason.
_NEAR = 1e-6

# The body has toppled when the cosine of its tilt is below this.  The equations divide by it; from here the time left
# is extrapolated, with an error of the order of its square.
_UPRIGHT = 1e-5

# Largest number of steps, which take two seconds; beyond it nothing is confirmed.
_MOST_STEPS = 3_000_000


def approach(model: Model, states: Array, constants, stretch: Array) -> tuple[Array, Array, Array, Array]:
    """Find out what happens to trajectories within a stretch of time.

    Parameters
    ----------
    states : as `model.rhs` takes them, shape (states, cells)
    constants : as `model.rhs` takes them, each of shape (cells,)
    stretch : length of the stretch, in sqrt(c/g), shape (cells,)

    Returns
    -------
    The status of each trajectory, shape (cells,): `LIFT_OFF`, `PARADOX` or `TOPPLED`; `RUNNING` if it passes the
    stretch; `DIVERGED` if no step is short enough.  Second, the time from the beginning of the stretch to this,
    in sqrt(c/g), shape (cells,).  Third, the spin at that time, shape (cells,).  Fourth, how much the spin may change
    in the time that the last step leaves, shape (cells,): near a paradox it changes as the root of the time.
    """
    status, time, spin, doubt = found = np.empty((4, len(stretch)))
    rows = np.ascontiguousarray(np.concatenate([stack(tuple(states)), stack(tuple(constants))]).T)
    compiled_approach(model)(rows, np.ascontiguousarray(stretch, dtype=float), found)
    return status, time, spin, doubt


@cache
def compiled_approach(model: Model) -> Cached:
    """Compiled (rows, stretch, found) -> None: `approach` for `rows`, states and constants of the cells."""
    from numba import prange

    n, record = len(model.states), model.constants
    load = make_gather("rows, i", (f"rows[i, {j}]" for j in range(n)))
    load_constants = make_gather("rows, i", (f"rows[i, {n + j}]" for j in range(len(record._fields))), record)
    integrate = _make_integrate(model)

    def run(rows, stretch, found):
        for i in prange(len(rows)):
            ends = integrate(load(rows, i), load_constants(rows, i), stretch[i])
            found[0, i], found[1, i], found[2, i], found[3, i] = ends

    return parallel(run, "(f8[:, ::1], f8[::1], f8[:, ::1])", f"approach-{model.key}")


def _make_integrate(model: Model):
    """Compiled (states, constants, stretch) -> (status, time, spin, doubt): `approach` for one trajectory."""
    n, rhs, tilt = len(model.states), model.rhs, model.tilt
    # Not inlined: it would be compiled three times over.
    step = compiled(make_step(DOPRI5, model.rhs, n))
    terms = [f"abs(one[{i}] - two[{i}]) / max(abs(two[{i}]), {_SMALL!r})" for i in range(n)]
    difference = compile_inline("difference", "one, two", [f"return max({', '.join(terms)})"], {})
    # The difference of one step from two of half the length exceeds the error of the latter by this factor.
    allowed = _TOLERANCE * (2**DOPRI5.error_order - 1)

    @compiled
    def kind(y, p, infinite):
        """Return the kind of failure that a very short step from `y` has met.

        Its stages do not show it.  Where the denominator goes to zero the force goes to infinity, or stays finite
        because the numerator goes to zero as well; then either sign may come first.  Where the body lifts off, only the
        force goes to zero.
        """
        _, (_, _, force, denominator) = rhs(y, p)
        jams = (denominator <= 0.0) | (denominator < force)
        return DIVERGED if infinite else (PARADOX if jams else LIFT_OFF)

    @compiled
    def probe(y, p):
        """Return the kind of failure just ahead of `y`, where errors do not even allow the shortest step.

        Near the paradox the denominator goes to zero as the root of the time left.
        """
        h = _SHORTEST
        while h < _NEAR:
            _, _, _, sound, airborne, jammed = step(y, p, h)
            if not sound:
                return kind(y, p, not (airborne | jammed))
            h = 2.0 * h
        return DIVERGED

    @compiled
    def spin(y, p):
        _, (now, _, _, _) = rhs(y, p)
        return now

    @compiled
    def integrate(y, p, stretch):
        time, h, cosine, last = 0.0, stretch / 8.0, np.sqrt(1.0 - tilt(y)), y
        for _ in range(_MOST_STEPS):
            if time >= stretch:
                return RUNNING, stretch, spin(y, p), 0.0
            h = min(h, stretch - time)
            one, _, _, sound1, airborne1, jammed1 = step(y, p, h)
            half, _, _, sound2, airborne2, jammed2 = step(y, p, 0.5 * h)
            two, _, _, sound3, airborne3, jammed3 = step(half, p, 0.5 * h)
            if not (sound1 & sound2 & sound3):
                h = 0.5 * h
                if h < _SHORTEST:
                    met = airborne1 | jammed1 | airborne2 | jammed2 | airborne3 | jammed3
                    return kind(y, p, not met), time, spin(y, p), abs(spin(y, p) - spin(last, p))
                continue
            error = difference(one, two) / allowed
            if not error <= 1.0:
                h = h * max(0.2, 0.9 * error**-0.2) if error < 1e30 else 0.2 * h
                if h < _SHORTEST:
                    return probe(y, p), time, spin(y, p), abs(spin(y, p) - spin(last, p))
                continue
            last, y, time = y, two, time + h
            before, cosine = cosine, np.sqrt(1.0 - tilt(y))
            if (cosine < _UPRIGHT) & (cosine < before):
                left = cosine / (before - cosine)
                return TOPPLED, time + left * h, spin(y, p) + left * (spin(y, p) - spin(last, p)), 0.0
            h = h * min(2.0, 0.9 * error**-0.2) if error > 0.0 else 2.0 * h
        return DIVERGED, time, spin(y, p), 0.0

    return integrate
